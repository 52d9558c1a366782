//! Details of rows of the audit trail.

#![allow(dead_code)] // Schemas are never constructed.

use super::settings::{EmgSettings, MuscleParameters};
use gaitwright_service::access::{Right, Role};
use gaitwright_store::measurement_files::MeasurementKind;
use gaitwright_store::members::MemberKind;
use gaitwright_store::safety_reviews::SafetyDecision;
use gaitwright_store::studies::StudyState;
use gaitwright_store::trials::Label;
use gaitwright_store::{AnswerId, EmgResultId, Instant, MeasurementFileId, MemberId, SessionId, StudyId, TrialId};
use serde::Serialize;
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// Details of a change. The fields depend on the kind of change. A field whose description names no kind occurs with several
/// kinds.
#[derive(Debug, ToSchema)]
pub(crate) struct AuditDetail {
    /// `trial.ask`: true if the script was given its open trial again.
    #[schema(required = false)]
    again: bool,
    /// `session.begin`: network address of the browser. Null if it is not known.
    address: Option<String>,
    /// The answer, in the words of the request: `preference.give`, `assessment.give`, `lab_session.answer`.
    #[schema(required = false)]
    answer: String,
    /// `study.change`: whether the study is archived.
    #[schema(required = false)]
    archived: bool,
    /// Author of the answer, report, review, retraction or undo.
    #[schema(required = false)]
    author: String,
    /// Values before the change: `study.change`, `subject.correct`, `user.role`.
    #[schema(required = false)]
    before: AuditedBefore,
    /// Body mass, kg: `subject.add`, `subject.correct`, `reference_gait.import`. Null if it is not known.
    body_mass_kg: Option<f64>,
    /// Values of bounds by name: those suggested (`suggestion.give`), or relaxed (`trial.relax`).
    #[schema(required = false)]
    bounds: BTreeMap<String, f64>,
    /// `session.begin`: how the user signed in.
    #[schema(required = false)]
    by: SignInMethod,
    /// Size of the backup, bytes: `backup.complete`, `record.backup`.
    #[schema(required = false)]
    bytes: u64,
    /// `blind_pair.answer`: whether the rater could have known the allocation.
    #[schema(required = false)]
    could_have_known: bool,
    /// `gait.review`: the decision.
    #[schema(required = false)]
    decision: SafetyDecision,
    /// `sign_in.failures`: number of failed attempts of the network.
    #[schema(required = false)]
    failed_attempts: u32,
    /// `sign_in.refused`, `sign_in.delay`: number of failed attempts of the network so far.
    #[schema(required = false)]
    failed_attempts_of_network: u32,
    /// `trial.certify`: reasons of a failed certificate; otherwise empty.
    #[schema(required = false)]
    failures: Vec<String>,
    /// `backup.complete`: name of the file.
    #[schema(required = false)]
    file: String,
    /// `study.import`: SHA-256 of the archive, hexadecimal.
    #[schema(required = false)]
    file_sha256: String,
    /// `sign_in.failures`: time of the first attempt.
    #[schema(required = false)]
    first_at: Instant,
    /// `study.create`: the study whose set-up was copied. Null if it is not a clone.
    cloned_from: Option<StudyId>,
    /// `subject.consent`: the consent form.
    #[schema(required = false)]
    form: String,
    /// Value before the change: the state (`study.start`, `study.pause`, `study.resume`, `study.stop`) or the number of
    /// trials (`study.extend`).
    #[schema(required = false)]
    from: AuditedStateOrNumber,
    /// `trial.tell`: Gait RMSE, rad. Null if it was not reported.
    gait_rmse_rad: Option<f64>,
    /// Body height, m: `subject.add`, `subject.correct`, `reference_gait.import`. Null if it is not known.
    height_m: Option<f64>,
    /// `study.prune`: trials whose gaits were kept.
    #[schema(required = false)]
    kept: Vec<TrialId>,
    /// Kind of the member (`study.member_add`, `study.member_end`) or of the measurement file (`lab_session.upload`).
    #[schema(required = false)]
    kind: AuditedKind,
    /// `sign_in.failures`: time of the last attempt.
    #[schema(required = false)]
    last_at: Instant,
    /// Identifier of the member: `study.member_add`, `study.member_end`.
    #[schema(required = false)]
    member: MemberId,
    /// `trial.tell`: the label of the trial.
    #[schema(required = false)]
    label: Label,
    /// `subject.muscles`: the muscle values.
    #[schema(required = false)]
    muscles: MuscleParameters,
    /// Name of the object, of the member, or of the user who tried to sign in.
    #[schema(required = false)]
    name: String,
    /// `sign_in.failures`: number of different names that were tried.
    #[schema(required = false)]
    names: u32,
    /// Network of the address: `sign_in.refused`, `sign_in.failures`, `sign_in.delay`.
    #[schema(required = false)]
    network: String,
    /// Note about the answer, walk or session.
    #[schema(required = false)]
    note: String,
    /// `study.change`: notes.
    #[schema(required = false)]
    notes: String,
    /// Number of the trial, lab session, blind pair or answer.
    #[schema(required = false)]
    number: u32,
    /// `suggestion.give`: the trial whose gait the suggestion improves.
    #[schema(required = false)]
    over: TrialId,
    /// `study.change`: maximum number of trials that run at once.
    #[schema(required = false)]
    parallel_trials: u32,
    /// `trial.certify`: whether the certificate passed.
    #[schema(required = false)]
    passed: bool,
    /// `study.change`: priority.
    #[schema(required = false)]
    priority: i32,
    /// `subject.add`: the pseudonym.
    #[schema(required = false)]
    pseudonym: String,
    /// Name of the rater: `blind_pair.draw`, `blind_pair.retract`, `study.unblind_rater`.
    #[schema(required = false)]
    rater: String,
    /// Reason for the change, or why an answer was not used. Null if none was given.
    reason: Option<String>,
    /// `lab_session.upload`: the measurement file.
    #[schema(required = false)]
    recording: MeasurementFileId,
    /// `lab_session.process`: the measurement files that were processed.
    #[schema(required = false)]
    recordings: Vec<MeasurementFileId>,
    /// `trial.explain`: name of the bound that gives a gait if it is relaxed. Null if there is none.
    relaxed_bound: Option<String>,
    /// Whether only members see the study: `study.create`, `study.restrict`.
    #[schema(required = false)]
    restricted: bool,
    /// `preference.give`, `assessment.give`: the answer that it replaced. Null if it replaced none.
    replaces: Option<AnswerId>,
    /// `preference.undo`, `assessment.undo`: the new entry of the answer that counts again. Null if there is none.
    restored: Option<AnswerId>,
    /// `lab_session.process`: the processed EMG.
    #[schema(required = false)]
    result: EmgResultId,
    /// Role of the user: `user.add`, `user.role`.
    #[schema(required = false)]
    role: Role,
    /// `gait.review`: the safety reports that were reviewed.
    #[schema(required = false)]
    safety_reports: Vec<AuditedSafetyReport>,
    /// `record.backup`: always true.
    #[schema(required = false)]
    scheduled: bool,
    /// `token.create`: scopes of the token.
    #[schema(required = false)]
    scopes: Vec<Right>,
    /// `trial.ask`: name of the script.
    #[schema(required = false)]
    script: String,
    /// Seed of the study (`study.create`) or of simulated walks (`trial.request_execution_report`, `trial.report_execution`).
    #[schema(required = false)]
    seed: u64,
    /// `session.end`: the sign-in session.
    #[schema(required = false)]
    session: SessionId,
    /// `lab_session.process`: filters.
    #[schema(required = false)]
    settings: EmgSettings,
    /// `lab_session.upload`: SHA-256 of the file, hexadecimal.
    #[schema(required = false)]
    sha256: String,
    /// `study.import`: public key of the signature, hexadecimal. Null without a signature.
    signed_by: Option<String>,
    /// State, as in `StudyState`: `study.create`, `study.extend`.
    #[schema(required = false)]
    state: String,
    /// `subject.withdraw`: studies that were stopped.
    #[schema(required = false)]
    stopped: Vec<StudyId>,
    /// The study.
    #[schema(required = false)]
    study: StudyId,
    /// `study.change`: tags.
    #[schema(required = false)]
    tags: Vec<String>,
    /// Value after the change, as `from`.
    #[schema(required = false)]
    to: AuditedStateOrNumber,
    /// `lab_session.controller_file`: whether the file was sent to the device.
    #[schema(required = false)]
    to_device: bool,
    /// `study.prune`: number of gaits that were deleted.
    #[schema(required = false)]
    trajectories: u64,
    /// Trial of gait A: `preference.give`, `assessment.give`, `lab_session.plan`.
    #[schema(required = false)]
    trial_a: TrialId,
    /// Trial of gait B, as `trial_a`.
    #[schema(required = false)]
    trial_b: TrialId,
    /// `trial.relax`: number of trials of the study.
    #[schema(required = false)]
    number_of_trials: u32,
    /// `study.import`: whether the key of the signature is trusted.
    #[schema(required = false)]
    trusted: bool,
    /// `study.import`: number of gaits whose Gait RMSE could not be computed again.
    #[schema(required = false)]
    unchecked_rmse: u32,
    /// Number of the walk, 1 to 3: `lab_session.controller_file`, `lab_session.upload`, `lab_session.record_walk`.
    #[schema(required = false)]
    walk: u8,
    /// Number of simulated walks on each kind of ground: `trial.request_execution_report`, `trial.report_execution`.
    #[schema(required = false)]
    number_of_simulated_walks: u32,
    /// `trial.relax`: the trial without a gait whose bounds were relaxed.
    #[schema(required = false)]
    without_gait: TrialId,
}

