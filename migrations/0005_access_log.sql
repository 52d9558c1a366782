-- Corrections of height and mass, and the access log.

-- Corrected height and mass of a subject. The newest row counts for studies made from then on; none is ever changed.
create table subject_corrections (
    seq          integer primary key autoincrement,
    subject_id   text not null references subjects (id),
    height_m     real not null constraint subject_corrections_height check (height_m between 1.0 and 2.5),
    body_mass_kg real not null constraint subject_corrections_mass check (body_mass_kg between 20 and 250),
    reason       text not null constraint subject_corrections_reason check (length(reason) between 1 and 2000),
    actor        text not null,
    created_at   text not null
) strict;

create index subject_corrections_by_subject on subject_corrections (subject_id, seq);

create trigger subject_corrections_no_update before update on subject_corrections
begin select raise(abort, 'corrections are append-only'); end;
create trigger subject_corrections_no_delete before delete on subject_corrections
begin select raise(abort, 'corrections are append-only'); end;
create trigger subject_corrections_need_consent before insert on subject_corrections
when new.subject_id in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

-- What a study solves with. Null: as the subject was first entered, before there were corrections.
alter table studies add column height_m real
    constraint studies_height check (height_m between 1.0 and 2.5);
alter table studies add column body_mass_kg real
    constraint studies_mass check (body_mass_kg between 20 and 250);

create trigger studies_keep_their_body before update of height_m, body_mass_kg on studies
begin select raise(abort, 'a study keeps the height and mass that it was made with'); end;

-- Who saw or exported data of subjects, and who was refused. Repeated requests within a short time are one row.
create table access_log (
    seq        integer primary key autoincrement,
    created_at text not null,
    last_at    text not null,
    times      integer not null constraint access_log_times check (times >= 1),
    kind       text not null constraint access_log_kind check (kind in ('view', 'export', 'refused')),
    actor      text not null,
    address    text not null,
    method     text not null,
    route      text not null,
    object     text not null,
    status     integer not null,
    study_id   text references studies (id),
    subject_id text references subjects (id)
) strict;

create index access_log_by_subject on access_log (subject_id, seq);

-- Rows are taken away by age alone, and a row here says so first.
create table access_prunings (
    seq             integer primary key autoincrement,
    up_to           integer not null,
    older_than_days integer not null constraint access_prunings_days check (older_than_days >= 1),
    actor           text not null,
    created_at      text not null
) strict;

create trigger access_log_no_update before update on access_log
begin select raise(abort, 'the access log is append-only'); end;
create trigger access_log_no_delete before delete on access_log
when old.seq > coalesce((select max(up_to) from access_prunings), 0)
begin select raise(abort, 'the access log is append-only'); end;
create trigger access_prunings_no_update before update on access_prunings
begin select raise(abort, 'prunings of the access log are append-only'); end;
create trigger access_prunings_no_delete before delete on access_prunings
begin select raise(abort, 'prunings of the access log are append-only'); end;
