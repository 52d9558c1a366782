-- Studies that came from elsewhere: from which file, whether somebody vouched for it, and what of it could not be checked.

create table imports (
    seq             integer primary key autoincrement,
    study_id        text not null references studies (id),
    -- SHA-256 of the archive, as `sha256sum` says it.
    file_sha256     text not null constraint imports_file check (length(file_sha256) = 64),
    -- Public key of whoever signed the archive, hexadecimal (null: nobody did).
    signed_by       text constraint imports_signed_by check (signed_by is null or length(signed_by) = 64),
    -- 1: the import named that key as one to trust.
    trusted         integer not null constraint imports_trusted check (trusted in (0, 1)),
    -- Trials with a Gait RMSE that could not be computed anew, because the archive has no gait of theirs.
    unchecked_rmse  integer not null constraint imports_unchecked check (unchecked_rmse >= 0),
    actor           text not null,
    created_at      text not null
) strict;

create index imports_by_study on imports (study_id, seq);

create trigger imports_no_update before update on imports
begin select raise(abort, 'imports are append-only'); end;
create trigger imports_no_delete before delete on imports
begin select raise(abort, 'imports are append-only'); end;