/// How a user signed in.
#[derive(Debug, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum SignInMethod {
    Link,
    Password,
}

/// Kind of a member or of a measurement file.
#[derive(Debug, Serialize, ToSchema)]
#[serde(untagged)]
enum AuditedKind {
    Member(MemberKind),
    File(MeasurementKind),
}

/// State of a study, or a number of trials.
#[derive(Debug, Serialize, ToSchema)]
#[serde(untagged)]
enum AuditedStateOrNumber {
    State(StudyState),
    Number(u32),
}

/// Values before a change: settings of a study, height and mass of a subject, or the role of a user.
#[derive(Debug, Serialize, ToSchema)]
#[serde(untagged)]
enum AuditedBefore {
    Study(AuditedStudySettings),
    Subject(AuditedBodyMeasures),
    User(Role),
}

/// Settings of a study before a change.
#[derive(Debug, Serialize, ToSchema)]
struct AuditedStudySettings {
    /// Name.
    name: String,
    /// Priority.
    priority: i32,
    /// Maximum number of trials that run at once.
    parallel_trials: u32,
    /// Tags.
    tags: Vec<String>,
    /// Notes.
    notes: String,
    /// Whether the study was archived.
    archived: bool,
}

/// A safety report that was reviewed.
#[derive(Debug, ToSchema)]
struct AuditedSafetyReport {
    /// Time of the report.
    at: Instant,
    /// Its author.
    by: String,
}

/// Height and mass of a subject before a correction.
#[derive(Debug, Serialize, ToSchema)]
struct AuditedBodyMeasures {
    /// Body height, m.
    height_m: f64,
    /// Body mass, kg.
    body_mass_kg: f64,
}
