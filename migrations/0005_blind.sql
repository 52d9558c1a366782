-- Blind comparisons: which two gaits a rater was shown, in which order, and what the rater said. Drawn and stored by
-- the server; the rater knows the token alone.

create table presentations (
    id           text primary key not null,
    token        text not null
                 constraint presentations_token_unique unique
                 constraint presentations_token_length check (length(token) = 64),
    study_id     text not null references studies (id),
    rater        text not null constraint presentations_rater_length check (length(rater) between 1 and 80),
    -- 1, 2, ... of this rater in this study.
    number       integer not null constraint presentations_number check (number >= 1),
    -- new: a pair that the study asks for; repeat: an earlier one with sides swapped; null: the same gait twice.
    kind         text not null constraint presentations_kind check (kind in ('new', 'repeat', 'null')),
    shown_first  text not null references trials (id),
    shown_second text not null references trials (id),
    repeats      text references presentations (id),
    -- Whether somebody had told this rater which gait is which before this was drawn.
    unblinded    integer not null constraint presentations_unblinded check (unblinded in (0, 1)),
    created_at   text not null,
    constraint presentations_number_unique unique (study_id, rater, number),
    constraint presentations_shape check (
        (kind = 'null') = (shown_first = shown_second) and (kind = 'repeat') = (repeats is not null)
    )
) strict;

create table presentation_answers (
    presentation_id text primary key not null references presentations (id),
    answer          text not null
                    constraint presentation_answers_answer
                    check (answer in ('first', 'second', 'no_difference', 'cannot_tell', 'unsafe_first',
                                      'unsafe_second', 'unsafe_both', 'withdrawn')),
    -- How long the rater took by the rater's own clock, ms; the server's clock dates the row.
    response_ms     integer constraint presentation_answers_response check (response_ms is null or response_ms >= 0),
    note            text not null default '' constraint presentation_answers_note check (length(note) <= 2000),
    -- What the learner hears of it; null: nothing.
    feedback_id     text references feedback (id),
    created_at      text not null
) strict;

create table unblindings (
    seq        integer primary key autoincrement,
    study_id   text not null references studies (id),
    rater      text not null,
    actor      text not null,
    reason     text not null constraint unblindings_reason_length check (length(reason) between 1 and 2000),
    created_at text not null
) strict;

create trigger presentations_no_update before update on presentations
begin select raise(abort, 'presentations are append-only'); end;
create trigger presentations_no_delete before delete on presentations
begin select raise(abort, 'presentations are append-only'); end;
create trigger presentation_answers_no_update before update on presentation_answers
begin select raise(abort, 'answers are append-only'); end;
create trigger presentation_answers_no_delete before delete on presentation_answers
begin select raise(abort, 'answers are append-only'); end;
create trigger unblindings_no_update before update on unblindings
begin select raise(abort, 'unblindings are append-only'); end;
create trigger unblindings_no_delete before delete on unblindings
begin select raise(abort, 'unblindings are append-only'); end;
