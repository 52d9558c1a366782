-- The schema of a record.
--
-- Identifiers are UUIDs (version 7) as text. Times are RFC 3339 in UTC with milliseconds, so that they sort as text. Numbers
-- are in SI units. Constraints have names, because the program turns a violated one into a specific error. Triggers refuse
-- changes that this program never makes, whichever program tries them.

---------------------------------------------------------------- Subjects

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

-- Corrected height and body mass. The newest row applies to studies that are created later.
create table subject_corrections (
    seq          integer primary key autoincrement,
    subject_id   text not null references subjects (id),
    height_m     real not null constraint subject_corrections_height check (height_m between 1.0 and 2.5),
    body_mass_kg real not null constraint subject_corrections_mass check (body_mass_kg between 20 and 250),
    reason       text not null constraint subject_corrections_reason check (length(reason) between 1 and 2000),
    actor        text not null,
    created_at   text not null
) strict;

create index subject_corrections_by_subject on subject_corrections (subject_id, seq);

create trigger subject_corrections_no_update before update on subject_corrections
begin select raise(abort, 'corrections of subjects are append-only'); end;
create trigger subject_corrections_no_delete before delete on subject_corrections
begin select raise(abort, 'corrections of subjects are append-only'); end;

-- Measured muscle parameters, which override the published table. The newest row applies to studies that are created later.
create table subject_muscles (
    seq        integer primary key autoincrement,
    subject_id text not null references subjects (id),
    definition text not null constraint subject_muscles_definition_json check (json_valid(definition)),
    actor      text not null,
    created_at text not null
) strict;

create index subject_muscles_by_subject on subject_muscles (subject_id, seq);

create trigger subject_muscles_no_update before update on subject_muscles
begin select raise(abort, 'muscle parameters are append-only'); end;
create trigger subject_muscles_no_delete before delete on subject_muscles
begin select raise(abort, 'muscle parameters are append-only'); end;

-- Consent given and withdrawn. The newest row of a subject applies.
create table consents (
    seq        integer primary key autoincrement,
    subject_id text not null references subjects (id),
    kind       text not null constraint consents_kind check (kind in ('given', 'withdrawn')),
    -- given: the signed form and its version. withdrawn: the reason, if the subject states one.
    note       text not null constraint consents_note_length check (length(note) between 1 and 2000),
    actor      text not null,
    created_at text not null
) strict;

create index consents_by_subject on consents (subject_id, seq);

create trigger consents_no_update before update on consents
begin select raise(abort, 'consents are append-only'); end;
create trigger consents_no_delete before delete on consents
begin select raise(abort, 'consents are append-only'); end;

-- Tables with data of subjects have a trigger that refuses new rows of these subjects.
create view withdrawn_subjects as
select subject_id from consents c
where kind = 'withdrawn' and seq = (select max(seq) from consents d where d.subject_id = c.subject_id);

create trigger subject_corrections_need_consent before insert on subject_corrections
when new.subject_id in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
create trigger subject_muscles_need_consent before insert on subject_muscles
when new.subject_id in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

---------------------------------------------------------------- Devices and reference gaits

-- A changed device or reference gait is a new row, so that studies keep the one that they use.
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

---------------------------------------------------------------- Studies

create table studies (
    id                   text primary key not null,
    name                 text not null constraint studies_name_length check (length(name) between 1 and 120),
    subject_id           text not null references subjects (id),
    -- Height and body mass when the study was created. A later correction of the subject does not change them.
    height_m             real not null constraint studies_height check (height_m between 1.0 and 2.5),
    body_mass_kg         real not null constraint studies_mass check (body_mass_kg between 20 and 250),
    device_id            text not null references devices (id),
    reference_gait_id    text not null references reference_gaits (id),
    muscles              integer not null constraint studies_muscles_bool check (muscles in (0, 1)),
    gait_settings        text not null constraint studies_gait_settings_json check (json_valid(gait_settings)),
    solve_options        text not null constraint studies_solve_options_json check (json_valid(solve_options)),
    -- Values of the bounds that are not tuned.
    base_bounds          text not null constraint studies_base_bounds_json check (json_valid(base_bounds)),
    search_space         text not null constraint studies_search_space_json check (json_valid(search_space)),
    learner              text not null constraint studies_learner_json check (json_valid(learner)),
    answer_source        text not null
                         constraint studies_answer_source check (answer_source in ('gait_rmse', 'people', 'both')),
    -- What evaluates trials.
    evaluation           text not null default 'optimizer'
                         constraint studies_evaluation check (evaluation in ('optimizer', 'script')),
    number_of_trials     integer not null constraint studies_number_of_trials check (number_of_trials between 1 and 10000),
    -- Total solve time after which no new trial starts.
    solve_seconds_budget real
                         constraint studies_solve_seconds
                         check (solve_seconds_budget is null or solve_seconds_budget > 0),
    -- The study finishes when the best action has not changed over this many results.
    unchanged_limit      integer
                         constraint studies_unchanged
                         check (unchanged_limit is null or unchanged_limit between 1 and 10000),
    -- Whether a trial may have an action whose gait is known from another trial.
    repeat_results       integer not null constraint studies_repeat_results_bool check (repeat_results in (0, 1)),
    -- The gait from which trials are warm-started: the best one so far, or the first one of the study.
    warm_start_from      text not null
                         constraint studies_warm_start_from check (warm_start_from in ('incumbent', 'root')),
    -- What the study does with an atlas: nothing, make one, or take its gaits from one of the same problem.
    atlas                text not null constraint studies_atlas check (atlas in ('none', 'make', 'use')),
    -- What simulated walks with each gait do.
    simulated_walks      text not null constraint studies_simulated_walks_json check (json_valid(simulated_walks)),
    parallel_trials      integer not null constraint studies_parallel_trials check (parallel_trials between 1 and 64),
    priority             integer not null default 0 constraint studies_priority check (priority between -10 and 10),
    -- At most 53 bits, because JSON readers keep no more of an integer.
    seed                 integer not null constraint studies_seed check (seed between 0 and 9007199254740991),
    state                text not null
                         constraint studies_state
                         check (state in ('not_started', 'running', 'waiting', 'paused', 'finished', 'stopped')),
    state_reason         text not null default '',
    cloned_from          text references studies (id),
    -- Tags, notes and the time of archiving help people to find a study. They do not affect its trials.
    tags                 text constraint studies_tags check (tags is null or json_valid(tags) and length(tags) <= 1000),
    notes                text constraint studies_notes_length check (length(notes) between 1 and 4000),
    archived_at          text,
    -- Increases with each change. It is the entity tag of the study.
    revision             integer not null default 1 constraint studies_revision check (revision >= 1),
    created_at           text not null,
    updated_at           text not null
) strict;

