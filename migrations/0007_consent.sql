-- Consent of subjects: what they signed, and that they withdrew. The newest row counts; none is ever changed.

create table consents (
    seq        integer primary key autoincrement,
    subject_id text not null references subjects (id),
    kind       text not null constraint consents_kind check (kind in ('given', 'withdrawn')),
    -- given: which version of which form was signed. withdrawn: why, as far as the subject says.
    note       text not null constraint consents_note_length check (length(note) between 1 and 2000),
    actor      text not null,
    created_at text not null
) strict;

create index consents_by_subject on consents (subject_id, seq);

create view withdrawn_subjects as
select subject_id from consents c
where kind = 'withdrawn' and seq = (select max(seq) from consents d where d.subject_id = c.subject_id);

create trigger consents_no_update before update on consents
begin select raise(abort, 'consents are append-only'); end;
create trigger consents_no_delete before delete on consents
begin select raise(abort, 'consents are append-only'); end;

-- Nothing new of a subject who withdrew, whichever way it comes in.
create trigger studies_need_consent before insert on studies
when new.subject_id in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
create trigger studies_go_on_with_consent before update of state on studies
when new.state in ('running', 'waiting') and new.subject_id in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
create trigger trials_need_consent before insert on trials
when (select subject_id from studies where id = new.study_id) in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
create trigger trials_go_on_with_consent before update of state on trials
when new.state in ('queued', 'running')
    and (select subject_id from studies where id = new.study_id) in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
create trigger feedback_needs_consent before insert on feedback
when (select subject_id from studies where id = new.study_id) in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
create trigger presentations_need_consent before insert on presentations
when (select subject_id from studies where id = new.study_id) in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
create trigger presentation_answers_need_consent before insert on presentation_answers
when (select s.subject_id from presentations p join studies s on s.id = p.study_id where p.id = new.presentation_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
