-- The record of a tuning: who walks with what, which actions were tried, what they gave, what was preferred.
--
-- Identifiers are UUIDv7 text, instants are RFC 3339 UTC text with milliseconds (sortable as text), numbers are SI.
-- Constraints are named: the store turns a violated name into a specific answer.
-- Evidence (feedback, retractions, events, gaits) is append-only by trigger.

create table subjects (
    id           text primary key not null,
    pseudonym    text not null
                 constraint subjects_pseudonym_unique unique
                 constraint subjects_pseudonym_length check (length(pseudonym) between 1 and 40),
    height_m     real not null constraint subjects_height check (height_m between 1.0 and 2.5),
    body_mass_kg real not null constraint subjects_mass check (body_mass_kg between 20 and 250),
    notes        text not null default '' constraint subjects_notes_length check (length(notes) <= 4000),
    created_at   text not null
) strict;

-- A device or a reference that changes is a new row: studies keep pointing at what they used.
create table devices (
    id         text primary key not null,
    name       text not null constraint devices_name_length check (length(name) between 1 and 80),
    definition text not null constraint devices_definition_json check (json_valid(definition)),
    sha256     text not null constraint devices_content_unique unique,
    created_at text not null
) strict;

create table reference_gaits (
    id         text primary key not null,
    name       text not null constraint reference_gaits_name_length check (length(name) between 1 and 200),
    definition text not null constraint reference_gaits_definition_json check (json_valid(definition)),
    sha256     text not null constraint reference_gaits_content_unique unique,
    created_at text not null
) strict;

create table studies (
    id                text primary key not null,
    name              text not null constraint studies_name_length check (length(name) between 1 and 120),
    subject_id        text not null references subjects (id),
    device_id         text not null references devices (id),
    reference_gait_id text not null references reference_gaits (id),
    muscles           integer not null constraint studies_muscles_bool check (muscles in (0, 1)),
    gait_settings     text not null constraint studies_gait_settings_json check (json_valid(gait_settings)),
    solve_options     text not null constraint studies_solve_options_json check (json_valid(solve_options)),
    -- Bounds that are not tuned keep these values.
    base_bounds       text not null constraint studies_base_bounds_json check (json_valid(base_bounds)),
    search_space      text not null constraint studies_search_space_json check (json_valid(search_space)),
    learner           text not null constraint studies_learner_json check (json_valid(learner)),
    feedback_mode     text not null
                      constraint studies_feedback_mode check (feedback_mode in ('automatic', 'human', 'mixed')),
    trial_budget      integer not null constraint studies_trial_budget check (trial_budget between 1 and 10000),
    parallel_trials   integer not null constraint studies_parallel_trials check (parallel_trials between 1 and 64),
    priority          integer not null default 0 constraint studies_priority check (priority between -10 and 10),
    -- JSON readers keep 53 bits of an integer.
    seed              integer not null constraint studies_seed check (seed between 0 and 9007199254740991),
    state             text not null
                      constraint studies_state
                      check (state in ('draft', 'running', 'waiting', 'paused', 'finished', 'stopped')),
    state_reason      text not null default '',
    -- What changes in place has a revision: the entity tag of the study.
    revision          integer not null default 1 constraint studies_revision check (revision >= 1),
    created_at        text not null,
    updated_at        text not null
) strict;

create index studies_by_creation on studies (created_at desc, id desc);

create table trials (
    id                text primary key not null,
    study_id          text not null references studies (id),
    number            integer not null constraint trials_number_positive check (number >= 1),
    action_index      integer not null constraint trials_action_index check (action_index >= 0),
    action            text not null constraint trials_action_json check (json_valid(action)),
    reason            text not null,
    -- The best action when this trial was proposed (null: nothing was visited yet).
    best_before       text references trials (id),
    warm_started_from text references trials (id),
    state             text not null
                      constraint trials_state
                      check (state in ('queued', 'running', 'converged', 'not_converged', 'failed', 'lost', 'cancelled')),
    -- How the solve ended; only a finished solve has one.
    status            text,
    gait_rmse_rad     real,
    cost_of_transport real,
    objective         real,
    max_violation     real,
    iterations        integer,
    seconds_total     real,
    report            text constraint trials_report_json check (report is null or json_valid(report)),
    violations        text constraint trials_violations_json check (violations is null or json_valid(violations)),
    message           text not null default '',
    created_at        text not null,
    started_at        text,
    finished_at       text,
    constraint trials_number_unique unique (study_id, number),
    constraint trials_converged_has_figures check (
        state <> 'converged' or (gait_rmse_rad is not null and cost_of_transport is not null and report is not null)
    ),
    constraint trials_end_has_time check (
        (state in ('queued', 'running')) = (finished_at is null)
    )
) strict;

create index trials_by_state on trials (study_id, state);

