-- Certificates of gaits: what an examination independent of the optimisation found. Made on demand; a gait has one per
-- version of the examination.

create table certificates (
    trial_id       text not null references trials (id),
    format_version integer not null constraint certificates_format_version check (format_version >= 1),
    passed         integer not null constraint certificates_passed check (passed in (0, 1)),
    -- The whole certificate, JSON.
    document       text not null constraint certificates_document check (json_valid(document)),
    created_at     text not null,
    primary key (trial_id, format_version)
) strict;

create trigger certificates_no_update before update on certificates
begin select raise(abort, 'certificates are append-only'); end;
create trigger certificates_no_delete before delete on certificates
begin select raise(abort, 'certificates are append-only'); end;
