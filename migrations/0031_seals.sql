-- What stands in the record is sealed in the transaction that writes it: a hash of the row, chained with the seals
-- before. A row that another hand changed, added or took away does not fit its newest seal; `gaitwright audit verify`
-- finds it. Which tables are sealed, and how, is said in the program (store/seals.rs): what does not come through it has
-- no seal.
create table seals (
    seq      integer primary key autoincrement,
    -- The table of the row, and its primary key.
    evidence text not null,
    key      text not null,
    -- SHA-256 of the row; empty: the row was taken away.
    sha256   text not null constraint seals_sha256_length check (length(sha256) in (0, 64)),
    -- SHA-256 of the seal before, and of this one with it.
    previous text not null constraint seals_previous_length check (length(previous) = 64),
    hash     text not null constraint seals_hash_length check (length(hash) = 64)
) strict;

create index seals_by_row on seals (evidence, key, seq);

create trigger seals_no_update before update on seals
begin select raise(abort, 'seals are append-only'); end;
create trigger seals_no_delete before delete on seals
begin select raise(abort, 'seals are append-only'); end;
