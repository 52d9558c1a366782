-- What staff say of two gaits that is no preference: that they cannot tell which is better, that one must not be walked.
-- Raters say the same in presentation_answers.
create table remarks (
    id          text primary key not null,
    study_id    text not null references studies (id),
    first       text not null references trials (id),
    second      text not null references trials (id),
    answer      text not null
                constraint remarks_answer check (answer in ('cannot_tell', 'unsafe_first', 'unsafe_second', 'unsafe_both')),
    source      text not null constraint remarks_source check (source in ('subject', 'clinician', 'script')),
    author      text not null constraint remarks_author_length check (length(author) between 1 and 80),
    note        text not null default '' constraint remarks_note_length check (length(note) <= 2000),
    -- What the learner hears of it; null: nothing.
    feedback_id text references feedback (id),
    created_at  text not null,
    constraint remarks_two_gaits check (first <> second)
) strict;

create index remarks_by_study on remarks (study_id);

create table remark_retractions (
    remark_id  text primary key not null references remarks (id),
    author     text not null constraint remark_retractions_author_length check (length(author) between 1 and 80),
    reason     text not null constraint remark_retractions_reason_length check (length(reason) between 1 and 2000),
    created_at text not null
) strict;

-- Which answers that the learner heard came from a rater.
create index presentation_answers_by_feedback on presentation_answers (feedback_id) where feedback_id is not null;

create trigger remarks_no_update before update on remarks
begin select raise(abort, 'remarks are append-only'); end;
create trigger remarks_no_delete before delete on remarks
begin select raise(abort, 'remarks are append-only'); end;
create trigger remark_retractions_no_update before update on remark_retractions
begin select raise(abort, 'retractions are append-only'); end;
create trigger remark_retractions_no_delete before delete on remark_retractions
begin select raise(abort, 'retractions are append-only'); end;

create trigger remarks_same_study before insert on remarks
when exists (select 1 from trials where id in (new.first, new.second) and study_id <> new.study_id)
begin select raise(abort, 'a remark names a trial of another study'); end;
create trigger remarks_need_consent before insert on remarks
when (select subject_id from studies where id = new.study_id) in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