create index studies_by_creation on studies (created_at desc, id desc);

create trigger studies_body_fixed before update of height_m, body_mass_kg on studies
begin select raise(abort, 'height and body mass of a study cannot be changed'); end;
create trigger studies_need_consent before insert on studies
when new.subject_id in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
create trigger studies_continue_with_consent before update of state on studies
when new.state in ('running', 'waiting') and new.subject_id in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

-- Users and tokens with access to a study. Raters have access to the studies of which they are members, administrators to
-- every study, other users and tokens to every study that is not restricted and to those of which they are members. Members
-- can be removed after a withdrawal of consent, so these tables have no trigger that needs consent.
create table study_members (
    id         text primary key not null,
    study_id   text not null references studies (id),
    user_id    text references users (id),
    token_id   text references tokens (id),
    actor      text not null constraint study_members_actor_length check (length(actor) between 1 and 120),
    created_at text not null,
    constraint study_members_user_or_token check ((user_id is null) <> (token_id is null))
) strict;

create index study_members_by_study on study_members (study_id);
create index study_members_by_user on study_members (user_id) where user_id is not null;
create index study_members_by_token on study_members (token_id) where token_id is not null;

-- A membership ends once. Who becomes a member again gets a new row.
create table study_member_ends (
    member_id  text primary key not null references study_members (id),
    actor      text not null constraint study_member_ends_actor_length check (length(actor) between 1 and 120),
    created_at text not null
) strict;

-- Whether a study is restricted to its members. The newest row applies; a study without one is not restricted.
create table study_restrictions (
    seq        integer primary key autoincrement,
    study_id   text not null references studies (id),
    restricted integer not null constraint study_restrictions_bool check (restricted in (0, 1)),
    actor      text not null constraint study_restrictions_actor_length check (length(actor) between 1 and 120),
    created_at text not null
) strict;

create index study_restrictions_by_study on study_restrictions (study_id, seq);

create view current_study_members as
select m.*, coalesce(m.user_id, m.token_id) as principal from study_members m
where not exists (select 1 from study_member_ends e where e.member_id = m.id);

create view restricted_studies as
select r.study_id from study_restrictions r
where r.restricted = 1
and not exists (select 1 from study_restrictions n where n.study_id = r.study_id and n.seq > r.seq);

create trigger study_members_once before insert on study_members
when exists (
    select 1 from current_study_members
    where study_id = new.study_id and principal = coalesce(new.user_id, new.token_id)
)
begin select raise(abort, 'already a member of this study'); end;
create trigger study_members_no_update before update on study_members
begin select raise(abort, 'study members are append-only'); end;
create trigger study_members_no_delete before delete on study_members
begin select raise(abort, 'study members are append-only'); end;
create trigger study_member_ends_no_update before update on study_member_ends
begin select raise(abort, 'ends of memberships are append-only'); end;
create trigger study_member_ends_no_delete before delete on study_member_ends
begin select raise(abort, 'ends of memberships are append-only'); end;
create trigger study_restrictions_no_update before update on study_restrictions
begin select raise(abort, 'study restrictions are append-only'); end;
create trigger study_restrictions_no_delete before delete on study_restrictions
begin select raise(abort, 'study restrictions are append-only'); end;

-- Imports of studies from archives.
create table imports (
    seq            integer primary key autoincrement,
    study_id       text not null references studies (id),
    -- SHA-256 of the archive.
    file_sha256    text not null constraint imports_file check (length(file_sha256) = 64),
    -- Public key of the signature in hexadecimal; null without a signature.
    signed_by      text constraint imports_signed_by check (signed_by is null or length(signed_by) = 64),
    -- Whether the importing user named this key as trusted.
    trusted        integer not null constraint imports_trusted check (trusted in (0, 1)),
    -- Number of trials whose Gait RMSE could not be recomputed, because the archive does not contain their gaits.
    unchecked_rmse integer not null constraint imports_unchecked check (unchecked_rmse >= 0),
    actor          text not null,
    created_at     text not null
) strict;

create index imports_by_study on imports (study_id, seq);

create trigger imports_no_update before update on imports
begin select raise(abort, 'imports are append-only'); end;
create trigger imports_no_delete before delete on imports
begin select raise(abort, 'imports are append-only'); end;

---------------------------------------------------------------- Trials

create table trials (
    id                text primary key not null,
    study_id          text not null references studies (id),
    number            integer not null constraint trials_number_positive check (number >= 1),
    action_index      integer not null constraint trials_action_index check (action_index >= 0),
    action            text not null constraint trials_action_json check (json_valid(action)),
    reason            text not null,
    -- The trial with the best action at the time of the proposal; null before the first result.
    best_before       text references trials (id),
    -- The trial whose gait is the warm start; null for a cold start.
    warm_started_from text references trials (id),
    -- The lab script that evaluates the trial; null if the service does.
    script            text constraint trials_script_length check (script is null or length(script) between 1 and 80),
    state             text not null
                      constraint trials_state
                      check (state in (
                          'queued', 'running', 'converged', 'not_converged', 'not_executable', 'failed', 'lost', 'cancelled'
                      )),
    -- How the solve ended; null unless it ran to its end.
    status            text,
    gait_rmse_rad     real,
    cost_of_transport real,
    -- Mean strides of the simulated walks on which the result depends; null if it does not depend on any.
    mean_strides      real constraint trials_mean_strides check (mean_strides is null or mean_strides >= 0),
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
    constraint trials_converged_has_values check (
        -- A script can report a converged trial without the values of a solve.
        state not in ('converged', 'not_executable') or script is not null
        or (gait_rmse_rad is not null and cost_of_transport is not null and report is not null)
    ),
    constraint trials_not_executable_has_strides check (
        state <> 'not_executable' or (script is null and mean_strides is not null)
    ),
    constraint trials_end_has_time check (
        (state in ('queued', 'running')) = (finished_at is null)
    )
) strict;

