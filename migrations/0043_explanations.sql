-- Why a trial has no gait: which bound, relaxed alone and solved again, gives one. A trial has one explanation; it follows from
-- what its solve left.

create table explanations (
    trial_id       text primary key not null references trials (id),
    -- Which version of the program made it.
    program        text not null,
    -- SHA-256 of what it was made from: the problem of the trial as its file gives it.
    problem_sha256 text not null constraint explanations_problem check (length(problem_sha256) = 64),
    -- The tuned bound of the smallest relaxation that gives a gait (null: no bound alone does).
    relieved_by    text,
    -- The whole explanation, JSON.
    document       text not null constraint explanations_document check (json_valid(document)),
    created_at     text not null
) strict;

create trigger explanations_no_update before update on explanations
begin select raise(abort, 'explanations are append-only'); end;
create trigger explanations_no_delete before delete on explanations
begin select raise(abort, 'explanations are append-only'); end;

create trigger explanations_need_consent before insert on explanations
when (select s.subject_id from trials t join studies s on s.id = t.study_id where t.id = new.trial_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

-- That somebody asked for one: it is made before those that nobody asked for, also by a process that starts later.
create table explanation_requests (
    trial_id   text primary key not null references trials (id),
    actor      text not null,
    created_at text not null
) strict;

create trigger explanation_requests_no_update before update on explanation_requests
begin select raise(abort, 'requests are append-only'); end;
create trigger explanation_requests_no_delete before delete on explanation_requests
begin select raise(abort, 'requests are append-only'); end;

create trigger explanation_requests_need_consent before insert on explanation_requests
when (select s.subject_id from trials t join studies s on s.id = t.study_id where t.id = new.trial_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
