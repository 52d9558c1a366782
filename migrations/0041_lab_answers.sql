-- Which of the two walks with the device the person who walked found better, in terms of walks: 'first' is walk 2. The
-- learner hears of it when the order is told, not before: what it hears is shown, and would tell the order.
create table lab_answers (
    session_id text not null references lab_sessions (id),
    -- 1; a further one when the one before was taken back.
    number     integer not null constraint lab_answers_number check (number >= 1),
    answer     text not null
               constraint lab_answers_answer
               check (answer in ('first', 'second', 'no_difference', 'cannot_tell', 'unsafe_first', 'unsafe_second',
                                 'unsafe_both')),
    note       text not null default '' constraint lab_answers_note check (length(note) <= 2000),
    actor      text not null,
    created_at text not null,
    primary key (session_id, number)
) strict;

create table lab_answer_retractions (
    session_id text not null,
    number     integer not null,
    actor      text not null,
    created_at text not null,
    primary key (session_id, number),
    foreign key (session_id, number) references lab_answers (session_id, number)
) strict;

create trigger lab_answers_no_update before update on lab_answers
begin select raise(abort, 'answers are append-only'); end;
create trigger lab_answers_no_delete before delete on lab_answers
begin select raise(abort, 'answers are append-only'); end;
create trigger lab_answer_retractions_no_update before update on lab_answer_retractions
begin select raise(abort, 'retractions are append-only'); end;
create trigger lab_answer_retractions_no_delete before delete on lab_answer_retractions
begin select raise(abort, 'retractions are append-only'); end;

create trigger lab_answers_need_consent before insert on lab_answers
when (select s.subject_id from lab_sessions l join studies s on s.id = l.study_id where l.id = new.session_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