create index trials_by_state on trials (study_id, state);

create trigger trials_no_delete before delete on trials
begin select raise(abort, 'trials are never deleted'); end;
create trigger trials_proposal_fixed
before update of study_id, number, action_index, action, reason, best_before, warm_started_from, created_at on trials
begin select raise(abort, 'the proposal of a trial cannot be changed'); end;
create trigger trials_script_fixed before update of script on trials
when old.script is not null
begin select raise(abort, 'the script of a trial cannot be changed'); end;
create trigger trials_result_fixed before update on trials
when old.state in ('converged', 'not_converged', 'not_executable')
begin select raise(abort, 'the result of a trial cannot be changed'); end;
create trigger trials_need_consent before insert on trials
when (select subject_id from studies where id = new.study_id) in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
create trigger trials_continue_with_consent before update of state on trials
when new.state in ('queued', 'running')
    and (select subject_id from studies where id = new.study_id) in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

-- The jobs that solve trials, in the queue of workers. Other jobs are known by what they write and by the audit trail.
create table solve_jobs (
    id          text primary key not null,
    trial_id    text not null constraint solve_jobs_trial_unique unique references trials (id),
    state       text not null constraint solve_jobs_state check (state in ('queued', 'leased', 'done')),
    -- Number of attempts so far. A result with another number belongs to an attempt that has ended.
    attempts    integer not null default 0 constraint solve_jobs_attempts check (attempts >= 0),
    -- Number of attempts that ended with a panic or an error of the program.
    failures    integer not null default 0 constraint solve_jobs_failures check (failures >= 0),
    -- Number of attempts whose worker stopped responding.
    losses      integer not null default 0 constraint solve_jobs_losses check (losses >= 0),
    worker      text,
    lease_until text,
    created_at  text not null,
    constraint solve_jobs_lease_complete check (
        (state = 'leased') = (lease_until is not null) and (state = 'leased') = (worker is not null)
    )
) strict;

create index solve_jobs_by_state on solve_jobs (state, created_at);

-- Results of attempts, including those that arrived too late.
create table attempts (
    trial_id    text not null references trials (id),
    attempt     integer not null constraint attempts_attempt check (attempt >= 1),
    worker      text not null constraint attempts_worker_length check (length(worker) between 1 and 200),
    -- Whether it became the result of the trial. If not, another attempt was running or the trial had ended.
    used        integer not null constraint attempts_used check (used in (0, 1)),
    -- How the solve ended.
    status      text not null,
    -- The finite values of the solve.
    report      text constraint attempts_report_json check (report is null or json_valid(report)),
    received_at text not null,
    constraint attempts_once primary key (trial_id, attempt)
) strict, without rowid;

create trigger attempts_no_update before update on attempts
begin select raise(abort, 'attempts are append-only'); end;
create trigger attempts_no_delete before delete on attempts
begin select raise(abort, 'attempts are append-only'); end;

-- The gait, the warm start and the iterations of a completed solve, as JSON compressed with zstd. Gaits can be deleted, to
-- save space; their hashes stay in the seals.
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

create index gaits_by_sha256 on gaits (gait_sha256);
create trigger gaits_no_update before update on gaits
begin select raise(abort, 'gaits are never changed'); end;

-- The other local optima that a cold start reached, with a gait of each: candidates for the root gait of another study. Archives
-- do not have them. They are deleted with the gait of the trial.
create table other_local_optima (
    trial_id        text not null references trials (id),
    -- In the order in which the initial guesses reached them, from 1. The gait of the trial has the missing number.
    number          integer not null constraint other_local_optima_number check (number >= 1),
    objective       real not null,
    gait_rmse_rad   real not null,
    gait            blob not null,
    warm_start      blob not null,
    gait_sha256     text not null,
    primary key (trial_id, number)
) strict;

create trigger other_local_optima_no_update before update on other_local_optima
begin select raise(abort, 'gaits are never changed'); end;

-- The inputs of the solves of this service, so that a trial with the same input takes the result. Archives do not have them,
-- so the result of a trial never comes from an imported one.
create table solve_inputs (
    -- SHA-256 of the version of the program and of the input, in the format of `problem.json`.
    sha256   text primary key not null constraint solve_inputs_sha256 check (length(sha256) = 64),
    -- The trial with the result.
    trial_id text not null references trials (id)
) strict, without rowid;

-- Certificates of gaits: one for each version of the certificate.
create table certificates (
    trial_id       text not null references trials (id),
    format_version integer not null constraint certificates_format_version check (format_version >= 1),
    passed         integer not null constraint certificates_passed check (passed in (0, 1)),
    document       text not null constraint certificates_document check (json_valid(document)),
    created_at     text not null,
    primary key (trial_id, format_version)
) strict;

create trigger certificates_no_update before update on certificates
begin select raise(abort, 'certificates are append-only'); end;
create trigger certificates_no_delete before delete on certificates
begin select raise(abort, 'certificates are append-only'); end;

-- Requests for infeasibility explanations. Requested explanations are computed before the others, also after a restart.
create table explanation_requests (
    trial_id   text primary key not null references trials (id),
    actor      text not null,
    created_at text not null
) strict;

