-- What workers brought: one row for each attempt at a trial, also when it came too late to count.

create table results (
    trial_id    text not null references trials (id),
    attempt     integer not null constraint results_attempt check (attempt >= 1),
    worker      text not null constraint results_worker_length check (length(worker) between 1 and 200),
    -- 1: it is the result of the trial. 0: another attempt was under way or the trial had ended; evidence only.
    taken       integer not null constraint results_taken check (taken in (0, 1)),
    -- How the solve ended, and its figures where they can be written as JSON.
    status      text not null,
    report      text constraint results_report_json check (report is null or json_valid(report)),
    received_at text not null,
    constraint results_once primary key (trial_id, attempt)
) strict, without rowid;

create trigger results_no_update before update on results
begin select raise(abort, 'results are append-only'); end;
create trigger results_no_delete before delete on results
begin select raise(abort, 'results are append-only'); end;
