-- Reports that one gait is unsafe, from whoever saw or walked it. Reports that belong to a comparison are in remarks,
-- presentation_answers and lab_answers.

create table safety_reports (
    id         text primary key not null,
    trial_id   text not null references trials (id),
    source     text not null constraint safety_reports_source check (source in ('subject', 'clinician', 'script')),
    author     text not null constraint safety_reports_author_length check (length(author) between 1 and 80),
    note       text not null default '' constraint safety_reports_note_length check (length(note) <= 2000),
    created_at text not null
) strict;

create index safety_reports_by_trial on safety_reports (trial_id);

create trigger safety_reports_no_update before update on safety_reports
begin select raise(abort, 'safety reports are append-only'); end;
create trigger safety_reports_no_delete before delete on safety_reports
begin select raise(abort, 'safety reports are append-only'); end;
create trigger safety_reports_need_consent before insert on safety_reports
when (select s.subject_id from trials t join studies s on s.id = t.study_id where t.id = new.trial_id)
     in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