create trigger explanation_requests_no_update before update on explanation_requests
begin select raise(abort, 'requests for explanations are append-only'); end;
create trigger explanation_requests_no_delete before delete on explanation_requests
begin select raise(abort, 'requests for explanations are append-only'); end;
create trigger explanation_requests_need_consent before insert on explanation_requests
when (select s.subject_id from trials t join studies s on s.id = t.study_id where t.id = new.trial_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

-- Infeasibility explanations: at most one for each trial that was not stopped early. One that was stopped early keeps what the
-- search had found.
create table explanations (
    trial_id       text not null references trials (id),
    stopped_early  integer not null constraint explanations_stopped_early check (stopped_early in (0, 1)),
    -- Version of the program that computed it.
    program        text not null,
    -- SHA-256 of the explained problem, in the format of `problem.json`.
    problem_sha256 text not null constraint explanations_problem check (length(problem_sha256) = 64),
    -- The tuned bound whose relaxation is the smallest that gives a gait; null if no single bound does.
    relaxed_bound  text,
    document       text not null constraint explanations_document check (json_valid(document)),
    created_at     text not null,
    primary key (trial_id, created_at)
) strict;

create unique index explanations_complete on explanations (trial_id) where stopped_early = 0;
create trigger explanations_no_update before update on explanations
begin select raise(abort, 'explanations are append-only'); end;
create trigger explanations_no_delete before delete on explanations
begin select raise(abort, 'explanations are append-only'); end;
create trigger explanations_need_consent before insert on explanations
when (select s.subject_id from trials t join studies s on s.id = t.study_id where t.id = new.trial_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

---------------------------------------------------------------- Feedback

-- Everything that the learner learns from, in the order in which it learned it.
create table feedback (
    seq        integer primary key autoincrement,
    id         text not null constraint feedback_id_unique unique,
    study_id   text not null references studies (id),
    kind       text not null constraint feedback_kind check (kind in ('label', 'preference', 'no_difference', 'suggestion')),
    -- label: the trial. preference: the winner. no_difference: one of the two trials. suggestion: the trial that it improves.
    trial_a    text not null references trials (id),
    -- preference: the loser. no_difference: the other trial.
    trial_b    text references trials (id),
    -- label: whether the evaluation of the trial found a gait, and whether simulated walks with it last.
    label      text
               constraint feedback_label check (label in ('converged', 'not_converged', 'not_executable')),
    -- suggestion: the index of the suggested action in the search space.
    suggested  integer,
    source     text not null
               constraint feedback_source
               check (source in ('evaluation', 'gait_rmse', 'subject', 'clinician', 'script')),
    author     text not null constraint feedback_author_length check (length(author) between 1 and 80),
    note       text not null default '' constraint feedback_note_length check (length(note) <= 2000),
    -- The preference or assessment in whose place this answer was given. It refers to one of two tables.
    replaces   text,
    -- The preference that counts again, because the change to another answer was undone.
    restores   text references feedback (id),
    created_at text not null,
    constraint feedback_shape check (
        case kind
            when 'label' then trial_b is null and label is not null and suggested is null
            when 'suggestion' then trial_b is null and label is null and suggested is not null
            else trial_b is not null and label is null and suggested is null
        end
    ),
    constraint feedback_two_trials check (trial_b is null or trial_a <> trial_b),
    constraint feedback_change check (
        (replaces is null and restores is null)
        or ((replaces is null or restores is null) and kind in ('preference', 'no_difference')
            and source in ('subject', 'clinician', 'script'))
    )
) strict;

create index feedback_by_study on feedback (study_id, seq);
-- Each answer looks up earlier answers about its two trials, and earlier suggestions about its two actions, in studies with
-- tens of thousands of answers.
create index feedback_by_pair on feedback (trial_a, trial_b, author, source);
create index feedback_suggestions on feedback (study_id, suggested) where kind = 'suggestion';
-- A trial has one label and Gait RMSE compares a pair once, however often a result is delivered.
create unique index feedback_one_label on feedback (trial_a) where kind = 'label';
create unique index feedback_one_rmse_pair on feedback (trial_a, trial_b) where source = 'gait_rmse';
-- An answer is changed once, and brought back once: afterwards another row is in force.
create unique index feedback_one_replacement on feedback (replaces) where replaces is not null;
create unique index feedback_one_restoration on feedback (restores) where restores is not null;

create trigger feedback_no_update before update on feedback
begin select raise(abort, 'feedback is append-only'); end;
create trigger feedback_no_delete before delete on feedback
begin select raise(abort, 'feedback is append-only'); end;
create trigger feedback_same_study before insert on feedback
when exists (select 1 from trials where id in (new.trial_a, new.trial_b) and study_id <> new.study_id)
begin select raise(abort, 'feedback refers to a trial of another study'); end;
create trigger feedback_needs_consent before insert on feedback
when (select subject_id from studies where id = new.study_id) in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

-- A retracted answer stays in the record.
create table feedback_retractions (
    feedback_seq integer primary key not null references feedback (seq),
    author       text not null constraint feedback_retractions_author_length check (length(author) between 1 and 80),
    reason       text not null constraint feedback_retractions_reason_length check (length(reason) between 1 and 2000),
    created_at   text not null
) strict;

create trigger feedback_retractions_no_update before update on feedback_retractions
begin select raise(abort, 'retractions are append-only'); end;
create trigger feedback_retractions_no_delete before delete on feedback_retractions
begin select raise(abort, 'retractions are append-only'); end;

-- Answers about two gaits that state no preference. Those of raters are in blind_pair_answers, those of subjects in
-- lab sessions in lab_answers.
create table assessments (
    id          text primary key not null,
    study_id    text not null references studies (id),
    trial_a     text not null references trials (id),
    trial_b     text not null references trials (id),
    answer      text not null
                constraint assessments_answer check (answer in ('cannot_tell', 'unsafe_a', 'unsafe_b', 'unsafe_both')),
    source      text not null constraint assessments_source check (source in ('subject', 'clinician', 'script')),
    author      text not null constraint assessments_author_length check (length(author) between 1 and 80),
    note        text not null default '' constraint assessments_note_length check (length(note) <= 2000),
    -- The preference that the learner received; null if none.
    feedback_id text references feedback (id),
    -- As in feedback.
    replaces    text,
    restores    text references assessments (id),
    created_at  text not null,
    constraint assessments_two_gaits check (trial_a <> trial_b),
    -- Only answers that state nothing about safety are brought back: a safety report is never retracted.
    constraint assessments_change check (
        restores is null or (replaces is null and answer = 'cannot_tell' and feedback_id is null)
    )
) strict;

create index assessments_by_study on assessments (study_id);
create unique index assessments_one_replacement on assessments (replaces) where replaces is not null;
create unique index assessments_one_restoration on assessments (restores) where restores is not null;

create trigger assessments_no_update before update on assessments
begin select raise(abort, 'assessments are append-only'); end;
create trigger assessments_no_delete before delete on assessments
begin select raise(abort, 'assessments are append-only'); end;
create trigger assessments_same_study before insert on assessments
when exists (select 1 from trials where id in (new.trial_a, new.trial_b) and study_id <> new.study_id)
begin select raise(abort, 'an assessment refers to a trial of another study'); end;
create trigger assessments_need_consent before insert on assessments
when (select subject_id from studies where id = new.study_id) in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

create table assessment_retractions (
    assessment_id text primary key not null references assessments (id),
    author        text not null constraint assessment_retractions_author_length check (length(author) between 1 and 80),
    reason        text not null constraint assessment_retractions_reason_length check (length(reason) between 1 and 2000),
    created_at    text not null
) strict;

create trigger assessment_retractions_no_update before update on assessment_retractions
begin select raise(abort, 'retractions are append-only'); end;
create trigger assessment_retractions_no_delete before delete on assessment_retractions
begin select raise(abort, 'retractions are append-only'); end;

---------------------------------------------------------------- Safety

-- Reports that one gait is unsafe. Reports about one of two gaits are answers in assessments, blind_pair_answers and
-- lab_answers.
create table safety_reports (
    id         text primary key not null,
    trial_id   text not null references trials (id),
    source     text not null constraint safety_reports_source check (source in ('subject', 'clinician', 'script')),
    author     text not null constraint safety_reports_author_length check (length(author) between 1 and 80),
    note       text not null default '' constraint safety_reports_note_length check (length(note) <= 2000),
    created_at text not null
) strict;

create index safety_reports_by_trial on safety_reports (trial_id);

create trigger safety_reports_no_update before update on safety_reports
begin select raise(abort, 'safety reports are append-only'); end;
create trigger safety_reports_no_delete before delete on safety_reports
begin select raise(abort, 'safety reports are append-only'); end;
create trigger safety_reports_need_consent before insert on safety_reports
when (select s.subject_id from trials t join studies s on s.id = t.study_id where t.id = new.trial_id)
     in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

-- Decisions of staff about safety reports.
create table safety_reviews (
    id         text primary key not null,
    trial_id   text not null references trials (id),
    decision   text not null constraint safety_reviews_decision check (decision in ('cleared', 'unsafe')),
    author     text not null constraint safety_reviews_author_length check (length(author) between 1 and 80),
    reason     text not null constraint safety_reviews_reason_length check (length(reason) between 1 and 2000),
    created_at text not null
) strict;

create index safety_reviews_by_trial on safety_reviews (trial_id);

create trigger safety_reviews_no_update before update on safety_reviews
begin select raise(abort, 'safety reviews are append-only'); end;
create trigger safety_reviews_no_delete before delete on safety_reviews
begin select raise(abort, 'safety reviews are append-only'); end;
create trigger safety_reviews_need_consent before insert on safety_reviews
when (select s.subject_id from trials t join studies s on s.id = t.study_id where t.id = new.trial_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

-- The reports that a review decides about, by the identifier of the blind pair, the assessment, the lab session or the row of
-- safety_reports. Times do not tell which reports a reviewer has seen: an imported report can come from a clock that was
-- ahead.
create table safety_review_reports (
    review_id text not null references safety_reviews (id),
    report_id text not null,
    primary key (review_id, report_id)
) strict, without rowid;

create trigger safety_review_reports_no_update before update on safety_review_reports
begin select raise(abort, 'safety reviews are append-only'); end;
create trigger safety_review_reports_no_delete before delete on safety_review_reports
begin select raise(abort, 'safety reviews are append-only'); end;

---------------------------------------------------------------- Blind pairs

-- Pairs of gaits shown to raters. A rater knows a pair by its code only. Gait A is the newer one, so trial_a and trial_b do
-- not tell which gait is shown first: that is an allocation (blind_pair_allocations).
create table blind_pairs (
    id         text primary key not null,
    code       text not null
               constraint blind_pairs_code_unique unique
               constraint blind_pairs_code_length check (length(code) = 64),
    study_id   text not null references studies (id),
    rater      text not null constraint blind_pairs_rater_length check (length(rater) between 1 and 80),
    -- Number for this rater in this study.
    number     integer not null constraint blind_pairs_number check (number >= 1),
    -- new: the pending comparison. repeat: an earlier pair again, to measure agreement.
    kind       text not null constraint blind_pairs_kind check (kind in ('new', 'repeat')),
    trial_a    text not null references trials (id),
    trial_b    text not null references trials (id),
    repeats    text references blind_pairs (id),
    -- Whether the rater had been unblinded in this study before the pair was drawn.
    unblinded  integer not null constraint blind_pairs_unblinded check (unblinded in (0, 1)),
    created_at text not null,
    constraint blind_pairs_number_unique unique (study_id, rater, number),
    constraint blind_pairs_two_gaits check (trial_a <> trial_b),
    constraint blind_pairs_repeats check ((kind = 'repeat') = (repeats is not null))
) strict;

create trigger blind_pairs_no_update before update on blind_pairs
begin select raise(abort, 'blind pairs are append-only'); end;
create trigger blind_pairs_no_delete before delete on blind_pairs
begin select raise(abort, 'blind pairs are append-only'); end;
create trigger blind_pairs_need_consent before insert on blind_pairs
when (select subject_id from studies where id = new.study_id) in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

-- Answers of raters. They refer to gait A and gait B, not to what was shown first.
create table blind_pair_answers (
    pair_id          text primary key not null references blind_pairs (id),
    answer           text not null
                     constraint blind_pair_answers_answer
                     check (answer in ('a', 'b', 'no_difference', 'cannot_tell', 'unsafe_a', 'unsafe_b', 'unsafe_both',
                                       'retracted')),
    -- Response time by the rater's clock, in milliseconds.
    response_ms      integer constraint blind_pair_answers_response check (response_ms is null or response_ms >= 0),
    note             text not null default '' constraint blind_pair_answers_note check (length(note) <= 2000),
    -- The preference that the learner received; null if none.
    feedback_id      text references feedback (id),
    -- Whether the author could have known the allocation at the time of the answer.
    could_have_known integer not null
                     constraint blind_pair_answers_could_have_known check (could_have_known in (0, 1)),
    created_at       text not null
) strict;

create index blind_pair_answers_by_feedback on blind_pair_answers (feedback_id) where feedback_id is not null;

create trigger blind_pair_answers_no_update before update on blind_pair_answers
begin select raise(abort, 'answers of raters are append-only'); end;
create trigger blind_pair_answers_no_delete before delete on blind_pair_answers
begin select raise(abort, 'answers of raters are append-only'); end;
create trigger blind_pair_answers_need_consent before insert on blind_pair_answers
when (select s.subject_id from blind_pairs p join studies s on s.id = p.study_id where p.id = new.pair_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

-- Retractions by raters. The preference of the answer is retracted in the same transaction.
create table blind_pair_retractions (
    pair_id    text primary key not null references blind_pair_answers (pair_id),
    created_at text not null
) strict;

create trigger blind_pair_retractions_no_update before update on blind_pair_retractions
begin select raise(abort, 'retractions are append-only'); end;
create trigger blind_pair_retractions_no_delete before delete on blind_pair_retractions
begin select raise(abort, 'retractions are append-only'); end;

-- Which gait of a pair is shown first, drawn by the operating system. Only store/src/allocations reads this table.
create table blind_pair_allocations (
    pair_id    text primary key not null references blind_pairs (id),
    -- Whether gait B is shown first.
    swapped    integer not null constraint blind_pair_allocations_swapped check (swapped in (0, 1)),
    -- Random, so that the hash in the seal of the row does not reveal the allocation.
    nonce      text not null constraint blind_pair_allocations_nonce check (length(nonce) = 64),
    created_at text not null
) strict;

create trigger blind_pair_allocations_no_update before update on blind_pair_allocations
begin select raise(abort, 'allocations are append-only'); end;
create trigger blind_pair_allocations_no_delete before delete on blind_pair_allocations
begin select raise(abort, 'allocations are append-only'); end;

-- Raters who were unblinded in a study.
create table rater_unblindings (
    seq        integer primary key autoincrement,
    study_id   text not null references studies (id),
    rater      text not null,
    actor      text not null,
    reason     text not null constraint rater_unblindings_reason_length check (length(reason) between 1 and 2000),
    created_at text not null
) strict;

create trigger rater_unblindings_no_update before update on rater_unblindings
begin select raise(abort, 'unblindings are append-only'); end;
create trigger rater_unblindings_no_delete before delete on rater_unblindings
begin select raise(abort, 'unblindings are append-only'); end;

---------------------------------------------------------------- Lab sessions

-- A subject walks without the device (walk 1) and with two gaits (walks 2 and 3), in the order of lab_allocations.
create table lab_sessions (
    id         text primary key not null,
    study_id   text not null references studies (id),
    -- Number in the study.
    number     integer not null constraint lab_sessions_number check (number >= 1),
    trial_a    text not null references trials (id),
    trial_b    text not null references trials (id),
    notes      text not null default '' constraint lab_sessions_notes check (length(notes) <= 2000),
    actor      text not null,
    created_at text not null,
    constraint lab_sessions_number_unique unique (study_id, number),
    constraint lab_sessions_two_gaits check (trial_a <> trial_b)
) strict;

create trigger lab_sessions_no_update before update on lab_sessions
begin select raise(abort, 'lab sessions are append-only'); end;
create trigger lab_sessions_no_delete before delete on lab_sessions
begin select raise(abort, 'lab sessions are append-only'); end;
create trigger lab_sessions_same_study before insert on lab_sessions
when exists (select 1 from trials where id in (new.trial_a, new.trial_b) and study_id <> new.study_id)
begin select raise(abort, 'a lab session refers to a trial of another study'); end;
create trigger lab_sessions_need_consent before insert on lab_sessions
when (select subject_id from studies where id = new.study_id) in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

-- Which gait walk 2 uses, drawn by the operating system. Only store/src/allocations reads this table.
create table lab_allocations (
    lab_session_id text primary key not null references lab_sessions (id),
    -- Whether walk 2 uses gait A.
    gait_a_first   integer not null constraint lab_allocations_order check (gait_a_first in (0, 1)),
    -- Random, so that the hash in the seal of the row does not reveal the allocation.
    nonce          text not null constraint lab_allocations_nonce check (length(nonce) = 64),
    created_at     text not null
) strict;

create trigger lab_allocations_no_update before update on lab_allocations
begin select raise(abort, 'allocations are append-only'); end;
create trigger lab_allocations_no_delete before delete on lab_allocations
begin select raise(abort, 'allocations are append-only'); end;

-- Completed steps of a session. Each step happens at most once.
create table lab_session_steps (
    lab_session_id text not null references lab_sessions (id),
    step           text not null
                   constraint lab_session_steps_step
                   check (step in ('walk_1', 'walk_2', 'walk_3', 'unblinded', 'closed')),
    note           text not null default '' constraint lab_session_steps_note check (length(note) <= 2000),
    actor          text not null,
    created_at     text not null,
    primary key (lab_session_id, step)
) strict;

create trigger lab_session_steps_no_update before update on lab_session_steps
begin select raise(abort, 'steps of lab sessions are append-only'); end;
create trigger lab_session_steps_no_delete before delete on lab_session_steps
begin select raise(abort, 'steps of lab sessions are append-only'); end;
create trigger lab_session_steps_need_consent before insert on lab_session_steps
when (select s.subject_id from lab_sessions l join studies s on s.id = l.study_id where l.id = new.lab_session_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

-- Downloads of the controller files of walks. A controller file reveals the gait of its walk to a person who reads it.
create table controller_file_downloads (
    id             text primary key not null,
    lab_session_id text not null references lab_sessions (id),
    walk           integer not null constraint controller_file_downloads_walk check (walk in (2, 3)),
    -- Whether the device itself fetched the file, with a token that has no other right.
    to_device      integer not null constraint controller_file_downloads_to_device check (to_device in (0, 1)),
    actor          text not null,
    created_at     text not null
) strict;

create index controller_file_downloads_by_session on controller_file_downloads (lab_session_id);

create trigger controller_file_downloads_no_update before update on controller_file_downloads
begin select raise(abort, 'downloads of controller files are append-only'); end;
create trigger controller_file_downloads_no_delete before delete on controller_file_downloads
begin select raise(abort, 'downloads of controller files are append-only'); end;
create trigger controller_file_downloads_need_consent before insert on controller_file_downloads
when (select s.subject_id from lab_sessions l join studies s on s.id = l.study_id where l.id = new.lab_session_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

-- Answers of the subject about the two walks with the device: first is walk 2. The learner receives a preference only when the
-- session is unblinded, because feedback is visible and would reveal the allocation.
create table lab_answers (
    lab_session_id text not null references lab_sessions (id),
    -- From 1; an answer after a retraction has the next number.
    number         integer not null constraint lab_answers_number check (number >= 1),
    answer         text not null
                   constraint lab_answers_answer
                   check (answer in ('first', 'second', 'no_difference', 'cannot_tell', 'unsafe_first', 'unsafe_second',
                                     'unsafe_both')),
    note           text not null default '' constraint lab_answers_note check (length(note) <= 2000),
    actor          text not null,
    created_at     text not null,
    primary key (lab_session_id, number)
) strict;

create trigger lab_answers_no_update before update on lab_answers
begin select raise(abort, 'answers in lab sessions are append-only'); end;
create trigger lab_answers_no_delete before delete on lab_answers
begin select raise(abort, 'answers in lab sessions are append-only'); end;
create trigger lab_answers_need_consent before insert on lab_answers
when (select s.subject_id from lab_sessions l join studies s on s.id = l.study_id where l.id = new.lab_session_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

create table lab_answer_retractions (
    lab_session_id text not null,
    number         integer not null,
    actor          text not null,
    created_at     text not null,
    primary key (lab_session_id, number),
    foreign key (lab_session_id, number) references lab_answers (lab_session_id, number)
) strict;

create trigger lab_answer_retractions_no_update before update on lab_answer_retractions
begin select raise(abort, 'retractions are append-only'); end;
create trigger lab_answer_retractions_no_delete before delete on lab_answer_retractions
begin select raise(abort, 'retractions are append-only'); end;

-- Measurement files of walks. The newest file of a walk and kind is used. All of them are kept, so that they can be processed
-- again with other settings.
create table measurement_files (
    id             text primary key not null,
    lab_session_id text not null references lab_sessions (id),
    walk           integer not null constraint measurement_files_walk check (walk in (1, 2, 3)),
    kind           text not null constraint measurement_files_kind check (kind in ('emg', 'joint_angles')),
    -- How to read the file, as JSON.
    reading        text not null constraint measurement_files_reading check (json_valid(reading)),
    -- The file, compressed with zstd.
    raw            blob not null,
    raw_sha256     text not null,
    actor          text not null,
    created_at     text not null
) strict;

create index measurement_files_by_session on measurement_files (lab_session_id, kind, walk);

create trigger measurement_files_no_update before update on measurement_files
begin select raise(abort, 'measurement files are append-only'); end;
create trigger measurement_files_no_delete before delete on measurement_files
begin select raise(abort, 'measurement files are append-only'); end;
create trigger measurement_files_need_consent before insert on measurement_files
when (select s.subject_id from lab_sessions l join studies s on s.id = l.study_id where l.id = new.lab_session_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

-- Results of EMG processing: settings and curves as JSON.
create table emg_results (
    id             text primary key not null,
    lab_session_id text not null references lab_sessions (id),
    document       text not null constraint emg_results_document check (json_valid(document)),
    actor          text not null,
    created_at     text not null
) strict;

create index emg_results_by_session on emg_results (lab_session_id);

create trigger emg_results_no_update before update on emg_results
begin select raise(abort, 'EMG results are append-only'); end;
create trigger emg_results_no_delete before delete on emg_results
begin select raise(abort, 'EMG results are append-only'); end;
create trigger emg_results_need_consent before insert on emg_results
when (select s.subject_id from lab_sessions l join studies s on s.id = l.study_id where l.id = new.lab_session_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

---------------------------------------------------------------- Users, tokens and sign-in

-- The record contains no secrets: passwords are hashed with argon2id, and random secrets with SHA-256. Users are disabled, not
-- deleted, because the audit trail refers to them.
create table users (
    id          text primary key not null,
    name        text not null collate nocase
                constraint users_name_unique unique
                constraint users_name_length check (length(name) between 1 and 80),
    role        text not null constraint users_role check (role in ('administrator', 'clinician', 'rater')),
    -- A PHC string; null if the user signs in with one-time links only.
    password    text,
    disabled_at text,
    created_at  text not null
) strict;

create trigger users_no_delete before delete on users
begin select raise(abort, 'users are disabled, never deleted'); end;

create table tokens (
    id         text primary key not null,
    name       text not null
               constraint tokens_name_unique unique
               constraint tokens_name_length check (length(name) between 1 and 80),
    hash       text not null
               constraint tokens_hash_unique unique
               constraint tokens_hash_length check (length(hash) = 64),
    scopes     text not null constraint tokens_scopes_json check (json_valid(scopes)),
    -- The actor who created the token, as in the audit trail.
    created_by text not null,
    -- The user among these actors; null if the program created the token.
    creator_id text references users (id),
    created_at text not null,
    expires_at text,
    revoked_at text
) strict;

create trigger tokens_no_delete before delete on tokens
begin select raise(abort, 'tokens are revoked, never deleted'); end;

create table sign_in_links (
    hash       text primary key not null constraint sign_in_links_hash_length check (length(hash) = 64),
    user_id    text not null references users (id),
    created_at text not null,
    expires_at text not null,
    used_at    text
) strict;

create table sessions (
    -- Of the secret in the browser.
    hash         text primary key not null constraint sessions_hash_length check (length(hash) = 64),
    -- The name of the session in lists.
    id           text not null constraint sessions_id_unique unique,
    user_id      text not null references users (id),
    -- Whether it began with a one-time link. If so, the user can set a password without the present one.
    by_link      integer not null default 0 constraint sessions_by_link check (by_link in (0, 1)),
    -- Network address, and how the browser identifies itself.
    address      text,
    browser      text,
    -- Hash of a cookie that outlives the session. Failed sign-ins by others in the same network do not delay this browser.
    browser_hash text,
    created_at   text not null,
    -- Time of the last request. Idle sessions end.
    seen_at      text not null,
    ended_at     text
) strict;

create index sessions_by_user on sessions (user_id);
create index sessions_by_browser on sessions (browser_hash) where browser_hash is not null;

-- Failed sign-ins by name and source. The source is a network, or a browser in which this user has signed in before.
create table sign_in_failures (
    name        text not null,
    source      text not null,
    -- Number of wrong passwords, including those whose sender disconnected before the comparison ended.
    failures    integer not null,
    last_at     text not null,
    -- Until this time the service checks no password of this name from this source.
    waits_until text not null,
    primary key (name, source)
) strict, without rowid;

create index sign_in_failures_by_age on sign_in_failures (last_at);

-- Failed sign-ins by network, whatever the name.
create table sign_in_sources (
    network  text primary key not null,
    -- Includes those that were refused without a check of the password.
    attempts integer not null,
    -- Number of different names.
    names    integer not null,
    first_at text not null,
    last_at  text not null
) strict, without rowid;

create index sign_in_sources_by_age on sign_in_sources (last_at);

-- The latest time at which access was decided. What has expired by then stays expired if the machine's clock is set back.
create table clock (
    id     integer primary key not null constraint clock_one_row check (id = 1),
    latest text not null
) strict;

---------------------------------------------------------------- Events and requests

-- Progress of studies for clients, which can replay it from any sequence number.
create table events (
    seq        integer primary key autoincrement,
    study_id   text not null references studies (id),
    kind       text not null,
    payload    text not null constraint events_payload_json check (json_valid(payload)),
    created_at text not null
) strict;

create index events_by_study on events (study_id, seq);

create trigger events_no_update before update on events
begin select raise(abort, 'events are append-only'); end;
create trigger events_no_delete before delete on events
begin select raise(abort, 'events are append-only'); end;

-- Responses to requests that clients may repeat.
create table idempotency_keys (
    actor      text not null,
    key        text not null constraint idempotency_key_length check (length(key) between 1 and 200),
    -- SHA-256 of method, path and body, because a client may use a key for one request only.
    request    text not null,
    status     integer not null,
    location   text,
    body       text not null,
    created_at text not null,
    constraint idempotency_keys_unique primary key (actor, key)
) strict, without rowid;

---------------------------------------------------------------- Audit trail and access log

-- One row for each change by a user or a program, written in the transaction of the change.
create table audit (
    seq        integer primary key autoincrement,
    created_at text not null,
    actor      text not null constraint audit_actor_length check (length(actor) between 1 and 120),
    change     text not null constraint audit_change_length check (length(change) between 1 and 60),
    -- Kind and identifier of the changed object: `study 0190...`.
    object     text not null,
    detail     text not null constraint audit_detail_json check (json_valid(detail)),
    -- The hash of the previous row, and the SHA-256 of this row together with it.
    previous   text not null constraint audit_previous_length check (length(previous) = 64),
    hash       text not null constraint audit_hash_unique unique constraint audit_hash_length check (length(hash) = 64)
) strict;

-- Raters who were allowed to read earlier are not blind, so each of their answers looks up their former roles.
create index audit_role_changes on audit (object) where change = 'user.role';

create trigger audit_no_update before update on audit
begin select raise(abort, 'the audit trail is append-only'); end;
create trigger audit_no_delete before delete on audit
begin select raise(abort, 'the audit trail is append-only'); end;

-- Views and exports of subjects' data, and refusals. Requests that are repeated within a short time share a row.
create table access_log (
    seq        integer primary key autoincrement,
    created_at text not null,
    last_at    text not null,
    times      integer not null constraint access_log_times check (times >= 1),
    kind       text not null constraint access_log_kind check (kind in ('view', 'export', 'refused')),
    actor      text not null,
    address    text not null,
    method     text not null,
    route      text not null,
    object     text not null,
    status     integer not null,
    study_id   text references studies (id),
    subject_id text references subjects (id)
) strict;

create index access_log_by_subject on access_log (subject_id, seq);

-- Deletions of old rows of the access log. Rows can be deleted only after the row here that covers them was written.
create table access_prunings (
    seq             integer primary key autoincrement,
    up_to           integer not null,
    older_than_days integer not null constraint access_prunings_days check (older_than_days >= 1),
    actor           text not null,
    created_at      text not null
) strict;

create trigger access_log_no_update before update on access_log
begin select raise(abort, 'the access log is append-only'); end;
create trigger access_log_no_delete before delete on access_log
when old.seq > coalesce((select max(up_to) from access_prunings), 0)
begin select raise(abort, 'the access log is append-only'); end;
create trigger access_prunings_no_update before update on access_prunings
begin select raise(abort, 'prunings of the access log are append-only'); end;
create trigger access_prunings_no_delete before delete on access_prunings
begin select raise(abort, 'prunings of the access log are append-only'); end;

---------------------------------------------------------------- Seals

-- Hashes of rows, chained. The program seals each row in the transaction that writes it, so a row that another program
-- changed, added or deleted does not match its newest seal. store/src/seals/tables.rs lists the sealed tables.
create table seals (
    seq        integer primary key autoincrement,
    -- The table of the row, and its primary key.
    table_name text not null,
    key        text not null,
    -- SHA-256 of the row; empty if the row was deleted.
    sha256     text not null constraint seals_sha256_length check (length(sha256) in (0, 64)),
    -- The hash of the previous seal, and the SHA-256 of this seal together with it.
    previous   text not null constraint seals_previous_length check (length(previous) = 64),
    hash       text not null constraint seals_hash_length check (length(hash) = 64)
) strict;

create index seals_by_row on seals (table_name, key, seq);

create trigger seals_no_update before update on seals
begin select raise(abort, 'seals are append-only'); end;
create trigger seals_no_delete before delete on seals
begin select raise(abort, 'seals are append-only'); end;

-- Hashes of rows of tables whose rows change often or are deleted: only the newest hash of each row is kept.
create table checksums (
    -- The table of the row, and its primary key.
    table_name text not null,
    key        text not null,
    sha256     text not null constraint checksums_sha256_length check (length(sha256) = 64),
    primary key (table_name, key)
) strict, without rowid;
