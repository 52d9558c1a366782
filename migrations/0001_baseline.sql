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
    updated_at        text not null,
    -- Who evaluates the trials.
    evaluation        text not null default 'optimizer'
                      constraint studies_evaluation check (evaluation in ('optimizer', 'script')),
    -- No new trial once the solves so far took so many seconds together.
    solve_seconds_budget real
                      constraint studies_solve_seconds
                      check (solve_seconds_budget is null or solve_seconds_budget > 0),
    -- Done when the best action stayed the same over so many results in a row.
    unchanged_limit   integer
                      constraint studies_unchanged
                      check (unchanged_limit is null or unchanged_limit between 1 and 10000),
    forked_from       text references studies (id)
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
    -- Who asked for the trial; null: the program evaluates it.
    asked_by          text
                      constraint trials_asked_by_length check (asked_by is null or length(asked_by) between 1 and 80),
    constraint trials_number_unique unique (study_id, number),
    constraint trials_converged_has_figures check (
        -- A script may say that a trial converged without having figures of a solve.
        state <> 'converged' or asked_by is not null or (gait_rmse_rad is not null and cost_of_transport is not null and report is not null)
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
create trigger trials_asked_by_fixed before update of asked_by on trials
when old.asked_by is not null
begin select raise(abort, 'who asked for a trial is fixed'); end;

-- Who did what, when and why: one row per change, in the transaction of the change, chained by hashes.
-- And the answers to requests that may be repeated.

create table audit (
    seq        integer primary key autoincrement,
    at         text not null,
    actor      text not null constraint audit_actor_length check (length(actor) between 1 and 120),
    action     text not null constraint audit_action_length check (length(action) between 1 and 60),
    -- What was changed: `study 0190...`.
    object     text not null,
    detail     text not null constraint audit_detail_json check (json_valid(detail)),
    -- SHA-256 of the row before, and of this row with it.
    previous   text not null constraint audit_previous_length check (length(previous) = 64),
    hash       text not null constraint audit_hash_unique unique constraint audit_hash_length check (length(hash) = 64)
) strict;

create trigger audit_no_update before update on audit
begin select raise(abort, 'the audit trail is append-only'); end;
create trigger audit_no_delete before delete on audit
begin select raise(abort, 'the audit trail is append-only'); end;

create table idempotency_keys (
    actor      text not null,
    key        text not null constraint idempotency_key_length check (length(key) between 1 and 200),
    -- SHA-256 of method, path and body: the same key with another request is a mistake.
    request    text not null,
    status     integer not null,
    location   text,
    body       text not null,
    created_at text not null,
    constraint idempotency_keys_unique primary key (actor, key)
) strict, without rowid;

-- Who may do what: people with roles, one-time sign-in links, sessions, tokens of scripts.
--
-- No secret is stored: passwords as argon2id, everything random as SHA-256. Nobody is deleted, only disabled: the
-- audit trail keeps speaking of people who exist.

create table users (
    id          text primary key not null,
    name        text not null collate nocase
                constraint users_name_unique unique
                constraint users_name_length check (length(name) between 1 and 80),
    role        text not null constraint users_role check (role in ('admin', 'clinician', 'rater')),
    -- argon2id, in PHC form; null: this person signs in with one-time links alone.
    password    text,
    disabled_at text,
    created_at  text not null
) strict;

create table sign_in_links (
    hash       text primary key not null constraint sign_in_links_hash_length check (length(hash) = 64),
    user_id    text not null references users (id),
    created_at text not null,
    expires_at text not null,
    used_at    text
) strict;

create table sessions (
    hash       text primary key not null constraint sessions_hash_length check (length(hash) = 64),
    user_id    text not null references users (id),
    created_at text not null,
    -- When the person last did something; idle sessions end.
    seen_at    text not null,
    ended_at   text,
    -- Whether it was begun by a one-time link: a password may then be set without the present one.
    by_link    integer not null default 0 constraint sessions_by_link check (by_link in (0, 1))
) strict;

create index sessions_by_user on sessions (user_id);

create table tokens (
    id         text primary key not null,
    name       text not null
               constraint tokens_name_unique unique
               constraint tokens_name_length check (length(name) between 1 and 80),
    hash       text not null
               constraint tokens_hash_unique unique
               constraint tokens_hash_length check (length(hash) = 64),
    scopes     text not null constraint tokens_scopes_json check (json_valid(scopes)),
    created_by text not null,
    created_at text not null,
    expires_at text,
    revoked_at text
) strict;

create trigger users_no_delete before delete on users
begin select raise(abort, 'users are disabled, never deleted'); end;
create trigger tokens_no_delete before delete on tokens
begin select raise(abort, 'tokens are revoked, never deleted'); end;

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

-- Consent of subjects: what they signed, and that they withdrew. The newest row counts; none is ever changed.

create table consents (
    seq        integer primary key autoincrement,
    subject_id text not null references subjects (id),
    kind       text not null constraint consents_kind check (kind in ('given', 'withdrawn')),
    -- given: which version of which form was signed. withdrawn: why, as far as the subject says.
    note       text not null constraint consents_note_length check (length(note) between 1 and 2000),
    actor      text not null,
    created_at text not null
) strict;

create index consents_by_subject on consents (subject_id, seq);

create view withdrawn_subjects as
select subject_id from consents c
where kind = 'withdrawn' and seq = (select max(seq) from consents d where d.subject_id = c.subject_id);

create trigger consents_no_update before update on consents
begin select raise(abort, 'consents are append-only'); end;
create trigger consents_no_delete before delete on consents
begin select raise(abort, 'consents are append-only'); end;

-- Nothing new of a subject who withdrew, whichever way it comes in.
create trigger studies_need_consent before insert on studies
when new.subject_id in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
create trigger studies_go_on_with_consent before update of state on studies
when new.state in ('running', 'waiting') and new.subject_id in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
create trigger trials_need_consent before insert on trials
when (select subject_id from studies where id = new.study_id) in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
create trigger trials_go_on_with_consent before update of state on trials
when new.state in ('queued', 'running')
    and (select subject_id from studies where id = new.study_id) in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
create trigger feedback_needs_consent before insert on feedback
when (select subject_id from studies where id = new.study_id) in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
create trigger presentations_need_consent before insert on presentations
when (select subject_id from studies where id = new.study_id) in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
create trigger presentation_answers_need_consent before insert on presentation_answers
when (select s.subject_id from presentations p join studies s on s.id = p.study_id where p.id = new.presentation_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

-- Certificates of gaits: what an examination independent of the optimisation found. Made on demand; a gait has one per
-- version of the examination.

create table certificates (
    trial_id       text not null references trials (id),
    format_version integer not null constraint certificates_format_version check (format_version >= 1),
    passed         integer not null constraint certificates_passed check (passed in (0, 1)),
    -- The whole certificate, JSON.
    document       text not null constraint certificates_document check (json_valid(document)),
    created_at     text not null,
    primary key (trial_id, format_version)
) strict;

create trigger certificates_no_update before update on certificates
begin select raise(abort, 'certificates are append-only'); end;
create trigger certificates_no_delete before delete on certificates
begin select raise(abort, 'certificates are append-only'); end;

-- Whoever answers a comparison is told who else has: found without reading all that a study has heard.

create index feedback_by_pair on feedback (trial_a, trial_b, author, source);

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

-- What stands in the record is sealed in the transaction that writes it: a hash of the row, chained with the seals
-- before. A row that another hand changed, added or took away does not fit its newest seal; `gaitwright audit verify`
-- finds it. Which tables are sealed, and how, is said in the program (store/seals.rs): what does not come through it has
-- no seal.
create table seals (
    seq      integer primary key autoincrement,
    -- The table of the row, and its primary key.
    evidence text not null,
    key      text not null,
    -- SHA-256 of the row; empty: the row was taken away.
    sha256   text not null constraint seals_sha256_length check (length(sha256) in (0, 64)),
    -- SHA-256 of the seal before, and of this one with it.
    previous text not null constraint seals_previous_length check (length(previous) = 64),
    hash     text not null constraint seals_hash_length check (length(hash) = 64)
) strict;

create index seals_by_row on seals (evidence, key, seq);

create trigger seals_no_update before update on seals
begin select raise(abort, 'seals are append-only'); end;
create trigger seals_no_delete before delete on seals
begin select raise(abort, 'seals are append-only'); end;

-- Lab sessions: one person walks without the device and with two gaits of a study, in an order that the server draws
-- and keeps to itself. Walk 1 is the one without the device; which gait is walk 2 follows from gait_one_first.

create table lab_sessions (
    id             text primary key not null,
    study_id       text not null references studies (id),
    -- 1, 2, ... of this study.
    number         integer not null constraint lab_sessions_number check (number >= 1),
    gait_one       text not null references trials (id),
    gait_two       text not null references trials (id),
    gait_one_first integer not null constraint lab_sessions_order check (gait_one_first in (0, 1)),
    notes          text not null default '' constraint lab_sessions_notes check (length(notes) <= 2000),
    actor          text not null,
    created_at     text not null,
    constraint lab_sessions_number_unique unique (study_id, number),
    constraint lab_sessions_two_gaits check (gait_one <> gait_two)
) strict;

-- What happened to a session; each of these happens once.
create table lab_acts (
    session_id text not null references lab_sessions (id),
    act        text not null
               constraint lab_acts_act check (act in ('walk_1', 'walk_2', 'walk_3', 'unblinded', 'closed')),
    note       text not null default '' constraint lab_acts_note check (length(note) <= 2000),
    actor      text not null,
    created_at text not null,
    primary key (session_id, act)
) strict;

create trigger lab_sessions_no_update before update on lab_sessions
begin select raise(abort, 'lab sessions are append-only'); end;
create trigger lab_sessions_no_delete before delete on lab_sessions
begin select raise(abort, 'lab sessions are append-only'); end;
create trigger lab_acts_no_update before update on lab_acts
begin select raise(abort, 'acts are append-only'); end;
create trigger lab_acts_no_delete before delete on lab_acts
begin select raise(abort, 'acts are append-only'); end;

create trigger lab_sessions_same_study before insert on lab_sessions
when exists (select 1 from trials where id in (new.gait_one, new.gait_two) and study_id <> new.study_id)
begin select raise(abort, 'a lab session names a trial of another study'); end;
create trigger lab_sessions_need_consent before insert on lab_sessions
when (select subject_id from studies where id = new.study_id) in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
create trigger lab_acts_need_consent before insert on lab_acts
when (select s.subject_id from lab_sessions l join studies s on s.id = l.study_id where l.id = new.session_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

-- What was measured in the walks of a lab session, as it was brought, and what was made of the electromyograms. The
-- newest recording of a walk counts; none is ever changed, so that it can be processed anew with other settings.

create table lab_recordings (
    id         text primary key not null,
    session_id text not null references lab_sessions (id),
    walk       integer not null constraint lab_recordings_walk check (walk in (1, 2, 3)),
    kind       text not null constraint lab_recordings_kind check (kind in ('electromyogram', 'motion')),
    -- How the file is to be read, JSON.
    reading    text not null constraint lab_recordings_reading check (json_valid(reading)),
    -- The file, zstd-compressed.
    raw        blob not null,
    raw_sha256 text not null,
    actor      text not null,
    created_at text not null
) strict;

create index lab_recordings_by_session on lab_recordings (session_id, kind, walk);

create table emg_results (
    id         text primary key not null,
    session_id text not null references lab_sessions (id),
    -- Settings and curves, JSON.
    document   text not null constraint emg_results_document check (json_valid(document)),
    actor      text not null,
    created_at text not null
) strict;

create index emg_results_by_session on emg_results (session_id);

create trigger lab_recordings_no_update before update on lab_recordings
begin select raise(abort, 'recordings are append-only'); end;
create trigger lab_recordings_no_delete before delete on lab_recordings
begin select raise(abort, 'recordings are append-only'); end;
create trigger emg_results_no_update before update on emg_results
begin select raise(abort, 'results are append-only'); end;
create trigger emg_results_no_delete before delete on emg_results
begin select raise(abort, 'results are append-only'); end;

create trigger lab_recordings_need_consent before insert on lab_recordings
when (select s.subject_id from lab_sessions l join studies s on s.id = l.study_id where l.id = new.session_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
create trigger emg_results_need_consent before insert on emg_results
when (select s.subject_id from lab_sessions l join studies s on s.id = l.study_id where l.id = new.session_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

-- Muscle parameters of a person, where they are known better than the published table. The newest row counts; studies keep
-- what they were made with.

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
create trigger subject_muscles_need_consent before insert on subject_muscles
when new.subject_id in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

-- What staff say of two gaits that is no preference: that they cannot tell which is better, that one must not be walked.
-- Raters say the same in presentation_answers.
create table remarks (
    id          text primary key not null,
    study_id    text not null references studies (id),
    first       text not null references trials (id),
    second      text not null references trials (id),
    answer      text not null
                constraint remarks_answer check (answer in ('cannot_tell', 'unsafe_first', 'unsafe_second', 'unsafe_both')),
    source      text not null constraint remarks_source check (source in ('subject', 'clinician', 'script')),
    author      text not null constraint remarks_author_length check (length(author) between 1 and 80),
    note        text not null default '' constraint remarks_note_length check (length(note) <= 2000),
    -- What the learner hears of it; null: nothing.
    feedback_id text references feedback (id),
    created_at  text not null,
    constraint remarks_two_gaits check (first <> second)
) strict;

create index remarks_by_study on remarks (study_id);

create table remark_retractions (
    remark_id  text primary key not null references remarks (id),
    author     text not null constraint remark_retractions_author_length check (length(author) between 1 and 80),
    reason     text not null constraint remark_retractions_reason_length check (length(reason) between 1 and 2000),
    created_at text not null
) strict;

-- Which answers that the learner heard came from a rater.
create index presentation_answers_by_feedback on presentation_answers (feedback_id) where feedback_id is not null;

create trigger remarks_no_update before update on remarks
begin select raise(abort, 'remarks are append-only'); end;
create trigger remarks_no_delete before delete on remarks
begin select raise(abort, 'remarks are append-only'); end;
create trigger remark_retractions_no_update before update on remark_retractions
begin select raise(abort, 'retractions are append-only'); end;
create trigger remark_retractions_no_delete before delete on remark_retractions
begin select raise(abort, 'retractions are append-only'); end;

create trigger remarks_same_study before insert on remarks
when exists (select 1 from trials where id in (new.first, new.second) and study_id <> new.study_id)
begin select raise(abort, 'a remark names a trial of another study'); end;
create trigger remarks_need_consent before insert on remarks
when (select subject_id from studies where id = new.study_id) in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

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
