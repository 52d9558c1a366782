-- Muscle parameters of a person, where they are known better than the published table. The newest row counts; studies keep
-- what they were made with.

create table subject_muscles (
    seq        integer primary key autoincrement,
    subject_id text not null references subjects (id),
    definition text not null constraint subject_muscles_definition_json check (json_valid(definition)),
    actor      text not null,
    created_at text not null
) strict;

create index subject_muscles_by_subject on subject_muscles (subject_id, seq);

create trigger subject_muscles_no_update before update on subject_muscles
begin select raise(abort, 'muscle parameters are append-only'); end;
create trigger subject_muscles_no_delete before delete on subject_muscles
begin select raise(abort, 'muscle parameters are append-only'); end;
create trigger subject_muscles_need_consent before insert on subject_muscles
when new.subject_id in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
