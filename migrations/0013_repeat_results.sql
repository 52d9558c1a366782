-- Whether a study tries actions whose gait is known from another trial. Null in studies of earlier versions: they do.

alter table studies add column repeat_results integer
    constraint studies_repeat_results_bool check (repeat_results in (0, 1));