-- The trajectory of a finished trial, as the optimiser wrote it: zstd-compressed JSON.
create table gaits (
    trial_id        text primary key not null references trials (id),
    format_version  integer not null,
    speed_m_s       real,
    stride_length_m real,
    stride_time_s   real,
    gait            blob not null,
    warm_start      blob not null,
    iterations      blob not null,
    gait_sha256     text not null,
    created_at      text not null
) strict;

-- Everything the learner ever hears, in the order it was heard.
create table feedback (
    seq        integer primary key autoincrement,
    id         text not null constraint feedback_id_unique unique,
    study_id   text not null references studies (id),
    kind       text not null constraint feedback_kind check (kind in ('label', 'preference', 'tie', 'suggestion')),
    -- label: the trial; preference: the winner; tie: one of the two; suggestion: the trial it improves on.
    trial_a    text not null references trials (id),
    -- preference: the loser; tie: the other of the two.
    trial_b    text references trials (id),
    -- label: ordinal category, 0 = not converged.
    category   integer,
    -- suggestion: the action that would have been better, as a grid index.
    suggested  integer,
    source     text not null
               constraint feedback_source
               check (source in ('convergence', 'gait_rmse', 'subject', 'clinician', 'script')),
    author     text not null constraint feedback_author_length check (length(author) between 1 and 80),
    note       text not null default '' constraint feedback_note_length check (length(note) <= 2000),
    created_at text not null,
    constraint feedback_shape check (
        case kind
            when 'label' then trial_b is null and category is not null and suggested is null
            when 'suggestion' then trial_b is null and category is null and suggested is not null
            else trial_b is not null and category is null and suggested is null
        end
    ),
    constraint feedback_two_trials check (trial_b is null or trial_a <> trial_b)
) strict;

create index feedback_by_study on feedback (study_id, seq);
-- A trial gets one label, and Gait RMSE compares a pair once, however often a result is delivered.
create unique index feedback_one_label on feedback (trial_a) where kind = 'label';
create unique index feedback_one_rmse_pair on feedback (trial_a, trial_b) where source = 'gait_rmse';

-- A correction retracts; the retracted row stays.
create table retractions (
    feedback_seq integer primary key not null references feedback (seq),
    author       text not null constraint retractions_author_length check (length(author) between 1 and 80),
    reason       text not null constraint retractions_reason_length check (length(reason) between 1 and 2000),
    created_at   text not null
) strict;

create table jobs (
    id          text primary key not null,
    trial_id    text not null constraint jobs_trial_unique unique references trials (id),
    state       text not null constraint jobs_state check (state in ('queued', 'leased', 'done')),
    -- How often a worker started it: the number of the current attempt, and its fence.
    attempts    integer not null default 0 constraint jobs_attempts check (attempts >= 0),
    -- Of which ended by a panic or an error of the program.
    failures    integer not null default 0 constraint jobs_failures check (failures >= 0),
    -- Of which ended by a worker that was not heard of again.
    losses      integer not null default 0 constraint jobs_losses check (losses >= 0),
    worker      text,
    lease_until text,
    created_at  text not null,
    constraint jobs_lease_complete check (
        (state = 'leased') = (lease_until is not null) and (state = 'leased') = (worker is not null)
    )
) strict;

create index jobs_by_state on jobs (state, created_at);

-- What happened, for people who watch: replayed from any sequence number.
create table events (
    seq        integer primary key autoincrement,
    study_id   text not null references studies (id),
    kind       text not null,
    payload    text not null constraint events_payload_json check (json_valid(payload)),
    created_at text not null
) strict;

create index events_by_study on events (study_id, seq);

create trigger feedback_no_update before update on feedback
begin select raise(abort, 'feedback is append-only'); end;
create trigger feedback_no_delete before delete on feedback
begin select raise(abort, 'feedback is append-only'); end;
create trigger retractions_no_update before update on retractions
begin select raise(abort, 'retractions are append-only'); end;
create trigger retractions_no_delete before delete on retractions
begin select raise(abort, 'retractions are append-only'); end;
create trigger events_no_update before update on events
begin select raise(abort, 'events are append-only'); end;
create trigger events_no_delete before delete on events
begin select raise(abort, 'events are append-only'); end;
create trigger gaits_no_update before update on gaits
begin select raise(abort, 'gaits are append-only'); end;
create trigger trials_no_delete before delete on trials
begin select raise(abort, 'trials are never deleted'); end;

-- Both trials of a comparison, and the trial of a label, belong to the study of the row.
create trigger feedback_same_study before insert on feedback
when exists (select 1 from trials where id in (new.trial_a, new.trial_b) and study_id <> new.study_id)
begin select raise(abort, 'feedback names a trial of another study'); end;

-- What a trial was is fixed when it is proposed; what it gave is fixed when it ends.
create trigger trials_proposal_fixed
before update of study_id, number, action_index, action, reason, best_before, warm_started_from, created_at on trials
begin select raise(abort, 'the proposal of a trial is fixed'); end;
create trigger trials_result_fixed before update on trials
when old.state in ('converged', 'not_converged')
begin select raise(abort, 'the result of a trial is fixed'); end;
