-- What staff say who looked at a gait that somebody called unsafe: it may be walked with again, or it stays unsafe. What was
-- said stays as it was said; a review is of all that was said until an instant which whoever reviews has seen.
create table safety_reviews (
    id         text primary key not null,
    trial_id   text not null references trials (id),
    said_until text not null,
    verdict    text not null constraint safety_reviews_verdict check (verdict in ('walkable', 'unsafe')),
    author     text not null constraint safety_reviews_author_length check (length(author) between 1 and 80),
    reason     text not null constraint safety_reviews_reason_length check (length(reason) between 1 and 2000),
    created_at text not null
) strict;

create index safety_reviews_by_trial on safety_reviews (trial_id);

create trigger safety_reviews_no_update before update on safety_reviews
begin select raise(abort, 'reviews are append-only'); end;
create trigger safety_reviews_no_delete before delete on safety_reviews
begin select raise(abort, 'reviews are append-only'); end;

create trigger safety_reviews_need_consent before insert on safety_reviews
when (select s.subject_id from trials t join studies s on s.id = t.study_id where t.id = new.trial_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
