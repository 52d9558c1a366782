-- A rater takes an answer back: what was said stays, and counts no more. What the learner heard of it is retracted in
-- the same transaction.
create table presentation_retractions (
    presentation_id text primary key not null references presentation_answers (presentation_id),
    created_at      text not null
) strict;

create trigger presentation_retractions_no_update before update on presentation_retractions
begin select raise(abort, 'retractions are append-only'); end;
create trigger presentation_retractions_no_delete before delete on presentation_retractions
begin select raise(abort, 'retractions are append-only'); end;
