-- Studies whose trials are evaluated by scripts of the lab (ask and tell), further budgets, forks.

-- Who asked for the trial; null: the program evaluates it.
alter table trials add column asked_by text
    constraint trials_asked_by_length check (asked_by is null or length(asked_by) between 1 and 80);

-- A script may say that a trial converged without having figures of a solve. The constraint is widened in place, as
-- https://www.sqlite.org/lang_altertable.html section 7 describes; the next statement makes SQLite read it again.
pragma writable_schema = on;
update sqlite_schema
set sql = replace(sql, 'state <> ''converged'' or (gait_rmse_rad', 'state <> ''converged'' or asked_by is not null or (gait_rmse_rad')
where type = 'table' and name = 'trials';
pragma writable_schema = off;

alter table studies add column evaluation text not null default 'optimizer'
    constraint studies_evaluation check (evaluation in ('optimizer', 'script'));
-- No new trial once the solves so far took so many seconds together.
alter table studies add column solve_seconds_budget real
    constraint studies_solve_seconds check (solve_seconds_budget is null or solve_seconds_budget > 0);
-- Done when the best action stayed the same over so many results in a row.
alter table studies add column unchanged_limit integer
    constraint studies_unchanged check (unchanged_limit is null or unchanged_limit between 1 and 10000);
alter table studies add column forked_from text references studies (id);

create trigger trials_asked_by_fixed before update of asked_by on trials
when old.asked_by is not null
begin select raise(abort, 'who asked for a trial is fixed'); end;
