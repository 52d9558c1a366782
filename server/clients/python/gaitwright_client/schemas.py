"""The objects of the REST interface, as typed dictionaries.

Made by generate.py from server/openapi.json.
"""

from __future__ import annotations

from typing import Any, Literal, Optional, TypedDict, Union

# Kind of access: `view`, data were shown; `export`, data were downloaded as a file; `refused`, the request was refused.
AccessKind = Literal["view", "export", "refused"]

# Source of an answer in a request: `subject`, the person who walks; `clinician`; `script`, a lab script.
AnswerGiver = Literal["subject", "clinician", "script"]

# Identifier of an answer to a comparison: of a preference or of an assessment.
AnswerId = str

# Source of the answers of a study: `gait_rmse`, Gait RMSE answers every comparison; `people`, people answer, and the
# study waits for them; `both`, Gait RMSE answers, and people can add answers.
AnswerSource = Literal["gait_rmse", "people", "both"]

# Statement of a person instead of a preference between two gaits.
AssessmentAnswer = Literal["cannot_tell", "unsafe_a", "unsafe_b", "unsafe_both"]

# Identifier of an assessment.
AssessmentId = str

# Role of a study with an atlas, which has the gait of every action of a search space: `none`, no role; `make`, the
# study is an atlas, whose trials find the gait of every action; `use`, the study tunes, and takes each gait at once
# from a finished atlas of the same problem, if there is one on record.
AtlasRole = Literal["none", "make", "use"]

# Identifier of a backup.
BackupId = str

# Bytes that are not text, such as a picture or an archive.
Binary = bytes

# Identifier of a blind pair.
BlindPairId = str

# Why a pair is shown: `new`, the pending comparison; `repeat`, an earlier pair again, to measure agreement.
BlindPairKind = Literal["new", "repeat"]

# State of the certificate of a gait: `passed`, every checked value is within its limit, the walker does not fall and
# the gait is stable; `failed`, the certificate did not pass; `being_certified`, the gait is being certified;
# `not_certified`, the gait has no certificate.
CertificateState = Literal["passed", "failed", "being_certified", "not_certified"]

# Kind of entry: `given`, the subject gave consent; `withdrawn`, the subject withdrew it.
ConsentKind = Literal["given", "withdrawn"]

# A contact point of the foot.
ContactPoint = Literal["heel", "toe"]

# The heel strike at which the cycle of a channel begins: `right_heel_strike`; `left_heel_strike`, as recorded; or
# `assumed_left_heel_strike`, half a stride after the right one.
CycleStart = Literal["right_heel_strike", "left_heel_strike", "assumed_left_heel_strike"]

# Identifier of a device.
DeviceId = str

# Identifier of a result of EMG processing.
EmgResultId = str

# Evaluation of trials: `optimizer`, by the service; `script`, by lab scripts that ask for trials and report results.
Evaluation = Literal["optimizer", "script"]

# Identifier of an entry of the feedback of a study.
FeedbackId = str

# The direction of a force: `x` forwards, `z` upwards.
ForceAxis = Literal["x", "z"]

# A time in UTC (RFC 3339).
Instant = str

# Kind of job: the `backup` of the record, the `solve` or `explanation` of a trial, or the `certificate` or
# `execution_report` of a gait.
JobKind = Literal["backup", "certificate", "execution_report", "explanation", "solve"]

# State of a job: `queued` and `running`; `done`, it ended with a result; `failed`, it ended without one; `cancelled`,
# by a user or a program.
JobState = Literal["queued", "running", "done", "failed", "cancelled"]

# File format of a recording of joint angles: `opensim`, a motion or storage file (.mot, .sto) of a gait model;
# `camargo`, the `data` table of an `ik` file from the Camargo 2021 data set, as CSV; `csv`, a CSV file as `/help/data-
# files` describes it.
JointAngleFormat = Literal["opensim", "camargo", "csv"]

# Identifier of a lab session.
LabSessionId = str

# State of a lab session: `planned`, no walk is recorded; `under_way`, at least one walk is recorded; `answered`, the
# subject has answered, so no walk is left; `closed`, the session accepts no more data except safety reports.
LabSessionState = Literal["planned", "under_way", "answered", "closed"]

# Label of a trial: `converged`, the evaluation found a gait; `not_converged`, it found none, which is a result, too;
# `not_executable`, it found a gait whose simulated walks are too short for the study, which is a result like
# `not_converged`.
Label = Literal["converged", "not_converged", "not_executable"]

# A leg: `left` (intact) or `right` (prosthesis).
Leg = Literal["left", "right"]

# Identifier of a measurement file of a lab session.
MeasurementFileId = str

# Format of a measurement file: `csv`, comma-separated values with column names in the first line; `opensim`, a motion
# or storage file (.mot, .sto).
MeasurementFormat = Literal["csv", "opensim"]

# Kind of measurement file: `emg`, an EMG recording; `joint_angles`, joint angles.
MeasurementKind = Literal["emg", "joint_angles"]

# Identifier of a membership in a study.
MemberId = str

# Kind of member.
MemberKind = Literal["user", "token"]

# Answer about two gaits in the order in which they were shown or walked: which one is better, no difference, cannot
# tell, or which one is unsafe. `retracted` is reserved for the service.
OrderedAnswer = Literal[
    "first", "second", "no_difference", "cannot_tell", "unsafe_first", "unsafe_second", "unsafe_both", "retracted",
]

# Which of two gaits is better.
PairAnswer = Literal["a", "b", "no_difference"]

# Identifier of a reference gait.
ReferenceGaitId = str

# Label that a script reports: `converged`, the evaluation found a gait; `not_converged`, it found none.
ReportedLabel = Literal["converged", "not_converged"]

# A right of a user or a token: `read`, see everything except blinded data; `run`, create, start, pause and stop
# studies, plan lab sessions, and evaluate trials by scripts; `answer`, give preferences without blinding, and review
# safety reports; `rate`, compare gaits blind, and record walks and answers in lab sessions; `device`, fetch the
# controller files of walks; `administer`, manage users and tokens, unblind, read the audit trail and make backups. The
# scopes of a token are rights other than `administer`.
Right = Literal["read", "run", "answer", "rate", "device", "administer"]

# Role of a user: `administrator` has every right; `clinician` runs studies and gives preferences; `rater` compares
# gaits blind and records walks and answers in lab sessions.
Role = Literal["administrator", "clinician", "rater"]

# Decision of a safety review: `cleared`, the gait may be used for walking; `unsafe`, it remains marked as unsafe.
SafetyDecision = Literal["cleared", "unsafe"]

# Identifier of a safety report.
SafetyReportId = str

# Identifier of a safety review.
SafetyReviewId = str

# Identifier of a sign-in session of a user.
SessionId = str

# How a user signed in.
SignInMethod = Literal["link", "password"]

# Effect of simulated walks with each gait on a study: `none`, the service simulates none by itself; `report`, each gait
# gets an execution report; `tie_break`, the report also decides between two gaits with nearly the same Gait RMSE;
# `label`, a gait with too few mean strides gets the label `not_executable`.
SimulatedWalksEffect = Literal["none", "report", "tie_break", "label"]

# How a solve ended: `converged`, every constraint is satisfied; `infeasible`, at a local minimum of the violation, with
# no gait near it; `stalled`, without further progress; `iteration_limit` and `time_limit`, at that limit; `cancelled`,
# by a user or a program.
SolveStatus = Literal["converged", "infeasible", "stalled", "iteration_limit", "time_limit", "cancelled"]

# Source of an entry: `evaluation`, the optimiser or script that evaluated the trial; `gait_rmse`, the lower Gait RMSE
# wins; `subject` and `clinician`, a person; `script`, a lab script.
Source = Literal["evaluation", "gait_rmse", "subject", "clinician", "script"]

# Starting point of a solve: `cold`, initial guesses; `warm`, the given warm start; `cold_after_warm`, initial guesses,
# after the given warm start did not converge.
StartedFrom = Literal["cold", "warm", "cold_after_warm"]

# How to find right heel strikes: `force`, where the vertical force under the right foot rises above 20 N; `kinematics`,
# where the right heel is farthest ahead of the pelvis; `ends`, at the first and the last row of a recording of one
# stride.
Strikes = Literal["force", "kinematics", "ends"]

# Identifier of a study.
StudyId = str

# State of a study: `not_started`, not started; `running`, proposing and evaluating trials; `waiting`, for an answer
# from a person; `paused`, by a user or a program; `finished`, all trials are made or a stopping rule applied;
# `stopped`, by a user or a program.
StudyState = Literal["not_started", "running", "waiting", "paused", "finished", "stopped"]

# Identifier of a subject.
SubjectId = str

# Identifier of a token.
TokenId = str

# Identifier of a trial.
TrialId = str

# State of a trial. `queued` and `running` trials are open. `converged`, `not_converged` and `not_executable` (a gait
# whose simulated walks are too short for the study) are results; `failed` (error, crash or time limit), `lost` (the
# worker stopped responding) and `cancelled` are not.
TrialState = Literal["queued", "running", "converged", "not_converged", "not_executable", "failed", "lost", "cancelled"]

# Unit of angles.
Unit = Literal["degrees", "radians"]

# Identifier of a user.
UserId = str

# Condition of a walk: `normal`, without the device; `gait_a` and `gait_b`, with that gait of the session.
WalkCondition = Literal["normal", "gait_a", "gait_b"]

# The gait from which a trial is warm-started: `incumbent`, the best gait so far, as in the published method; `root`,
# the first gait of the study, which has the default bounds, so that the gait of an action does not depend on other
# trials.
WarmStartFrom = Literal["incumbent", "root"]


class AccessLogEntry(TypedDict):
    """Entry of the access log."""

    # Actor of the request.
    actor: str
    # Client address; empty for the command line.
    address: str
    # Time of the first access.
    created_at: Instant
    # Kind of the access.
    kind: AccessKind
    # Time of the last access.
    last_at: Instant
    # HTTP method; empty for the command line.
    method: str
    # Requested URL, without secrets.
    object: str
    # Route, or command.
    route: str
    # Sequence number.
    seq: int
    # HTTP status; 0 for the command line.
    status: int
    # Study of the request, if any.
    study_id: Optional[StudyId]
    # Subject of the request, if any.
    subject_id: Optional[SubjectId]
    # Number of identical accesses within a minute.
    times: int


class ActiveConstraint(TypedDict):
    """Constraint that is active at a node or over the stride."""

    # Multiplier of the scaled constraint: decrease of the objective per unit by which the constraint is relaxed.
    multiplier: float
    # Domain, node and quantity.
    place: str


class AnswerReceipt(TypedDict):
    """Confirmation of a rater's answer. The response is stored, and sent again if the request is repeated. It omits
    the gaits and the answer, because others who can read the study must not learn which gait was shown on which
    side.
    """

    # Number of the pair for this rater.
    number: int


class _AnswerRetractionRequired(TypedDict):
    # Why the answer is void.
    reason: str


class AnswerRetraction(_AnswerRetractionRequired, total=False):
    """Retraction of a preference, an assessment or a suggestion."""

    # Author of the retraction. Defaults to the caller's name.
    author: Optional[str]


class AnswerUndo(TypedDict, total=False):
    """Request to undo an answer."""

    # Name or pseudonym of the person who undoes the answer. Defaults to the caller's name.
    author: Optional[str]


class AskRequest(TypedDict, total=False):
    """A request for a trial."""

    # Name of the script that evaluates the trial. A script has at most one open trial. Defaults to the caller's name.
    script: Optional[str]


class Assessment(TypedDict):
    """A recorded assessment."""

    # The answer.
    answer: AssessmentAnswer
    # Name or pseudonym of the person who answered.
    author: str
    # Time of recording.
    created_at: Instant
    # Preference that was derived from it. Null if there is none.
    feedback_id: Optional[FeedbackId]
    # Identifier.
    id: AssessmentId
    # Free text.
    note: str
    # Identifier of the preference or assessment that it replaced. Null if it replaced none.
    replaces: Optional[AnswerId]
    # Identifier of the assessment that it brings back, because the answer that had replaced that one was undone. Null
    # otherwise.
    restores: Optional[AssessmentId]
    # Retraction. Null if the assessment was not retracted.
    retraction: Optional[Retraction]
    # Source of the answer.
    source: Source
    # Identifier of the study.
    study_id: StudyId
    # The trial with gait A.
    trial_a: TrialId
    # The trial with gait B.
    trial_b: TrialId


class Atlas(TypedDict):
    """Progress and best gait of an atlas."""

    # Number of actions of the search space.
    actions: int
    # Number of actions with a gait.
    actions_with_gait: int
    # Number of actions with a gait, or with a solve that found none.
    actions_with_result: int
    # Its Gait RMSE, rad.
    best_certified_gait_rmse_rad: Optional[float]
    # The trial with the lowest Gait RMSE among those that passed certification. Null if none has passed yet.
    best_certified_trial_id: Optional[TrialId]
    # Its Gait RMSE, rad.
    best_gait_rmse_rad: Optional[float]
    # The trial with the lowest Gait RMSE. Null before the first gait.
    best_trial_id: Optional[TrialId]
    # Number of different gaits.
    gaits: int
    # Number of solves that these results come from.
    solves: int
    # About how many solves are missing, if each serves as many further actions as the latest ones did.
    solves_left: int


class AttemptResult(TypedDict):
    """Result of an attempt."""

    # Number of the attempt, from 1.
    attempt: int
    # Time of arrival.
    received_at: Instant
    # Numerical results of the solve, without those that are not finite.
    report: Optional[SolveReport]
    # How the solve ended.
    status: SolveStatus
    # Whether it became the result of the trial. Otherwise it arrived too late and is kept as evidence.
    used: bool
    # Name of the worker.
    worker: str


AuditDetail = TypedDict(
    "AuditDetail",
    {
        # `session.begin`: network address of the browser. Null if it is not known.
        "address": "Optional[str]",
        # `trial.ask`: true if the script was given its open trial again.
        "again": "bool",
        # The answer, in the words of the request: `preference.give`, `assessment.give`, `lab_session.answer`.
        "answer": "str",
        # `study.change`: whether the study is archived.
        "archived": "bool",
        # Author of the answer, report, review, retraction or undo.
        "author": "str",
        # Values before the change: `study.change`, `subject.correct`, `user.role`.
        "before": "AuditedBefore",
        # Body mass, kg: `subject.add`, `subject.correct`, `reference_gait.import`. Null if it is not known.
        "body_mass_kg": "Optional[float]",
        # Values of bounds by name: those suggested (`suggestion.give`), or relaxed (`trial.relax`).
        "bounds": "dict[str, float]",
        # `session.begin`: how the user signed in.
        "by": "SignInMethod",
        # Size of the backup, bytes: `backup.complete`, `record.backup`.
        "bytes": "int",
        # `study.create`: the study whose set-up was copied. Null if it is not a clone.
        "cloned_from": "Optional[StudyId]",
        # `blind_pair.answer`: whether the rater could have known the allocation.
        "could_have_known": "bool",
        # `gait.review`: the decision.
        "decision": "SafetyDecision",
        # `sign_in.failures`: number of failed attempts of the network.
        "failed_attempts": "int",
        # `sign_in.refused`, `sign_in.delay`: number of failed attempts of the network so far.
        "failed_attempts_of_network": "int",
        # `trial.certify`: reasons of a failed certificate; otherwise empty.
        "failures": "list[str]",
        # `backup.complete`: name of the file.
        "file": "str",
        # `study.import`: SHA-256 of the archive, hexadecimal.
        "file_sha256": "str",
        # `sign_in.failures`: time of the first attempt.
        "first_at": "Instant",
        # `subject.consent`: the consent form.
        "form": "str",
        # Value before the change: the state (`study.start`, `study.pause`, `study.resume`, `study.stop`) or the number of
        # trials (`study.extend`).
        "from": "AuditedStateOrNumber",
        # `trial.tell`: Gait RMSE, rad. Null if it was not reported.
        "gait_rmse_rad": "Optional[float]",
        # Body height, m: `subject.add`, `subject.correct`, `reference_gait.import`. Null if it is not known.
        "height_m": "Optional[float]",
        # `study.prune`: trials whose gaits were kept.
        "kept": "list[TrialId]",
        # Kind of the member (`study.member_add`, `study.member_end`) or of the measurement file (`lab_session.upload`).
        "kind": "AuditedKind",
        # `trial.tell`: the label of the trial.
        "label": "Label",
        # `sign_in.failures`: time of the last attempt.
        "last_at": "Instant",
        # Identifier of the member: `study.member_add`, `study.member_end`.
        "member": "MemberId",
        # `subject.muscles`: the muscle values.
        "muscles": "MuscleParameters",
        # Name of the object, of the member, or of the user who tried to sign in.
        "name": "str",
        # `sign_in.failures`: number of different names that were tried.
        "names": "int",
        # Network of the address: `sign_in.refused`, `sign_in.failures`, `sign_in.delay`.
        "network": "str",
        # Note about the answer, walk or session.
        "note": "str",
        # `study.change`: notes.
        "notes": "str",
        # Number of the trial, lab session, blind pair or answer.
        "number": "int",
        # Number of simulated walks on each kind of ground: `trial.request_execution_report`, `trial.report_execution`.
        "number_of_simulated_walks": "int",
        # `trial.relax`: number of trials of the study.
        "number_of_trials": "int",
        # `suggestion.give`: the trial whose gait the suggestion improves.
        "over": "TrialId",
        # `study.change`: maximum number of trials that run at once.
        "parallel_trials": "int",
        # `trial.certify`: whether the certificate passed.
        "passed": "bool",
        # `study.change`: priority.
        "priority": "int",
        # `subject.add`: the pseudonym.
        "pseudonym": "str",
        # Name of the rater: `blind_pair.draw`, `blind_pair.retract`, `study.unblind_rater`.
        "rater": "str",
        # Reason for the change, or why an answer was not used. Null if none was given.
        "reason": "Optional[str]",
        # `lab_session.upload`: the measurement file.
        "recording": "MeasurementFileId",
        # `lab_session.process`: the measurement files that were processed.
        "recordings": "list[MeasurementFileId]",
        # `trial.explain`: name of the bound that gives a gait if it is relaxed. Null if there is none.
        "relaxed_bound": "Optional[str]",
        # `preference.give`, `assessment.give`: the answer that it replaced. Null if it replaced none.
        "replaces": "Optional[AnswerId]",
        # `preference.undo`, `assessment.undo`: the new entry of the answer that counts again. Null if there is none.
        "restored": "Optional[AnswerId]",
        # Whether only members see the study: `study.create`, `study.restrict`.
        "restricted": "bool",
        # `lab_session.process`: the processed EMG.
        "result": "EmgResultId",
        # Role of the user: `user.add`, `user.role`.
        "role": "Role",
        # `gait.review`: the safety reports that were reviewed.
        "safety_reports": "list[AuditedSafetyReport]",
        # `record.backup`: always true.
        "scheduled": "bool",
        # `token.create`: scopes of the token.
        "scopes": "list[Right]",
        # `trial.ask`: name of the script.
        "script": "str",
        # Seed of the study (`study.create`) or of simulated walks (`trial.request_execution_report`,
        # `trial.report_execution`).
        "seed": "int",
        # `session.end`: the sign-in session.
        "session": "SessionId",
        # `lab_session.process`: filters.
        "settings": "EmgSettings",
        # `lab_session.upload`: SHA-256 of the file, hexadecimal.
        "sha256": "str",
        # `study.import`: public key of the signature, hexadecimal. Null without a signature.
        "signed_by": "Optional[str]",
        # State, as in `StudyState`: `study.create`, `study.extend`.
        "state": "str",
        # `subject.withdraw`: studies that were stopped.
        "stopped": "list[StudyId]",
        # The study.
        "study": "StudyId",
        # `study.change`: tags.
        "tags": "list[str]",
        # Value after the change, as `from`.
        "to": "AuditedStateOrNumber",
        # `lab_session.controller_file`: whether the file was sent to the device.
        "to_device": "bool",
        # `study.prune`: number of gaits that were deleted.
        "trajectories": "int",
        # Trial of gait A: `preference.give`, `assessment.give`, `lab_session.plan`.
        "trial_a": "TrialId",
        # Trial of gait B, as `trial_a`.
        "trial_b": "TrialId",
        # `study.import`: whether the key of the signature is trusted.
        "trusted": "bool",
        # `study.import`: number of gaits whose Gait RMSE could not be computed again.
        "unchecked_rmse": "int",
        # Number of the walk, 1 to 3: `lab_session.controller_file`, `lab_session.upload`, `lab_session.record_walk`.
        "walk": "int",
        # `trial.relax`: the trial without a gait whose bounds were relaxed.
        "without_gait": "TrialId",
    },
    total=False,
)


class AuditEntry(TypedDict):
    """Entry of the audit trail."""

    # Actor of the change.
    actor: str
    # Kind of change, such as `subject.add` or `study.pause`.
    change: str
    # Time of the change.
    created_at: Instant
    # Details of the change, with the reason if there is one.
    detail: AuditDetail
    # Hash over this row and the hash of the previous row.
    hash: str
    # Changed object, such as `study 0190...`.
    object: str
    # Hash of the previous row.
    previous: str
    # Sequence number.
    seq: int


class AuditedBodyMeasures(TypedDict):
    """Height and mass of a subject before a correction."""

    # Body mass, kg.
    body_mass_kg: float
    # Body height, m.
    height_m: float


class AuditedSafetyReport(TypedDict):
    """A safety report that was reviewed."""

    # Time of the report.
    at: Instant
    # Its author.
    by: str


class AuditedStudySettings(TypedDict):
    """Settings of a study before a change."""

    # Whether the study was archived.
    archived: bool
    # Name.
    name: str
    # Notes.
    notes: str
    # Maximum number of trials that run at once.
    parallel_trials: int
    # Priority.
    priority: int
    # Tags.
    tags: list[str]


class Backup(TypedDict):
    """A complete backup."""

    # Size in bytes.
    bytes: int
    # Time of completion.
    created_at: Instant
    # File name, in the folder of the database.
    file: str
    # Identifier.
    id: BackupId


class BaseBounds(TypedDict, total=False):
    """Values of bounds. Absent bounds take their default values."""

    # Maximum coordinate velocity, rad/s.
    a1: float
    # Maximum coordinate acceleration, rad/s².
    a2: float
    # Minimum hip velocity, m/s.
    a3: float
    # Maximum hip velocity, m/s.
    a4: float
    # Minimum swing-foot clearance, m.
    a5: float
    # Maximum torso lean, rad.
    a6: float
    # Maximum hip angle, °.
    a7: float
    # Maximum ankle angle, °.
    a8: float


class BlindMotion(TypedDict):
    """Motion to compare."""

    # 101 stick figures over one stride. Each has ten points (hip, shoulder, then knee, ankle, heel and toe of the left
    # and of the right leg) as forward and upward coordinates, m.
    stick_figures: list[list[list[float]]]


class BlindPair(TypedDict):
    """Pair to compare, as shown to a rater."""

    # Code of the pair.
    code: str
    # URL of the motion that is shown first.
    first: str
    # Number of the pair for this rater.
    number: int
    # URL of the motion that is shown second.
    second: str


class BodyMeasures(TypedDict):
    """Height and mass of a subject."""

    # Body mass, kg.
    body_mass_kg: float
    # Body height, m.
    height_m: float


class BoundAtLimit(TypedDict):
    """A tuned bound that is active at the last iterate of a solve."""

    # Name of the bound.
    bound: str
    # Domains in which the bound is active; `stride` for a constraint on the whole stride.
    domains: list[str]
    # Limited quantity and its unit.
    meaning: str
    # Value of the bound in the problem.
    value: float


class BoundValue(TypedDict):
    """A tuned bound with its given value."""

    # Name of the bound.
    bound: str
    # Limited quantity and its unit.
    meaning: str
    # Value of the bound in the problem.
    value: float


class Bounds(TypedDict):
    """Values of the bounds that can be tuned."""

    # Maximum coordinate velocity, rad/s.
    a1: float
    # Maximum coordinate acceleration, rad/s².
    a2: float
    # Minimum hip velocity, m/s.
    a3: float
    # Maximum hip velocity, m/s.
    a4: float
    # Minimum swing-foot clearance, m.
    a5: float
    # Maximum torso lean, rad.
    a6: float
    # Maximum hip angle, °.
    a7: float
    # Maximum ankle angle, °.
    a8: float


class Caller(TypedDict):
    """Caller of the request."""

    # Name of the user or the token.
    name: str
    # Rights of the caller.
    rights: list[Right]
    # Role of the user. Null for tokens.
    role: Optional[Role]


class Certificate(TypedDict):
    """A certificate: the result of checking a gait independently of the optimiser."""

    # The gait that was checked; null if it is malformed.
    certified: Optional[CertifiedGait]
    # Every quantity with its worst value and its limit.
    checks: list[CertificateCheck]
    # Reasons if it failed; otherwise empty.
    failures: list[str]
    # How the simulation ended early; null if it did not.
    fall: Optional[str]
    # Version of this layout and of its checks.
    format_version: int
    # The stride-to-stride map with a free hip velocity (zero dynamics). Null if the simulation ended early, or if the
    # map could not be computed.
    free_hip_return_map: Optional[ReturnMap]
    # Whether every checked value is within its limit, the walker does not fall, and the gait is stable.
    passed: bool
    # Largest pushes from which the walker recovers. Null if the gait is not stable.
    pushes: Optional[Pushes]
    # The stride-to-stride map. Null if the simulation ended early.
    return_map: Optional[ReturnMap]


class CertificateCheck(TypedDict):
    """The worst value of a quantity."""

    # Largest allowed value. Null if the value is only reported.
    limit: Optional[float]
    # Name of the measured quantity.
    name: str
    # Domain and time of the worst value.
    place: str
    # Unit of the value and the limit; empty if dimensionless.
    unit: str
    # Worst value; null if it could not be determined, which counts as failed.
    value: Optional[float]


class CertifiedDifference(TypedDict):
    """A value that differs from the built-in problem."""

    # Value of the built-in problem; null if it is not set.
    built_in: Any
    # Path of the value in the gait document, such as `settings.limits.friction` or `device.knee_torque_limit_n_m`.
    name: str
    # Value of the gait; null if it is not set.
    value: Any


class CertifiedGait(TypedDict):
    """Identity of the gait that a certificate is about, computed from the gait."""

    # Mechanical cost of transport, from absolute joint powers; dimensionless. It is computed from the gait, and so is
    # that of its trial.
    cost_of_transport: float
    # Name of the device. `differences` shows whether its values are those of the built-in device.
    device: str
    # Values of the device and of the settings that differ from AMPRO3 and the default settings.
    differences: list[CertifiedDifference]
    # SHA-256 of the gait as compact JSON, hexadecimal.
    gait_sha256: str
    # Whether the muscle constraints were checked.
    muscles: bool
    # Version of the optimiser that made the certificate.
    optimizer_version: str
    # The subject.
    subject: CertifiedSubject


class CertifiedSubject(TypedDict):
    """Height and mass of a certified walker."""

    # Body mass, kg.
    body_mass_kg: float
    # Body height, m.
    height_m: float


class _ChosenColumnRequired(TypedDict):
    # Name of the column in the file.
    column: str


class ChosenColumn(_ChosenColumnRequired, total=False):
    """The column of a joint angle."""

    # Whether the sign of the column is opposite to that of the walker, in which forward lean, flexion and dorsiflexion
    # are positive.
    reversed: bool


class _ConflictRequired(TypedDict):
    # The bounds. Empty if the fixed constraints conflict with each other.
    bounds: list[BoundValue]
    # Number of starting points of the search.
    starts: int
    # Whether a solve ended without a decision, for example as `stalled` or `time_limit`. If so, infeasibility is not
    # certain.
    undecided: bool
    # Violations in the motion closest to feasibility that the search found, with all other tuned bounds at their
    # loosest, worst first.
    violations: list[Violation]


class Conflict(_ConflictRequired, total=False):
    """Tuned bounds that conflict. With all other tuned bounds at their loosest, no gait satisfied all of these bounds,
    but relaxing any one of them gave a gait.
    """

    # Requirements for natural walking that take part in a conflict between fixed constraints, in words; absent if there
    # are none.
    naturalness_terms: list[str]
    # Bounds of other conflicts that were relaxed when this conflict was found.
    without: list[str]


class Consent(TypedDict):
    """A subject's consent, or withdrawal of consent. The newest entry applies."""

    # Actor who recorded it.
    actor: str
    # Time of recording.
    created_at: Instant
    # Consent or withdrawal.
    kind: ConsentKind
    # For consent, the name and version of the signed form. For a withdrawal, the reason, or `none given`.
    note: str
    # Sequence number.
    seq: int


class ConsentWithdrawal(TypedDict):
    """A withdrawal of consent."""

    # Reason, 1 to 2000 characters, or `none given` if the subject gave none.
    reason: str


class ContactRowName(TypedDict):
    """A component of the ground reaction force on one contact point."""

    # Direction: `x` forwards, `z` upwards.
    axis: ForceAxis
    # Point of the foot.
    point: ContactPoint
    # Leg: `left` (intact) or `right` (prosthesis).
    side: Leg


class ControlledDomain(TypedDict):
    """A domain, as a controller tracks it."""

    # Planned duration, s.
    duration_s: float
    # The event that ends the domain.
    ends: str
    # Set point of the hip velocity, m/s. Null in underactuated domains, in which it is free.
    hip_velocity_m_s: Optional[float]
    # Name: DS2 and DS3 for double support, SS2 and SS1 for single support on the flat foot and on the toe, with _R or
    # _L for the stance leg.
    name: str
    # The joints that the controller drives.
    outputs: list[ControllerOutput]
    # Hip position at the end, where the phase is 1, m.
    phase_end_m: float
    # Derivative of the hip position over the stance toe with respect to each angle, by the name of the angle: torso,
    # hip_L, knee_L, ankle_L, hip_R, knee_R and ankle_R, m/rad.
    phase_gradient_m_per_rad: dict[str, float]
    # Hip position at the start, where the phase is 0, m.
    phase_start_m: float
    # The stance leg; in double support, the leg that becomes the stance leg.
    stance: Leg


class _ControllerFileRequired(TypedDict):
    # Name of the device.
    device: str
    # The domains of a stride, in order from right heel strike.
    domains: list[ControlledDomain]
    # Description of each field, by its name.
    fields: dict[str, str]
    # `gaitwright controller`.
    format: str
    # Version of the layout.
    format_version: int
    # Distance between right heel strikes, m.
    stride_length_m: float
    # Time from one right heel strike to the next, s.
    stride_time_s: float
    # Set points of the prosthetic joints over one stride, for tracking in time.
    trajectory: SetPoints


class ControllerFile(_ControllerFileRequired, total=False):
    """The file that the controller of a device reads. Forward lean, hip flexion, knee flexion and ankle dorsiflexion
    are positive. R is the prosthesis, L the intact leg.
    """

    # Whether the certificate of the gait passed. Absent in the file of a blinded walk, because it could identify the
    # gait.
    certificate_passed: bool


class ControllerFileDownload(TypedDict):
    """Download of the controller file of a walk."""

    # Actor of the download.
    actor: str
    # Time of the download.
    created_at: Instant
    # Whether the device itself fetched the file. If not, the caller may know which gait the walk uses.
    to_device: bool
    # Number of the walk, 2 or 3.
    walk: int


class ControllerOutput(TypedDict):
    """A driven joint and its curve over the phase."""

    # Bezier coefficients of the curve, of degree 5, rad.
    bezier_rad: list[float]
    # Name of the joint, such as `hip_L`; `torso` is the torso lean.
    joint: str


class Correction(TypedDict):
    """Correction of height and mass."""

    # Actor of the correction.
    actor: str
    # Corrected body mass, kg.
    body_mass_kg: float
    # Time of the correction.
    created_at: Instant
    # Corrected body height, m.
    height_m: float
    # Body mass before the correction, kg.
    previous_body_mass_kg: float
    # Body height before the correction, m.
    previous_height_m: float
    # Reason for the correction.
    reason: str
    # Sequence number.
    seq: int


class Preference(TypedDict):
    """A preference of a study."""

    # Name or pseudonym of the person who answered.
    author: str
    # Whether it comes from a rater's blind comparison.
    by_rater: bool
    # Content of the preference, in terms of trials.
    content: PreferenceContent
    # Whether the rater could have known the allocation. If so, it does not count as blind.
    could_have_known: bool
    # Time of recording.
    created_at: Instant
    # Identifier.
    id: FeedbackId
    # Free text.
    note: str
    # Identifier of the preference or assessment that it replaced. Null if it replaced none.
    replaces: Optional[AnswerId]
    # Identifier of the preference that it brings back, because the answer that had replaced that one was undone. Null
    # otherwise.
    restores: Optional[FeedbackId]
    # Retraction. Null if it was not retracted.
    retraction: Optional[Retraction]
    # Sequence number.
    seq: int
    # Source of the answer.
    source: Source
    # Identifier of the study.
    study_id: StudyId


class CreatedPreference(Preference):
    """Recorded preference."""

    # Identifiers of other people's preferences about the same two gaits, at most the twenty newest.
    other_answers: list[FeedbackId]


class CreatedRaterInvitation(TypedDict):
    """Invited rater."""

    # The membership.
    member: Member
    # Path of the one-time sign-in link, which is shown once and valid for a day.
    path: str


class Token(TypedDict):
    """Token of a program, without its secret."""

    # Time of creation.
    created_at: Instant
    # Actor who created it. The token is revoked when this user is disabled or is no longer an administrator.
    created_by: str
    # Time of expiry. Null if it does not expire.
    expires_at: Optional[Instant]
    # Identifier.
    id: TokenId
    # Unique name that states its purpose.
    name: str
    # Time of revocation. Null if it is not revoked.
    revoked_at: Optional[Instant]
    # Rights of the token.
    scopes: list[Right]


class CreatedToken(Token):
    """New token."""

    # Secret, shown once. Send it as `Authorization: Bearer SECRET`.
    secret: str


class CycleActivity(TypedDict):
    """Activity of a channel at 0, 1, ..., 100 % of the gait cycle, mean over strides."""

    # Heel strike at which the cycle begins: that of the leg of the channel. Results stored without this value begin at
    # right heel strike.
    begins_at: CycleStart
    # Name of the channel.
    channel: str
    # Mean over strides, relative to the peak of walk 1.
    mean: list[float]
    # Standard deviation over strides, relative to the peak of walk 1; zero for one stride.
    standard_deviation: list[float]
    # Number of strides.
    strides: int


class Device(TypedDict):
    """Device. Changing a definition creates a new device, so that studies keep the one they use."""

    # Time of creation.
    created_at: Instant
    # Definition of the device.
    definition: DeviceDefinition
    # Identifier.
    id: DeviceId
    # Name shown to users.
    name: str


class _DeviceDefinitionRequired(TypedDict):
    # Radius of gyration of the adapter, m.
    adapter_gyration_radius_m: float
    # Mass of the adapter, which is midway between the human knee and the prosthetic knee, kg.
    adapter_mass_kg: float
    # Height of the ankle above the sole, m.
    ankle_height_m: float
    # Dorsiflexion stop, rad.
    ankle_max_rad: float
    # Plantarflexion stop, rad (dorsiflexion positive).
    ankle_min_rad: float
    # Largest ankle torque, N m.
    ankle_torque_limit_n_m: float
    # Whether the subject also carries their own shank and foot, with the knee bent, as with a bypass adapter.
    carried_limb: bool
    # Distance of the foot's centre of mass below the ankle, m.
    foot_com_down_m: float
    # Distance of the foot's centre of mass ahead of the ankle, m.
    foot_com_forward_m: float
    # Moment of inertia of the foot about its centre of mass, kg m².
    foot_inertia_kg_m2: float
    # Mass of the prosthetic foot with shoe, kg.
    foot_mass_kg: float
    # Distance of the heel contact behind the ankle, m.
    heel_behind_m: float
    # Largest knee and ankle speed, rad/s.
    joint_speed_limit_rad_s: float
    # Moment of inertia, about its own centre of mass, of the part at the prosthetic knee that moves with the thigh, kg
    # m².
    knee_housing_inertia_kg_m2: float
    # Mass at the prosthetic knee that moves with the thigh, kg.
    knee_housing_mass_kg: float
    # Largest knee torque, N m.
    knee_torque_limit_n_m: float
    # Unique name.
    name: str
    # Distance of the shank's centre of mass below the knee, in shank lengths.
    shank_com_fraction: float
    # Radius of gyration of the shank about its centre of mass, in shank lengths.
    shank_gyration_fraction: float
    # Distance from knee to ankle, m.
    shank_length_m: float
    # Mass of the prosthetic shank, kg.
    shank_mass_kg: float
    # Distance of the toe contact ahead of the ankle, m.
    toe_ahead_m: float


class DeviceDefinition(_DeviceDefinitionRequired, total=False):
    """Definition of a device: name, masses, lengths and limits of the prosthesis."""

    # Source of each value, by the name of its field.
    sources: dict[str, str]


class Dimension(TypedDict):
    """One tuned bound of a search space."""

    # How far apart two values can be, in the unit of the bound, while their gaits are still expected to have similar
    # utility.
    lengthscale: float
    # Name of the bound.
    name: Literal["a1", "a2", "a3", "a4", "a5", "a6", "a7", "a8"]
    # Values of the bound, in its unit, ascending.
    values: list[float]


class DomainTrajectory(TypedDict):
    """The trajectory in one domain, at equidistant nodes. Lists *at each node* have one row for each entry of
    `time_s`.
    """

    # For each output, the 6 Bezier coefficients of its curve over the phase, rad.
    bezier: list[list[float]]
    # Ground reaction forces at each node, in the order of `contact_rows`, N.
    contact_forces: list[list[float]]
    # Names of the components of the ground reaction forces.
    contact_rows: list[ContactRowName]
    # Duration, s.
    duration_s: float
    # Impulse of the impact at the start of the domain, in the order of `contact_rows`, N s. Null without an impact.
    impulse: Optional[list[float]]
    # States of the muscles. Null without muscles.
    muscles: Optional[MuscleTrajectory]
    # Name: DS2 and DS3 for double support, SS2 and SS1 for single support on the flat foot and on the toe, with _R or
    # _L for the stance leg.
    name: str
    # Coordinates that the virtual constraints drive, as indices into a row of `q`, counted from 0.
    outputs: list[int]
    # Hip position at the end of the domain, where the phase is 1, m.
    phase_end_m: float
    # Hip position at the start of the domain, where the phase is 0, m.
    phase_start_m: float
    # Coordinates at each node: 9 numbers, the hip position forwards and upwards (m), then torso, hip_L, knee_L,
    # ankle_L, hip_R, knee_R and ankle_R (rad).
    q: list[list[float]]
    # Velocities at each node, in the order of `q`, m/s and rad/s.
    qd: list[list[float]]
    # Accelerations at each node, in the order of `q`, m/s² and rad/s².
    qdd: list[list[float]]
    # Time of each node from the start of the stride, s.
    time_s: list[float]
    # Joint torques at each node: 6 numbers, hip_L, knee_L, ankle_L, hip_R, knee_R and ankle_R, N m.
    u: list[list[float]]


class EmgProcessing(TypedDict, total=False):
    """Settings of EMG processing."""

    # band_low_hz, band_high_hz, envelope_hz and order. Absent settings take their default values.
    settings: EmgSettings


class EmgReading(TypedDict, total=False):
    """How to read an EMG recording."""

    # Column of each channel (RF_L, TA_L, BF_L, GAS_L, RF_R, BF_R). By default the columns have the names of the
    # channels.
    channels: dict[str, str]
    # Name of the file, as it is shown.
    file_name: Optional[str]
    # File format.
    format: MeasurementFormat
    # Column of a switch under the right heel, or of the vertical force under the right foot.
    heel_strike_column: Optional[str]
    # Value of the columns of heel strikes, in their unit, above which a foot is on the ground.
    heel_strike_threshold: float
    # Times of right heel strikes, s, on the time axis of the file. If empty, they are detected in `heel_strike_column`.
    heel_strikes_s: list[float]
    # Column of a switch under the left heel, or of the vertical force under the left foot.
    left_heel_strike_column: Optional[str]
    # Times of left heel strikes, s. The cycle of the left leg begins with them. If neither these times nor
    # `left_heel_strike_column` are given, the left foot is taken to strike half a stride after the right one.
    left_heel_strikes_s: list[float]
    # Sampling rate of a CSV file without a `time_s` column, Hz.
    rate_hz: Optional[float]
    # Numbers of the strides to leave out, counted from 1 in the order of the right heel strikes. Strides of the left
    # leg that overlap with them are left out too.
    rejected_strides: list[int]


class EmgResult(TypedDict):
    """Processed EMG recordings of a session."""

    # Settings of the filters.
    settings: EmgSettings
    # Walks with an EMG recording.
    walks: list[WalkActivity]


class _EmgRmseRequired(TypedDict):
    # RMS difference of each channel, in the order of the channels of the walk without the device.
    parts: list[float]
    # Sum of the parts.
    total: float


class EmgRmse(_EmgRmseRequired, total=False):
    """EMG RMSE of a walk, in total and for each channel, relative to the peak of the walk without the device."""

    # Reasons to doubt the comparison. Absent if there are none.
    warnings: list[str]


class EmgSettings(TypedDict, total=False):
    """Filters for EMG recordings. Absent settings take their default values."""

    # Upper cut-off frequency of the band-pass filter, Hz; below half the sampling rate.
    band_high_hz: float
    # Lower cut-off frequency of the band-pass filter, Hz.
    band_low_hz: float
    # Cut-off frequency of the low-pass filter for the envelope, Hz.
    envelope_hz: float
    # Order of both filters: 2, 4, 6 or 8.
    order: Literal[2, 4, 6, 8]


class ExecutionReport(TypedDict):
    """Simulated walks with a gait, by a model other than the optimiser's."""

    # Range from which the body masses of disturbed simulated walks are drawn, kg: ±5 %, limited to the range of the
    # model.
    body_mass_kg: list[float]
    # Version of this layout and of the simulation.
    format_version: int
    # SHA-256 of the gait as compact JSON, as in its certificate.
    gait_sha256: str
    # Randomly disturbed simulated walks, for each kind of ground.
    grounds: list[SimulatedWalksOnGround]
    # Largest pushes survived. Null if the walker does not complete the undisturbed walk.
    pushes: Optional[SurvivedPushes]
    # Seed of the disturbances.
    seed: int
    # Strides of a complete simulated walk.
    strides: int
    # Undisturbed simulated walks on level ground, ordered from hard ground to soft ground. In all others the ground
    # yields 0.01 m under body weight.
    strides_by_yield: list[StridesOnYield]
    # Completed strides without any disturbance.
    undisturbed_strides: int


class FixedPointDistance(TypedDict):
    """Largest differences between the gait's initial state and the fixed point of the closed loop."""

    # In an angle, rad.
    angle_rad: float
    # In an angular velocity, rad/s.
    angular_velocity_rad_s: float
    # In the height of the hip, m.
    height_m: float
    # In a velocity of the hip, m/s.
    velocity_m_s: float


class FloquetMultiplier(TypedDict):
    """A Floquet multiplier: an eigenvalue of the linearised stride-to-stride map."""

    # Imaginary part.
    imaginary: float
    # Real part.
    real: float


class GaitDocument(TypedDict):
    """A gait: eight domains over one stride from right heel strike. R is the prosthesis, L the intact leg."""

    # The values of the bounds that can be tuned.
    bounds: Bounds
    # The device.
    device: DeviceDefinition
    # The domains in the order DS2_R, DS3_R, SS2_R, SS1_R, DS2_L, DS3_L, SS2_L, SS1_L.
    domains: list[DomainTrajectory]
    # Version of this layout.
    format_version: int
    # Set points of the hip velocity, m/s: one for each sequence of domains without impact, DS2_R; DS3_R and SS2_R;
    # DS2_L; DS3_L and SS2_L.
    hip_velocity_m_s: list[float]
    # Whether the gait has muscles.
    muscles: bool
    # Length of the step that ends with left heel strike, m.
    right_step_length_m: float
    # The other settings of the gait problem.
    settings: GaitSettings
    # Mean walking speed, m/s.
    speed_m_s: float
    # Stride length, m.
    stride_length_m: float
    # Stride time, s.
    stride_time_s: float
    # The subject.
    subject: WalkerSubject


class GaitMotion(TypedDict):
    """Motion of a gait over one stride from right heel strike."""

    # Nodes in order of time. Interpolate linearly between them.
    frames: list[MotionFrame]
    # Stride length, m.
    stride_length_m: float
    # Stride time, s.
    stride_time_s: float


class GaitProblem(TypedDict):
    """The definition of a gait problem."""

    # The values of the bounds that can be tuned.
    bounds: Bounds
    # The device.
    device: DeviceDefinition
    # Whether the problem has muscles.
    muscles: bool
    # The reference gait, for Gait RMSE and for initial guesses.
    reference: ReferenceGaitDocument
    # The other settings of the problem.
    settings: GaitSettings
    # The subject.
    subject: WalkerSubject


class GaitSettingsLimitsDurationMaxS(TypedDict):
    """Maximum duration of each kind of domain, s."""

    # Maximum duration of DS2, s.
    ds2: float
    # Maximum duration of DS3, s.
    ds3: float
    # Maximum duration of SS1, s.
    ss1: float
    # Maximum duration of SS2, s.
    ss2: float


class GaitSettingsLimitsDurationMinS(TypedDict):
    """Minimum duration of each kind of domain, s."""

    # Minimum duration of DS2, s.
    ds2: float
    # Minimum duration of DS3, s.
    ds3: float
    # Minimum duration of SS1, s.
    ss1: float
    # Minimum duration of SS2, s.
    ss2: float


class GaitSettingsLimits(TypedDict, total=False):
    """Limits of a gait besides the tuned bounds."""

    # Maximum human dorsiflexion torque, N m.
    ankle_dorsiflexion_torque_n_m: float
    # Maximum human plantarflexion torque, N m.
    ankle_plantarflexion_torque_n_m: float
    # Minimum clearance of the swing foot at mid-swing, m. It applies if a5 is smaller.
    clearance_min_m: float
    # Maximum of each component of a contact force, N.
    contact_force_max_n: float
    # Maximum duration of each kind of domain, s.
    duration_max_s: GaitSettingsLimitsDurationMaxS
    # Minimum duration of each kind of domain, s.
    duration_min_s: GaitSettingsLimitsDurationMinS
    # Maximum fibre length, in optimal fibre lengths.
    fibre_length_max: float
    # Minimum fibre length, in optimal fibre lengths.
    fibre_length_min: float
    # Friction coefficient of the feet.
    friction: float
    # Minimum downward velocity of the heel at heel strike, m/s.
    heel_touchdown_m_s: float
    # Anatomical limit of both hip angles in addition to a7, rad.
    hip_max_rad: float
    # Maximum human hip torque, N m.
    hip_torque_n_m: float
    # Friction coefficient of the impulse at heel strike.
    impact_friction: float
    # Maximum of each component of an impulse, N s.
    impulse_max_n_s: float
    # Maximum knee flexion, rad.
    knee_max_rad: float
    # Minimum knee flexion, rad. It excludes the straight knee, which is singular.
    knee_min_rad: float
    # Maximum human knee torque, N m.
    knee_torque_n_m: float
    # Minimum normal force at the start of a domain that ends by unloading, N. It decreases linearly to 0.
    liftoff_force_n: float
    # Minimum forward hip velocity in SS1, m/s. It makes the phase monotonic.
    phase_rate_min_m_s: float
    # Maximum walking speed, m/s.
    speed_max_m_s: float
    # Minimum walking speed, m/s.
    speed_min_m_s: float
    # Maximum length of each step, m.
    step_max_m: float
    # Minimum length of each step, m.
    step_min_m: float
    # Minimum downward velocity of the toe at toe strike, m/s.
    toe_touchdown_m_s: float
    # Minimum half-width of the range of torso lean, rad. It applies if a6 is smaller.
    torso_tolerance_rad: float


class GaitSettingsMesh(TypedDict, total=False):
    """Number of mesh intervals of each kind of domain."""

    # Intervals of DS2, double support on the stance heel and the trailing toe.
    ds2: int
    # Intervals of DS3, double support on the flat stance foot and the trailing toe.
    ds3: int
    # Intervals of SS1, single support on the stance toe.
    ss1: int
    # Intervals of SS2, single support on the flat stance foot.
    ss2: int


class GaitSettingsNaturalness(TypedDict, total=False):
    """Naturalness terms, which the paper does not have."""

    # Weight of the squared distance from the joint angles of the reference gait, relative to the cost of transport. 0
    # disables the term.
    reference_weight: float
    # Minimum share of the weight of the walker on the trailing foot at heel strike of the other foot. It decreases
    # linearly to 0 at toe-off. 0 disables the term.
    trailing_load_share: float


class GaitSettingsRegularisation(TypedDict, total=False):
    """Regularisation of the objective. Each weight multiplies the time integral of a square."""

    # Weight of accelerations, relative to 30 m/s² and 30 rad/s².
    acceleration: float
    # Weight of muscle activations.
    activation: float
    # Weight of the second differences of muscle activations over adjacent nodes of a domain.
    activation_bend: float
    # Weight of contact forces, relative to 500 N.
    contact_force: float
    # Weight of fibre velocities, relative to the maximum velocity of each muscle.
    fibre_velocity: float
    # Smoothing of the magnitudes of joint powers, W: with the smoothing e, |P| becomes sqrt(P² + e²) - e.
    power_smoothing_w: float
    # Weight of torques, relative to 100 N m.
    torque: float


class GaitSettings(TypedDict, total=False):
    """Settings of the gait problem."""

    # Limits of a gait besides the tuned bounds.
    limits: GaitSettingsLimits
    # Number of mesh intervals of each kind of domain.
    mesh: GaitSettingsMesh
    # Muscle values of the subject that differ from the default values.
    muscles: MuscleParameters
    # Naturalness terms, which the paper does not have.
    naturalness: GaitSettingsNaturalness
    # Regularisation of the objective. Each weight multiplies the time integral of a square.
    regularisation: GaitSettingsRegularisation


class GridStep(TypedDict):
    """One step of a bound in the search space, and the first-order changes in the results."""

    # Change in the mechanical cost of transport.
    cost_of_transport: float
    # Change in Gait RMSE, rad.
    gait_rmse_rad: float
    # Whether the same constraints stay active up to this value, to first order.
    keeps_active: bool
    # The next stricter value of the search space, in the unit of the bound, or the next looser one if the bound is
    # already at its strictest value.
    to: float


class Health(TypedDict):
    """Health of the service."""

    # `healthy`, or `short_of_space` if free disk space is below the reserve.
    status: str
    # Version of the program.
    version: str


class HistoryEntry(TypedDict):
    """The recommendation after one iteration of the study."""

    # Cost of transport of the best trial. Null if the script that evaluated the trial did not report it.
    cost_of_transport: Optional[float]
    # Gait RMSE of the best trial, rad. Null if the script that evaluated the trial did not report it.
    gait_rmse_rad: Optional[float]
    # Number of results so far, from 1.
    iteration: int
    # Number of the best trial.
    number: int
    # Best trial after this iteration of the study.
    trial_id: TrialId


class Import(TypedDict):
    """Import of a study."""

    # Actor of the import.
    actor: str
    # SHA-256 of the archive.
    file_sha256: str
    # Time of the import.
    imported_at: Instant
    # Public key of the signer. Null for an unsigned archive.
    signed_by: Optional[str]
    # Whether the import required a signature by that key.
    trusted: bool
    # Number of trials whose Gait RMSE could not be checked, because the archive does not have their gaits.
    unchecked_rmse: int


class Iteration(TypedDict):
    """One iteration of a solve."""

    # Barrier parameter.
    barrier: float
    # Largest violation of a scaled constraint.
    constraint_violation: float
    # Largest entry of the dual infeasibility.
    dual_infeasibility: float
    # Number of the initial guess to which this iteration belongs.
    guess: int
    # Number of the iteration over all phases.
    iteration: int
    # Objective of the phase.
    objective: float
    # Phase of the solve: `tracking` and `muscle_tracking`, tracking of the reference gait without and with muscles;
    # `plain_cost`, minimisation of the cost of transport without muscles, which precedes the one with muscles; `cost`,
    # minimisation of the cost of transport; `inter_node`, minimisation with tightened bounds.
    phase: str
    # Primal step length.
    step: float


class Job(TypedDict):
    """Background work of the service."""

    # Identifier.
    id: str
    # Kind of the job.
    kind: JobKind
    # Share of the work that is done, 0 to 1. Known only while walks are simulated; null otherwise.
    progress: Optional[float]
    # Reason if it failed. Null otherwise.
    reason: Optional[str]
    # URL of the result. Null until the job is done.
    result: Optional[str]
    # Attempts and worker of an open solve. Null otherwise.
    solve: Optional[OpenSolve]
    # State of the job.
    state: JobState
    # Study of the trial. Null for a backup.
    study_id: Optional[StudyId]
    # Trial of the job. Null for a backup.
    trial_id: Optional[TrialId]


class JointAngleReading(TypedDict, total=False):
    """How to read a file with joint angles."""

    # Column of each angle of a file whose columns have other names or signs. Then the first column is the time, s,
    # under any name; a CSV file needs `unit`; and hip angles are relative to the torso. If empty, the columns have the
    # names of the format.
    columns: dict[str, ChosenColumn]
    # Cut-off frequency of the low-pass filter before differentiation, Hz.
    cutoff_hz: float
    # Name of the file, as it is shown.
    file_name: Optional[str]
    # File format. A CSV file has `time_s` and any of torso_rad, hip_L_rad, knee_L_rad, ankle_L_rad, hip_R_rad,
    # knee_R_rad, ankle_R_rad.
    format: MeasurementFormat
    # Unit of angles, if the header of an OpenSim file does not state it.
    unit: Optional[Unit]


class JointRelaxation(TypedDict):
    """Effect of relaxing several tuned bounds together, each by the same fraction of the way to its loosest value.
    Computed if no single relaxation gives a gait.
    """

    # The bounds, one from each conflict.
    bounds: list[RelaxedBound]
    # Number of solves.
    solves: int
    # Number of starting points of the search at the `not_with` values.
    starts: int
    # Whether a solve at the `not_with` values ended without a decision. If so, infeasibility is not certain.
    undecided: bool


class LabAnswer(TypedDict):
    """The subject's answer, in terms of walks."""

    # Actor who recorded it.
    actor: str
    # The answer. First is walk 2, second is walk 3.
    answer: OrderedAnswer
    # Whether the person who recorded the answer could have known the allocation: it was recorded after unblinding, or
    # by a user who had fetched a controller file.
    could_have_known: bool
    # Time of recording.
    created_at: Instant
    # Free text.
    note: str
    # Number of the answer, from 1. It increases by one when an answer is retracted.
    number: int


class LabSession(TypedDict):
    """Lab session, without blinded data."""

    # Whether the allocation is in this record. It is missing if the study was exported while the session was blinded,
    # and then imported.
    allocation_included: bool
    # Current answer of the subject. Null if there is none.
    answer: Optional[LabAnswer]
    # Actor and time of the closing. Null while the session is open.
    closed: Optional[LabSessionStep]
    # Downloads of the controller files of the walks.
    controller_files: list[ControllerFileDownload]
    # Time of planning.
    created_at: Instant
    # Identifier.
    id: LabSessionId
    # Free text.
    notes: str
    # Number of the session in this study, from 1.
    number: int
    # Actor who planned the session.
    planned_by: str
    # State of the session.
    state: LabSessionState
    # Identifier of the study.
    study_id: StudyId
    # The trial with gait A. Does not imply the order of the walks.
    trial_a: TrialId
    # The trial with gait B.
    trial_b: TrialId
    # Actor, time and reason of the unblinding. Null while the session is blinded.
    unblinded: Optional[LabSessionStep]
    # The three walks.
    walks: list[WalkView]


class LabSessionClosing(TypedDict, total=False):
    """Request to close a lab session."""

    # Note, at most 2000 characters.
    note: str


class LabSessionProgress(TypedDict):
    """Session as shown in the lab, without anything that reveals a gait."""

    # Current answer of the subject. Null if there is none.
    answer: Optional[LabAnswer]
    # Number to send with the answer. Null before the last walk and after an answer.
    answer_number: Optional[int]
    # Whether the current answer can be retracted: the session is neither closed nor unblinded, and the answer is not a
    # safety report.
    can_be_retracted: bool
    # Whether the session is closed.
    closed: bool
    # Identifier of the session.
    lab_session_id: LabSessionId
    # Time at which the last walk was recorded. Null before the first walk.
    last_recorded: Optional[Instant]
    # Number to send with a report of an unsafe walk. Null until the subject may have walked with the device.
    report_number: Optional[int]
    # Next walk, 1 to 3. Null after the last walk and in a closed session.
    walk: Optional[int]
    # Number of walks.
    walks: int


class LabSessionStep(TypedDict):
    """Completed step of a session."""

    # Actor of the step.
    actor: str
    # Time of the step.
    created_at: Instant
    # Reason or note.
    note: str


class LabSessionUnblinding(TypedDict):
    """Request to unblind a lab session."""

    # Reason, 1 to 2000 characters.
    reason: str


class LearnerSettings(TypedDict, total=False):
    """Settings of the learner."""

    # Region of avoidance (ROIAL): an action is not proposed if its mean plus this many standard deviations is below the
    # threshold of labels, unless no other action is left. ROIAL uses -0.45. Null disables the region.
    avoidance: Optional[float]
    # If `partner` is `previous`: number of actions before a batch with which each action of the batch is compared.
    buffer: int
    # Noise scale of suggestions, in units of utility.
    coactive_noise: float
    # Method of approximate inference: `laplace`, a normal distribution at the mode of the posterior;
    # `expectation_propagation`, which needs the link `probit`.
    inference: Literal["laplace", "expectation_propagation"]
    # What labels are evidence of: `in_utility`, the utility, as in the literature; `separate`, the feasibility of
    # actions, modelled by a second Gaussian process.
    labels: Literal["in_utility", "separate"]
    # Factor on the lengthscale of every dimension.
    lengthscale_factor: float
    # Number of trials after which `eubo` searches the whole search space instead of lines. Null: it always searches
    # lines.
    line_trials: Optional[int]
    # Number of random lines through the best action that `eubo` searches. With 0, it searches the whole search space.
    lines: int
    # Distribution of the noise: `logistic`, or `probit` for the normal distribution.
    link: Literal["logistic", "probit"]
    # How the next action is chosen: `linecospar`, the best action of a posterior sample on a random line through the
    # best action; `eubo`, the action whose comparison with the best one is expected to be most useful; `thompson`, the
    # best action of a posterior sample over the whole search space; `information_gain`, the action whose feedback is
    # expected to tell the most about the utility; `random`, a random action that has not been tried.
    method: Literal["linecospar", "eubo", "thompson", "information_gain", "random"]
    # Noise scale of answers that state no difference, in units of utility.
    no_difference_noise: float
    # Difference in utility below which two gaits feel equal.
    no_difference_width: float
    # Variance added to the diagonal of the prior covariance, called *GP noise* in the literature.
    nugget: float
    # Noise scale of labels, in units of utility.
    ordinal_noise: float
    # Threshold between the labels *not converged* and *converged*, in units of utility.
    ordinal_thresholds: list[float]
    # Earlier actions with which a new one is compared: `previous`, the other actions of its batch and the last `buffer`
    # actions before the batch; `incumbent`, the best one; `every`, all of them.
    partner: Literal["previous", "incumbent", "every"]
    # Noise scale of preferences, in units of utility.
    preference_noise: float
    # Whether `linecospar` may propose an action that has already been tried.
    repeats: bool
    # Number of actions in a batch.
    samples_per_iteration: int
    # Prior variance of the utility.
    signal_variance: float
    # First action of a study: `random`, a random one; `centre`, the middle value of every dimension.
    start: Literal["random", "centre"]


class LegPoints(TypedDict):
    """Points of one leg as forward and upward coordinates, m."""

    # Ankle.
    ankle: list[float]
    # Heel.
    heel: list[float]
    # Knee.
    knee: list[float]
    # Toe.
    toe: list[float]


class LimitCycle(TypedDict):
    """Angle and velocity of a joint, sample by sample."""

    # Angle, rad.
    angle_rad: list[float]
    # Name of the joint.
    joint: str
    # Velocity, rad/s.
    velocity_rad_s: list[float]


class LimitCycles(TypedDict):
    """Limit cycles of a walk."""

    # Cut-off frequency of the zero-phase low-pass filter before central differences, Hz.
    cutoff_hz: float
    # Angle (rad) and velocity (rad/s) of each recorded joint, sample by sample.
    joints: list[LimitCycle]
    # Measurement file of the walk.
    measurement_file_id: MeasurementFileId
    # Number of the walk, 1 to 3.
    walk: int


class LinearAlgebra(TypedDict):
    """Operations and times of the linear algebra of a solve."""

    # Number of numerical factorisations.
    factorisations: int
    # Number of factorisations that failed and were replaced by a fallback method.
    fallbacks: int
    # Time for analysing the structure of matrices, s.
    seconds_analysis: float
    # Time for assembling and factorising matrices, s.
    seconds_factorisation: float
    # Time for substitutions, residuals and refinement, s.
    seconds_solves: float
    # Number of forward and backward substitutions.
    substitutions: int


class LocalOptimum(TypedDict):
    """A local optimum that the cold start of a trial reached."""

    # Gait RMSE against the reference gait of the study, rad.
    gait_rmse_rad: float
    # Whether its gait is the result of the trial.
    is_result: bool
    # Its number, from 1, in the order in which the initial guesses reached them.
    number: int
    # Objective.
    objective: float
    # Walking speed, m/s.
    speed_m_s: float
    # Stride length, m.
    stride_length_m: float


class MeasurementFile(TypedDict):
    """Measurement file, without its content."""

    # Actor of the upload.
    actor: str
    # Time of the upload.
    created_at: Instant
    # Name of the file. Null if unknown.
    file_name: Optional[str]
    # Identifier.
    id: MeasurementFileId
    # Kind of measurement.
    kind: MeasurementKind
    # Identifier of the lab session.
    lab_session_id: LabSessionId
    # SHA-256 of the file.
    raw_sha256: str
    # Number of the walk, 1 to 3.
    walk: int


class Member(TypedDict):
    """Member of a study."""

    # Actor who added the member.
    added_by: str
    # Time at which the member was added.
    created_at: Instant
    # Identifier of the membership.
    id: MemberId
    # Whether it is a user or a token.
    kind: MemberKind
    # Name of the user or the token.
    name: str
    # Role of a user. Null for a token.
    role: Optional[Role]
    # Identifier of the study.
    study_id: StudyId


class MeshIntervals(TypedDict):
    """Number of mesh intervals of each kind of domain."""

    # Intervals of DS2.
    ds2: int
    # Intervals of DS3.
    ds3: int
    # Intervals of SS1.
    ss1: int
    # Intervals of SS2.
    ss2: int


class ModelActivity(TypedDict):
    """The activation of the muscle of a channel over the gait cycle."""

    # Activation at 0, 1, ..., 100 % of the cycle, 0 to 1.
    activation: list[float]
    # Name of the channel.
    channel: str
    # Correlation between activation and measured activity over the cycle; null if one of them is constant.
    correlation: Optional[float]
    # Name of the muscle.
    muscle: str
    # RMS difference between activation and measured activity.
    rms_difference: float


class StickFigure(TypedDict):
    """Points of the body at an instant as forward and upward coordinates, m."""

    # Hip.
    hip: list[float]
    # Left (intact) leg.
    left: LegPoints
    # Right (prosthetic) leg.
    right: LegPoints
    # Shoulder.
    shoulder: list[float]
    # Time from the start of the stride, s.
    time_s: float


class _MotionFrameRequired(StickFigure):
    # Name of the domain.
    domain: str
    # Ground forces on left heel, left toe, right heel and right toe, forward and up, N.
    forces_n: list[list[float]]


class MotionFrame(_MotionFrameRequired, total=False):
    """Node of a motion."""

    # Activations of the muscles HAM_L, GLU_L, HFL_L, GAS_L, VAS_L, SOL_L, TA_L, HAM_R, GLU_R, HFL_R. Absent without
    # muscles.
    activations: list[float]


class MuscleParametersGas(TypedDict, total=False):
    """Gastrocnemius."""

    # Largest moment arm at the ankle, m.
    ankle_lever_m: Optional[float]
    # Largest moment arm at the knee, m.
    knee_lever_m: Optional[float]
    # Maximum isometric force, N.
    max_force_n: Optional[float]
    # Maximum shortening speed, optimal fibre lengths per second.
    max_speed: Optional[float]
    # Optimal fibre length, m.
    optimal_length_m: Optional[float]
    # Tendon slack length, m.
    slack_length_m: Optional[float]


class MuscleParametersGlu(TypedDict, total=False):
    """Gluteus."""

    # Largest moment arm at the hip, m.
    hip_lever_m: Optional[float]
    # Maximum isometric force, N.
    max_force_n: Optional[float]
    # Maximum shortening speed, optimal fibre lengths per second.
    max_speed: Optional[float]
    # Optimal fibre length, m.
    optimal_length_m: Optional[float]
    # Tendon slack length, m.
    slack_length_m: Optional[float]


class MuscleParametersHam(TypedDict, total=False):
    """Hamstrings."""

    # Largest moment arm at the hip, m.
    hip_lever_m: Optional[float]
    # Largest moment arm at the knee, m.
    knee_lever_m: Optional[float]
    # Maximum isometric force, N.
    max_force_n: Optional[float]
    # Maximum shortening speed, optimal fibre lengths per second.
    max_speed: Optional[float]
    # Optimal fibre length, m.
    optimal_length_m: Optional[float]
    # Tendon slack length, m.
    slack_length_m: Optional[float]


class MuscleParametersHfl(TypedDict, total=False):
    """Hip flexors."""

    # Largest moment arm at the hip, m.
    hip_lever_m: Optional[float]
    # Maximum isometric force, N.
    max_force_n: Optional[float]
    # Maximum shortening speed, optimal fibre lengths per second.
    max_speed: Optional[float]
    # Optimal fibre length, m.
    optimal_length_m: Optional[float]
    # Tendon slack length, m.
    slack_length_m: Optional[float]


class MuscleParametersSol(TypedDict, total=False):
    """Soleus."""

    # Largest moment arm at the ankle, m.
    ankle_lever_m: Optional[float]
    # Maximum isometric force, N.
    max_force_n: Optional[float]
    # Maximum shortening speed, optimal fibre lengths per second.
    max_speed: Optional[float]
    # Optimal fibre length, m.
    optimal_length_m: Optional[float]
    # Tendon slack length, m.
    slack_length_m: Optional[float]


class MuscleParametersTa(TypedDict, total=False):
    """Tibialis anterior."""

    # Largest moment arm at the ankle, m.
    ankle_lever_m: Optional[float]
    # Maximum isometric force, N.
    max_force_n: Optional[float]
    # Maximum shortening speed, optimal fibre lengths per second.
    max_speed: Optional[float]
    # Optimal fibre length, m.
    optimal_length_m: Optional[float]
    # Tendon slack length, m.
    slack_length_m: Optional[float]


class MuscleParametersVas(TypedDict, total=False):
    """Vasti."""

    # Largest moment arm at the knee, m.
    knee_lever_m: Optional[float]
    # Maximum isometric force, N.
    max_force_n: Optional[float]
    # Maximum shortening speed, optimal fibre lengths per second.
    max_speed: Optional[float]
    # Optimal fibre length, m.
    optimal_length_m: Optional[float]
    # Tendon slack length, m.
    slack_length_m: Optional[float]


class MuscleParameters(TypedDict, total=False):
    """Muscle values that differ from the default ones."""

    # Gastrocnemius.
    gas: MuscleParametersGas
    # Gluteus.
    glu: MuscleParametersGlu
    # Hamstrings.
    ham: MuscleParametersHam
    # Hip flexors.
    hfl: MuscleParametersHfl
    # Whether lengths and moment arms scale with body height, and forces with body mass, from the 1.8 m and 80 kg of the
    # published table. Given values are not scaled.
    scaled_to_body: bool
    # Soleus.
    sol: MuscleParametersSol
    # Tibialis anterior.
    ta: MuscleParametersTa
    # Vasti.
    vas: MuscleParametersVas


class MuscleTrajectory(TypedDict):
    """States of the ten muscle-tendon units at each node. A row has 10 numbers, for HAM_L, GLU_L, HFL_L, GAS_L, VAS_L,
    SOL_L, TA_L, HAM_R, GLU_R and HFL_R.
    """

    # Activations, 0 to 1.
    activation: list[list[float]]
    # Fibre lengths, in optimal fibre lengths.
    fibre_length: list[list[float]]
    # Fibre velocities, in optimal fibre lengths per second; negative in shortening.
    fibre_velocity: list[list[float]]


class _NewAssessmentRequired(TypedDict):
    # The answer. To state which gait is better, record a preference instead.
    answer: AssessmentAnswer
    # The trial with gait A.
    trial_a: TrialId
    # The trial with gait B.
    trial_b: TrialId


class NewAssessment(_NewAssessmentRequired, total=False):
    """An assessment to record."""

    # Name or pseudonym of the author. Defaults to the caller's name.
    author: Optional[str]
    # Free text.
    note: str
    # Identifier of the preference or assessment that this assessment replaces: a person's answer about the same two
    # trials, which then no longer counts. If this assessment is undone, the replaced one counts again.
    replaces: Optional[AnswerId]
    # Source of the answer: `subject`, `clinician` or `script`. By default `script` for a token, `subject` for a rater,
    # and `clinician` for any other user.
    source: Optional[AnswerGiver]


class NewConsent(TypedDict):
    """A consent that a subject signed."""

    # Name and version of the consent form.
    form: str


class NewCorrection(TypedDict):
    """A correction of height and mass."""

    # Body mass, kg.
    body_mass_kg: float
    # Body height, m.
    height_m: float
    # Reason for the correction.
    reason: str


class _NewEmgRequired(TypedDict):
    # Content of the file.
    recording: str
    # Number of the walk.
    walk: int


class NewEmg(_NewEmgRequired, total=False):
    """EMG recording of a walk."""

    # How to read the file.
    reading: EmgReading


class NewExecutionReport(TypedDict, total=False):
    """A request to simulate walks. There are three kinds of ground: level, and uneven by ±5 mm or ±10 mm."""

    # Number of simulated walks on each kind of ground, 1 to 1000.
    number_of_simulated_walks: int
    # Seed of the disturbances. The same seed gives the same report.
    seed: int


class _NewJointAnglesRequired(TypedDict):
    # Content of the file.
    recording: str
    # Number of the walk.
    walk: int


class NewJointAngles(_NewJointAnglesRequired, total=False):
    """Joint angles of a walk."""

    # How to read the file.
    reading: JointAngleReading


class _NewLabAnswerRequired(TypedDict):
    # The answer. First is walk 2, second is walk 3.
    answer: Literal["first", "second", "no_difference", "cannot_tell", "unsafe_first", "unsafe_second", "unsafe_both"]
    # Number of the answer: `answer_number` or, for a report of an unsafe walk, `report_number` of the session. An
    # answer that is sent twice counts once.
    number: int


class NewLabAnswer(_NewLabAnswerRequired, total=False):
    """The subject's answer."""

    # Free text, at most 2000 characters.
    note: str


class _NewLabSessionRequired(TypedDict):
    # Trial with gait A, which must be walkable.
    trial_a: TrialId
    # Trial with gait B, which must be walkable.
    trial_b: TrialId


class NewLabSession(_NewLabSessionRequired, total=False):
    """Lab session to plan."""

    # Free text, at most 2000 characters.
    notes: str


class NewMember(TypedDict):
    """A user or token to add to a study."""

    # Whether it is a user or a token.
    kind: MemberKind
    # Name of an enabled user or a valid token.
    name: str


class _NewPreferenceRequired(TypedDict):
    # Which gait is better.
    answer: PairAnswer
    # The trial with gait A.
    trial_a: TrialId
    # The trial with gait B.
    trial_b: TrialId


class NewPreference(_NewPreferenceRequired, total=False):
    """A preference to record."""

    # Name or pseudonym of the author. Defaults to the caller's name.
    author: Optional[str]
    # Free text.
    note: str
    # Identifier of the preference or assessment that this answer replaces: a person's answer about the same two trials,
    # which then no longer counts. If this answer is undone, the replaced one counts again.
    replaces: Optional[AnswerId]
    # Source of the answer: `subject`, `clinician` or `script`. By default `script` for a token, `subject` for a rater,
    # and `clinician` for any other user.
    source: Optional[AnswerGiver]


class _NewReferenceGaitRequired(TypedDict):
    # Name shown to users.
    name: str
    # Content of the file.
    recording: str


class NewReferenceGait(_NewReferenceGaitRequired, total=False):
    """A recording that becomes a reference gait."""

    # Body mass of the measured person, kg.
    body_mass_kg: Optional[float]
    # Column of each angle of a file whose columns have other names or signs: of torso, left leg and right hip and, to
    # find heel strikes from joint angles, of the right knee. Then the first column is the time, s, under any name; a
    # CSV file needs `unit`; and hip angles are relative to the torso. If empty, the columns have the names of the
    # format.
    columns: dict[str, ChosenColumn]
    # Column of the vertical force under the right foot. With `forces`, defaults to `ground_force_vy`, or to
    # `Treadmill_R_vy` for Camargo 2021.
    force_column: Optional[str]
    # Content of a separate file with the force column: an OpenSim file, or the `fp` table that belongs to an `ik` table
    # of the Camargo 2021 data set. Both files must have the same time axis.
    forces: Optional[str]
    # File format of the recording.
    format: JointAngleFormat
    # Times of right heel strikes, s. If empty, they are detected.
    heel_strikes_s: list[float]
    # Height of the measured person, m.
    height_m: Optional[float]
    # How to find right heel strikes if `heel_strikes_s` is empty.
    strikes: Strikes
    # Unit of angles, if the header of an OpenSim file does not state it.
    unit: Optional[Unit]


class NewRole(TypedDict):
    """New role of a user."""

    # New role.
    role: Role


class NewSafetyReport(TypedDict, total=False):
    """A report that a gait is unsafe."""

    # Name or pseudonym of the author. Defaults to the caller's name.
    author: Optional[str]
    # Description of the event, at most 2000 characters.
    note: str
    # Source of the report: `subject`, `clinician` or `script`. By default `script` for a token, `subject` for a rater,
    # and `clinician` for any other user.
    source: Optional[AnswerGiver]


class _NewSafetyReviewRequired(TypedDict):
    # `cleared`: the gait is cleared for walking. `unsafe`: the gait remains marked as unsafe, and the review is
    # complete.
    decision: SafetyDecision
    # Reason, 1 to 2000 characters.
    reason: str


class NewSafetyReview(_NewSafetyReviewRequired, total=False):
    """A decision about the safety reports of a gait."""

    # Name or pseudonym of the reviewer. Defaults to the caller's name.
    author: Optional[str]
    # The safety reports in force that the reviewer has seen. The decision is refused if a report in force is not
    # listed. By default, all of them count as seen.
    reports: Optional[list[SafetyReportId]]


class _NewStudyRequired(TypedDict):
    # Identifier of the subject.
    subject_id: SubjectId


class NewStudy(_NewStudyRequired, total=False):
    """A study to create. Every field except the subject has a default."""

    # Source of the answers.
    answer_source: AnswerSource
    # Role of the study with an atlas. Anything but `none` needs `root` as `warm_start_from`.
    atlas: AtlasRole
    # Values of the bounds that are not tuned.
    base_bounds: BaseBounds
    # Identifier of the device. The built-in one by default.
    device_id: Optional[DeviceId]
    # Evaluation of the trials, by the service or by lab scripts.
    evaluation: Evaluation
    # Settings of the gait problem. If they contain no `muscles`, the measured muscle values of the subject apply.
    gait_settings: GaitSettings
    # Settings of the learner. Settings that are absent take the values recommended for the chosen `method`.
    learner: LearnerSettings
    # Whether the muscles are part of the gait problem (constraints C1 to C12 of the published method) or not (C1 to
    # C4).
    muscles: bool
    # Name shown to users, which must differ from the names of all studies that you can see. By default, it is made from
    # subject, variant and seed.
    name: Optional[str]
    # Number of trials.
    number_of_trials: int
    # Number of trials that run in parallel.
    parallel_trials: int
    # Priority, -10 to 10. Studies with a higher priority run first.
    priority: int
    # Reference gait for Gait RMSE. By default `falisse-2019`, even if others have been imported.
    reference_gait_id: Optional[ReferenceGaitId]
    # Whether a trial may repeat an action whose gait another trial has already found, as in the published method.
    # Defaults to the `repeats` setting of the learner. Has no effect if scripts evaluate the trials.
    repeat_results: Optional[bool]
    # Whether only members and administrators can access the study. The creator becomes a member.
    restricted: bool
    # Tuned bounds and their values. Table I of the paper by default.
    search_space: Optional[SearchSpace]
    # Seed for all random draws except allocations.
    seed: int
    # Simulated walks with each gait. By default, the service simulates none.
    simulated_walks: SimulatedWalksSetting
    # Options of the solver: limits, tolerance, initial guesses and retries.
    solve_options: SolveOptions
    # Total solve time, s, after which no new trial starts.
    solve_seconds_budget: Optional[float]
    # Whether to start the study immediately.
    start: bool
    # The study finishes when the best action has not changed over this many results.
    unchanged_limit: Optional[int]
    # The gait from which trials are warm-started.
    warm_start_from: WarmStartFrom


class _NewSubjectRequired(TypedDict):
    # Body mass, kg.
    body_mass_kg: float
    # Body height, m.
    height_m: float
    # Pseudonym assigned by the site, never a name.
    pseudonym: str


class NewSubject(_NewSubjectRequired, total=False):
    """A subject to add."""

    # Free text.
    notes: str


class _NewSuggestionRequired(TypedDict):
    # Suggested values of tuned bounds, such as `{"a5": 0.026}`. Each must be a value of the search space. Other bounds
    # keep their values from the trial.
    bounds: dict[str, float]
    # Trial whose gait could be better.
    over: TrialId


class NewSuggestion(_NewSuggestionRequired, total=False):
    """Bounds with which a gait would have been better than that of a trial."""

    # Name or pseudonym of the author. Defaults to the caller's name.
    author: Optional[str]
    # Free text.
    note: str
    # Source of the answer: `subject`, `clinician` or `script`. By default `script` for a token, `subject` for a rater,
    # and `clinician` for any other user.
    source: Optional[AnswerGiver]


class _NewTokenRequired(TypedDict):
    # Purpose of the token, 1 to 80 characters.
    name: str
    # Scopes: at least one of `read`, `run`, `answer`, `rate`, `device`.
    scopes: list[Literal["read", "run", "answer", "rate", "device"]]


class NewToken(_NewTokenRequired, total=False):
    """A token to create."""

    # Validity in days. Unlimited if absent.
    days: Optional[int]


class NewUser(TypedDict):
    """A user to add."""

    # Name or code, 1 to 80 characters.
    name: str
    # Role of the user.
    role: Role


class NextBlindPair(TypedDict):
    """Next pair for a rater."""

    # The pair. Null if no comparison is pending.
    pair: Optional[BlindPair]


class OpenSolve(TypedDict):
    """A solve that has not ended."""

    # Number of times that it was given to a worker.
    attempts: int
    # Time of queueing.
    created_at: Instant
    # Attempts that crashed or ended with an error.
    failures: int
    # End of the lease, unless it is renewed. Null while the solve is queued.
    lease_until: Optional[Instant]
    # Attempts whose worker stopped responding.
    losses: int
    # Worker that has it. Null while it is queued.
    worker: Optional[str]


class Optimality(TypedDict):
    """First-order conditions of a local optimum."""

    # Last barrier parameter.
    barrier: float
    # Largest product of the distance to a limit and its multiplier.
    complementarity: float
    # Largest entry of the Lagrangian's gradient.
    dual_infeasibility: float


class PreferenceContentPreference(TypedDict):
    """One trial is better than another."""

    # Kind of preference.
    kind: Literal["preference"]
    # Worse trial.
    loser: TrialId
    # Better trial.
    winner: TrialId


class PreferenceContentNoDifference(TypedDict):
    """Two trials are equally good."""

    # One trial.
    a: TrialId
    # The other trial.
    b: TrialId
    # Kind of preference.
    kind: Literal["no_difference"]


class PrimalDualPoint(TypedDict):
    """A primal-dual point of the nonlinear program with n variables and m rows, scaled."""

    # n multipliers of the lower bounds of variables.
    lower_multipliers: list[float]
    # m multipliers of the rows.
    row_multipliers: list[float]
    # m multipliers of the lower bounds of slacks. If empty, they are derived from the multipliers of the rows.
    slack_lower_multipliers: list[float]
    # m multipliers of the upper bounds of slacks. If empty, they are derived from the multipliers of the rows.
    slack_upper_multipliers: list[float]
    # m slacks of the rows. If empty, the values of the rows are used.
    slacks: list[float]
    # n multipliers of the upper bounds of variables.
    upper_multipliers: list[float]
    # n variables.
    x: list[float]


class _ProblemRequired(TypedDict):
    # Explanation of the problem in this request.
    detail: str
    # The HTTP status.
    status: int
    # Name of this kind of problem.
    title: str
    # URI of the kind of error, which is also the address of a page that explains it. It does not change between
    # versions.
    type: str


class Problem(_ProblemRequired, total=False):
    """An error response (problem details, RFC 9457)."""

    # Values that are accepted.
    allowed: str
    # Name of the field that was refused.
    field: str
    # Identifier of the request, as in the `X-Request-Id` header and the log.
    request_id: str
    # Value that was given.
    value: Any


class ProcessedEmg(TypedDict):
    """Processed EMG of a session, with the model's muscle activity."""

    # Muscle activity of the model. Empty while the session is blinded, and for gaits without muscles.
    model: list[WalkModel]
    # Measured activity.
    result: EmgResult


class Proportion(TypedDict):
    """A proportion with its 95 % confidence interval (Wilson)."""

    # Number of successes.
    count: int
    # Upper bound of the interval.
    high: Optional[float]
    # Lower bound of the interval.
    low: Optional[float]
    # Number of cases.
    of: int
    # `count / of`.
    share: Optional[float]


class Pushes(TypedDict):
    """Largest changes in the hip's forward velocity from which the walker recovers, m/s."""

    # Backwards, m/s.
    backwards_m_s: float
    # Forwards, m/s.
    forwards_m_s: float


class _RaterAnswerRequired(TypedDict):
    # The answer.
    answer: Literal["first", "second", "no_difference", "cannot_tell", "unsafe_first", "unsafe_second", "unsafe_both"]


class RaterAnswer(_RaterAnswerRequired, total=False):
    """Answer of a rater."""

    # Free text, at most 2000 characters.
    note: str
    # Response time of the rater, ms.
    response_ms: Optional[int]


class RaterInvitation(TypedDict):
    """Rater to invite."""

    # Name or code of the rater, 1 to 80 characters. A new name adds a rater.
    name: str


class RaterReliability(TypedDict):
    """Reliability of a rater in a study."""

    # Number of answers.
    answered: int
    # Number of "cannot tell" answers.
    cannot_tell: int
    # Number of blind pairs in which the rater could have known the allocation. The shares exclude them.
    could_have_known: int
    # Share of blind preferences for the gait shown first. A value far from one half indicates position bias. Null until
    # the rater is unblinded, because it would reveal allocations.
    first_preferred: Optional[Proportion]
    # Name of the rater.
    rater: str
    # Share of repeated pairs with the same answer as before, among blind answers.
    repeats_agree: Proportion
    # Number of blind pairs.
    shown: int
    # Number of answers that reported a gait as unsafe.
    unsafe_gaits: int


class RaterUnblinding(TypedDict):
    """Rater to unblind, with the reason."""

    # Name of the rater.
    rater: str
    # Reason, 1 to 2000 characters.
    reason: str


class Recommended(TypedDict):
    """Recommended action."""

    # The action: the values of all bounds, tuned or fixed.
    bounds: Bounds
    # Cost of transport of the trial. Null if the script that evaluated the trial did not report it.
    cost_of_transport: Optional[float]
    # Gait RMSE of the trial, rad. Null if the script that evaluated the trial did not report it.
    gait_rmse_rad: Optional[float]
    # Mean strides of the simulated walks on which the result of the trial depends. Null if it depends on none.
    mean_strides: Optional[float]
    # Number of the trial.
    number: int
    # Trial of the action.
    trial_id: TrialId


class _RecommendationRequired(Recommended):
    # State of the certificate of its gait.
    certificate: CertificateState
    # Whether gaits of the study are being certified. If so, the recommendation may change.
    certifying: bool
    # Reasons if the certificate failed.
    failures: list[str]
    # Tuned bounds that have not been active in any gait of the study so far.
    never_active: list[str]
    # Name of the study.
    study: str
    # Identifier of the study.
    study_id: StudyId


class Recommendation(_RecommendationRequired, total=False):
    """Best action of a study."""

    # The newest execution report of its gait. Null if there is none.
    execution_report: Optional[ExecutionReport]
    # If the certificate failed, the best action whose gait passed certification. Null if there is none.
    passing: Optional[Recommended]


class _RecordedWalkRequired(TypedDict):
    # Number of the walk. Walks are recorded in order.
    walk: int


class RecordedWalk(_RecordedWalkRequired, total=False):
    """Walk to record."""

    # Free text, at most 2000 characters.
    note: str


class ReferenceGait(TypedDict):
    """Reference gait. Changing a definition creates a new reference gait, so that studies keep the one they use."""

    # Time of creation.
    created_at: Instant
    # Definition of the reference gait.
    definition: ReferenceGaitDocument
    # Identifier.
    id: ReferenceGaitId
    # Name shown to users.
    name: str


class _ReferenceGaitDocumentRequired(TypedDict):
    # 101 rows, at 0, 1, ..., 100 % of the gait cycle from right heel strike. Each row has the angles of torso, hip_L,
    # knee_L, ankle_L and hip_R in this order, rad.
    angles_rad: list[list[float]]
    # Name.
    name: str
    # Citation, licence and processing of the data.
    provenance: str


class ReferenceGaitDocument(_ReferenceGaitDocumentRequired, total=False):
    """A reference gait: joint angles over the gait cycle, and the measured person. Forward lean, hip flexion, knee
    flexion and ankle dorsiflexion are positive.
    """

    # Body mass of the measured person, kg. Absent if it is not known.
    body_mass_kg: float
    # Height of the measured person, m. Absent if it is not known.
    height_m: float
    # Standard deviations of the angles over strides, in the rows and columns of `angles_rad`, rad. Absent if they are
    # not known.
    standard_deviation_rad: list[list[float]]


class ReferenceGaitMatch(TypedDict):
    """A reference gait and the distance between the measured person and a subject."""

    # Distance to the reference gait, without a unit: `sqrt((dh / 0.10 m)^2 + (dm / 15 kg)^2)`, with the difference in
    # height dh and in body mass dm. Null if the reference gait does not state height and mass.
    distance: Optional[float]
    # The reference gait.
    reference_gait: ReferenceGait


Relaxation = TypedDict(
    "Relaxation",
    {
        # Name of the bound.
        "bound": "str",
        # Value of the bound in the problem.
        "from": "float",
        # Limited quantity and its unit.
        "meaning": "str",
        # The loosest value tried that does not give a gait.
        "not_with": "float",
        # Number of solves.
        "solves": "int",
        # Number of starting points of the search at the `not_with` value. 0 if unknown.
        "starts": "int",
        # The value nearest to the given one that was found to give a gait. Null if not even the loosest value does.
        "to": "Optional[float]",
        # Whether the solve at the `not_with` value ended without a decision. If so, infeasibility is not certain.
        "undecided": "bool",
    },
)


RelaxedBound = TypedDict(
    "RelaxedBound",
    {
        # Name of the bound.
        "bound": "str",
        # Value of the bound in the problem.
        "from": "float",
        # Limited quantity and its unit.
        "meaning": "str",
        # The loosest value that does not give a gait together with the others.
        "not_with": "float",
        # The value nearest to the given one that gives a gait together with the others. Null if not even the loosest value
        # does.
        "to": "Optional[float]",
    },
)


class RestoredAnswer(TypedDict):
    """The answer that counts again after an undo. Both fields are null if the undone answer replaced none."""

    # The new entry with the content of the replaced assessment.
    assessment: Optional[Assessment]
    # The new entry with the content of the replaced preference.
    preference: Optional[Preference]


class ResultDerivatives(TypedDict):
    """Derivatives of the results with respect to a tuned bound."""

    # Derivative of the mechanical cost of transport.
    cost_of_transport: float
    # Derivative of Gait RMSE, rad per unit of the bound.
    gait_rmse_rad: float
    # Derivatives of the largest angle over all nodes, rad per unit of the bound, for torso, hip_L, knee_L, ankle_L,
    # hip_R, knee_R and ankle_R in this order.
    largest_angles_rad: list[float]
    # Derivative of the objective.
    objective: float
    # Derivatives of the smallest angle over all nodes, in the order of the largest angles, rad per unit of the bound.
    smallest_angles_rad: list[float]
    # Derivative of the mean walking speed, m/s per unit of the bound.
    speed_m_s: float


class Retraction(TypedDict):
    """Retraction of an answer."""

    # Author of the retraction.
    author: str
    # Time of the retraction.
    created_at: Instant
    # Reason, never empty.
    reason: str


class ReturnMap(TypedDict):
    """Stability of a gait, from the stride-to-stride map."""

    # Resolution of the finite differences: the change of `largest_by_differences` by the last extrapolation.
    differences_resolve: float
    # Distance between the gait's initial state and the fixed point.
    fixed_point_distance: FixedPointDistance
    # The same for a stride from the nearby fixed point of the closed loop.
    fixed_point_residual: float
    # Largest change in a component of the state (m, rad, m/s or rad/s) over one stride that starts at the gait's
    # initial state.
    gait_residual: float
    # Largest modulus of the multipliers.
    largest: float
    # Largest modulus of the multipliers, from finite differences of simulated domains.
    largest_by_differences: float
    # Multipliers from variational equations and saltation matrices, largest first.
    multipliers: list[FloquetMultiplier]
    # Fraction of a proportional change of all velocities that remains after one stride.
    speed_kept: float
    # Change in other coordinates that a proportional change of all velocities causes within one stride, relative to its
    # size.
    speed_leak: float


class SafetyReport(TypedDict):
    """Safety report about a gait."""

    # Author of the report.
    author: str
    # Time of the report.
    created_at: Instant
    # Identifier of the report. A report from a blind pair, an assessment or a lab session has the identifier of that
    # object, so reports about both of its gaits share one identifier.
    id: SafetyReportId
    # Whether the report is in force: it awaits a review, or a review confirmed that the gait is unsafe. If so, the gait
    # must not be used for walking.
    in_force: bool
    # Text of the report. Empty for reports of raters and of subjects in blinded lab sessions, whose notes could tell
    # which gait was shown first.
    note: str
    # Newest review. Null while the report awaits review.
    review: Optional[SafetyReview]
    # Trial of the gait.
    trial_id: TrialId


class SafetyReview(TypedDict):
    """A decision about the safety reports of a gait."""

    # Name or pseudonym of the reviewer.
    author: str
    # Time of the review.
    created_at: Instant
    # Decision about the reports.
    decision: SafetyDecision
    # Identifier.
    id: SafetyReviewId
    # Reason for the decision.
    reason: str
    # The reports that the review covers. Another report about the same gait needs another review.
    reports: list[SafetyReportId]
    # Trial of the reviewed gait.
    trial_id: TrialId


class SearchSpace(TypedDict):
    """A grid of actions."""

    # One dimension for each tuned bound.
    dimensions: list[Dimension]


class SensitivityToBound(TypedDict):
    """Sensitivity with respect to one tuned bound. Derivatives are per unit of the bound."""

    # The active constraints that contain the bound. Empty if small changes of the bound change nothing.
    active: list[ActiveConstraint]
    # Name of the bound.
    bound: str
    # Derivatives of the results of the gait.
    derivatives: ResultDerivatives
    # One step of the bound in the search space, and its effect. Null if the study does not tune the bound.
    grid_step: Optional[GridStep]
    # Lowest and highest value of the bound, in its unit: in between, the active constraints stay the same, to first
    # order. An end is null if there is no limit in that direction.
    interval: list[Optional[float]]
    # Whether a constraint is about to become active or inactive, in which case the derivatives on the two sides differ.
    is_weakly_active: bool
    # Value of the bound, in its unit.
    value: float


class Session(TypedDict):
    """Sign-in session of a user."""

    # Client address at sign-in. Null if unknown.
    address: Optional[str]
    # User agent of the browser. Null if unknown.
    browser: Optional[str]
    # Whether the user signed in with a one-time link rather than a password.
    by_link: bool
    # Time of sign-in.
    created_at: Instant
    # Identifier. It is not the value of the session cookie.
    id: SessionId
    # Time of the last activity.
    seen_at: Instant
    # Identifier of the user.
    user_id: UserId
    # Name of the user.
    user_name: str


class SetPoints(TypedDict):
    """Set points of the prosthetic joints. All lists have one entry for each sample."""

    # Ankle angles, dorsiflexion positive, rad.
    ankle_rad: list[float]
    # Ankle velocities, rad/s; discontinuous at impacts.
    ankle_rad_s: list[float]
    # Feed-forward ankle torques, dorsiflexion positive, N m.
    ankle_torque_n_m: list[float]
    # Knee angles, flexion positive, rad.
    knee_rad: list[float]
    # Knee velocities, rad/s; discontinuous at impacts.
    knee_rad_s: list[float]
    # Feed-forward knee torques, flexion positive, N m.
    knee_torque_n_m: list[float]
    # Sampling rate, Hz.
    rate_hz: float
    # Time of each sample from right heel strike, s. The last sample is the end of the stride.
    time_s: list[float]


class SignInLink(TypedDict):
    """One-time sign-in link."""

    # Path of the link, which is shown once and valid for a day.
    path: str


class SimulatedWalksOnGround(TypedDict):
    """Simulated walks on one kind of ground."""

    # Share of the time in which the controller demanded a faster change of the ankle torque than the actuator can
    # produce.
    ankle_rate_limited_share: float
    # Share of the time in which the controller demanded more than the largest torque of the prosthetic ankle.
    ankle_saturated_share: float
    # Simulated walks that completed all strides.
    completed: int
    # Share of completed simulated walks.
    completed_share: float
    # 95 % confidence interval of this share (Wilson).
    completed_share_interval: list[float]
    # Simulated walks that ended with a fall.
    fell: int
    # Largest height of bumps and depth of dips in the ground, m.
    ground_height_m: float
    # Simulated walks that ended with a halt: the walker took no further step.
    halted: int
    # Share of the time in which the controller demanded a faster change of the knee torque than the actuator can
    # produce.
    knee_rate_limited_share: float
    # Share of the time in which the controller demanded more than the largest torque of the prosthetic knee.
    knee_saturated_share: float
    # Mean number of completed strides.
    mean_strides: float
    # Number of simulated walks.
    number_of_simulated_walks: int


class SimulatedWalksSetting(TypedDict, total=False):
    """Simulated walks with the gaits of a study. Their seed is that of the study, so that all gaits meet the same
    disturbances.
    """

    # Effect of the simulated walks on the study.
    effect: SimulatedWalksEffect
    # `tie_break`: difference in Gait RMSE, rad, below which two gaits are compared by their mean strides. 0 to 10.
    gait_rmse_tolerance_rad: float
    # `label`: minimum mean strides of an executable gait. A complete simulated walk has 20 strides. 0 to 20.
    least_mean_strides: float
    # Number of simulated walks on each of the three kinds of ground, 1 to 1000.
    number_of_simulated_walks: int


class SolveOptionsLocalOptimumChoiceNearestToReference(TypedDict):
    """Takes the local optimum with the lowest Gait RMSE."""

    # Largest excess over the lowest objective, %.
    within_percent: float


class SolveOptionsLocalOptimumChoice(TypedDict):
    # Takes the local optimum with the lowest Gait RMSE.
    nearest_to_reference: SolveOptionsLocalOptimumChoiceNearestToReference


class SolveOptionsSolver(TypedDict, total=False):
    """Settings of the interior-point solver. Absent settings have their default values."""

    # Bound multipliers of a cold start: `centred`, on the central path; `one`, all 1. Default `centred`.
    bound_multiplier_start: Literal["centred", "one"]
    # Minimum distance of a cold start from its bounds, relative to the larger of 1 and the bound, and to the distance
    # between two bounds. Default 0.1.
    bound_push: float
    # Relaxation of every bound, relative to the larger of 1 and the bound. Default 1e-8.
    bound_relaxation: float
    # First regularisation of the Hessian. Default 1e-4.
    hessian_regularisation_first: float
    # Factorisation of the linear systems: `multifrontal`, pivots within blocks; `delayed_pivots`, pivots by a
    # threshold, slower; `auto`, `multifrontal`, or `delayed_pivots` where the former is inaccurate. Default `auto`.
    linear_solver: Literal["auto", "multifrontal", "delayed_pivots"]
    # Maximum number of second-order corrections in each iteration. Default 1.
    max_second_order_corrections: int
    # Initial weight of the proximal term after a step that the line search shortened many times. Default 1e-4. 0
    # disables the term.
    proximal_first: float
    # After the unregularised matrix has had the wrong inertia twice in a row, this many iterations start from a reduced
    # regularisation. Each further time adds one iteration. Default 4.
    regularisation_memory: int
    # Share of the violation at which the restoration phase ends if the filter accepts the point. Default 0.9.
    required_reduction: float
    # Number of consecutive steps below 0.05 after which the restoration phase starts. Default 5. With 0, short steps do
    # not start it.
    short_step_limit: int


class SolveOptions(TypedDict, total=False):
    """Options of the solver: limits, tolerance, initial guesses and retries."""

    # Minimum number of initial guesses of a cold start.
    initial_guesses: int
    # Which one of several local optima is the result: `lowest_objective`, or `nearest_to_reference`, the one with the
    # lowest Gait RMSE among those whose objective exceeds the lowest by at most `within_percent` per cent, or
    # `numbered`, the one with this number among those that the cold start reached.
    local_optimum_choice: Union[Literal["lowest_objective"], SolveOptionsLocalOptimumChoice, SolveOptionsLocalOptimumChoice]
    # Maximum number of iterations in each phase of a solve. Phases that track the reference gait are limited to 200.
    max_iterations: int
    # Whether a cold start tries further initial guesses until one converges.
    retry: bool
    # Settings of the interior-point solver. Absent settings have their default values.
    solver: SolveOptionsSolver
    # Number of threads. The result does not depend on it.
    threads: int
    # Maximum number of rounds in which bounds are tightened and the solve continues, because the gait violates them
    # between nodes. 0 disables the check.
    tightening_rounds: int
    # Maximum wall time of a solve, s. Null for no limit. With a limit, the result depends on the speed of the machine.
    time_limit_s: Optional[float]
    # Scaled optimality tolerance.
    tolerance: float


class SolveProblem(TypedDict):
    """Input for `gaitwright solve --problem`: the gait problem, options and warm start."""

    # Options of the solver.
    options: SolveOptions
    # The gait problem.
    problem: GaitProblem
    # The warm start. Null for a cold start.
    warm_start: Optional[WarmStart]


class SolveReport(TypedDict):
    """Numerical results of one solve."""

    # Mechanical cost of transport, from absolute joint powers; dimensionless.
    cost_of_transport: float
    # Durations of the eight domains, s.
    durations_s: list[float]
    # Number of equality constraints.
    equalities: int
    # Parts of Gait RMSE: torso, `hip_L`, `knee_L`, `ankle_L`, `hip_R`.
    gait_rmse_parts_rad: list[float]
    # Gait RMSE: sum over the five human coordinates, rad.
    gait_rmse_rad: float
    # Number of inequality constraints.
    inequalities: int
    # Interior-point iterations over all phases.
    iterations: int
    # Breakdown of the linear algebra. Null if unknown.
    linear_algebra: Optional[LinearAlgebra]
    # Largest violation of a constraint or of a limit on a variable, scaled.
    max_violation: float
    # Objective: smoothed cost of transport plus regularisation and terms for natural walking.
    objective: float
    # How well the conditions of a local optimum are met. Null if unknown.
    optimality: Optional[Optimality]
    # Time for evaluating functions and derivatives, s.
    seconds_evaluation: float
    # Time for linear algebra, s.
    seconds_linear_algebra: float
    # Wall time, s.
    seconds_total: float
    # All solver runs, in order.
    solver_runs: list[SolverRun]
    # Mean walking speed, m/s.
    speed_m_s: float
    # Starting point of the solve.
    started_from: StartedFrom
    # How it ended.
    status: SolveStatus
    # Stride length, m.
    stride_length_m: float
    # Number of limits that were tightened at nodes, so that the gait satisfies them between the nodes as well.
    tightened_bounds: int
    # For each tuned bound, the range of values for which the gait remains a solution, even if several bounds change at
    # once. Empty if the solve did not converge, or if unknown.
    unchanged_bounds: list[UnchangedBound]
    # Number of variables.
    variables: int
    # Hip velocity in the four intervals between impacts, m/s.
    vhip_m_s: list[float]


class SolverRun(TypedDict):
    """One run of the solver within a solve, from an initial guess or a warm start."""

    # Whether its gait is the result of the solve.
    chosen: bool
    # Gait RMSE where it ended, rad.
    gait_rmse_rad: float
    # Iterations over its phases.
    iterations: int
    # Number of the local optimum in which it ended, counted from 1; null if it did not converge.
    local_optimum: Optional[int]
    # Objective where it ended.
    objective: float
    # Reason if it could not be completed; otherwise empty.
    reason: str
    # Wall time, s.
    seconds: float
    # How it ended.
    status: SolveStatus
    # Starting point and method in words, such as `warm start`.
    strategy: str


class StateChangeReason(TypedDict, total=False):
    """Reason for a command."""

    # Reason, at most 2000 characters.
    reason: str


class StridesOnYield(TypedDict):
    """Undisturbed simulated walk on ground of a given stiffness."""

    # Completed strides.
    strides: int
    # How far the ground yields under body weight, m.
    yield_m: float


class StudyPlan(TypedDict):
    """Set-up of a study."""

    # Source of the answers.
    answer_source: AnswerSource
    # Role of the study with an atlas.
    atlas: AtlasRole
    # Values of bounds that are not tuned.
    base_bounds: Bounds
    # Height and mass used by solves, independent of later corrections.
    body: BodyMeasures
    # Identifier of the device.
    device_id: DeviceId
    # Evaluation of the trials, by the service or by lab scripts.
    evaluation: Evaluation
    # Settings of the gait problem.
    gait_settings: GaitSettings
    # Settings of the learner.
    learner: LearnerSettings
    # Whether the muscles are part of the gait problem (constraints C1 to C12 of the published method) or not (C1 to
    # C4).
    muscles: bool
    # Name shown to users.
    name: str
    # Number of trials.
    number_of_trials: int
    # Number of trials that run in parallel. Only 1 gives the published, reproducible order.
    parallel_trials: int
    # Priority, -10 to 10. Studies with a higher priority run first.
    priority: int
    # Identifier of the reference gait for Gait RMSE.
    reference_gait_id: ReferenceGaitId
    # Whether a trial may repeat an action whose gait another trial has already found, as in the published method.
    repeat_results: bool
    # Tuned bounds and their values, with each dimension named after its bound.
    search_space: SearchSpace
    # Seed for all random draws except allocations.
    seed: int
    # Simulated walks with each gait.
    simulated_walks: SimulatedWalksSetting
    # Options of the solver: limits, tolerance, initial guesses and retries.
    solve_options: SolveOptions
    # Total solve time, s, after which no new trial starts.
    solve_seconds_budget: Optional[float]
    # Identifier of the subject.
    subject_id: SubjectId
    # The study finishes when the best action has not changed over this many results.
    unchanged_limit: Optional[int]
    # The gait from which trials are warm-started.
    warm_start_from: WarmStartFrom


class _StudyRequired(StudyPlan):
    # Time of creation.
    created_at: Instant
    # Identifier.
    id: StudyId
    # Free-text notes.
    notes: str
    # Revision, which increases with each change.
    revision: int
    # State of the study.
    state: StudyState
    # Reason for the state; may be empty.
    state_reason: str
    # Tags for finding the study.
    tags: list[str]
    # Time of the last change.
    updated_at: Instant


class Study(_StudyRequired, total=False):
    """A tuning run for one subject: its set-up and state."""

    # Time at which the study was archived. Null if it is not archived. Lists leave out archived studies unless they are
    # asked for; `GET /api/v1/studies?archived=true` lists them.
    archived_at: Optional[Instant]
    # Parent, if the study is a clone; otherwise null.
    cloned_from: Optional[StudyId]


class StudyChange(TypedDict, total=False):
    """Changes to a study. Absent fields keep their values."""

    # Whether the study is archived. Lists leave out archived studies unless they are asked for. A study can be archived
    # before its start and after its end.
    archived: Optional[bool]
    # Name shown to users, which must differ from the names of all other studies that you can see.
    name: Optional[str]
    # Free-text notes.
    notes: Optional[str]
    # Number of trials that run in parallel.
    parallel_trials: Optional[int]
    # Priority, -10 to 10. Studies with a higher priority run first.
    priority: Optional[int]
    # Tags, at most 10 of at most 40 characters. They replace the present ones.
    tags: Optional[list[str]]


class StudyClone(TypedDict, total=False):
    """A new study with the set-up of another one. Absent fields are copied."""

    # Source of the answers.
    answer_source: Optional[AnswerSource]
    # Role of the study with an atlas. `make` gives the study that makes the atlas of this problem, in which everything
    # that does not affect gaits has its own values, and `use` one that takes its gaits from there. Both start every
    # solve from one root gait and repeat no results.
    atlas: Optional[AtlasRole]
    # Whether to solve with muscles.
    muscles: Optional[bool]
    # Name shown to users, which must differ from the names of all studies that you can see. By default, it is the name
    # of the parent with "(clone)" appended.
    name: Optional[str]
    # Number of trials.
    number_of_trials: Optional[int]
    # Seed for all random draws except allocations.
    seed: Optional[int]
    # Whether to start the study immediately.
    start: bool


class StudyComparison(TypedDict):
    """Study in a comparison."""

    # Action of the recommended trial. Null if there is no recommendation.
    best_action: Optional[Bounds]
    # Cost of transport of the recommended trial. Null if there is no recommendation, or if the script that evaluated
    # the trial did not report it.
    best_cost_of_transport: Optional[float]
    # Gait RMSE of the recommended trial, rad. Null if there is no recommendation, or if the script that evaluated the
    # trial did not report it. Null in every row if the compared studies have different reference gaits, because values
    # against different reference gaits cannot be compared.
    best_gait_rmse_rad: Optional[float]
    # Number of the recommended trial. Null if there is no recommendation.
    best_trial: Optional[int]
    # Identifier of the study.
    id: StudyId
    # Whether gaits are computed with muscles.
    muscles: bool
    # Name of the study.
    name: str
    # Reference gait for Gait RMSE.
    reference_gait_id: ReferenceGaitId
    # Seed of the random draws of the study.
    seed: int
    # Total time of all solves, s.
    solve_seconds: float
    # State of the study.
    state: StudyState
    # Numbers of trials by state.
    trials: TrialCounts


class StudyExtension(TypedDict):
    """A larger number of trials."""

    # Number of trials. Must exceed the current number.
    number_of_trials: int


class StudyRestriction(TypedDict):
    """Access to a study."""

    # Whether only members and administrators can access the study. Raters must always be members.
    restricted: bool


class StudyWithCommands(Study):
    """Study with its possible commands."""

    # Commands that are possible in the current state: `start`, `pause`, `resume`, `stop`, `extend`.
    possible: list[str]
    # Numbers of trials by state.
    trials: TrialCounts


class Subject(TypedDict):
    """Subject, known by a pseudonym only."""

    # Body mass, kg.
    body_mass_kg: float
    # Time of creation.
    created_at: Instant
    # Body height, m.
    height_m: float
    # Identifier.
    id: SubjectId
    # Free text.
    notes: str
    # Unique pseudonym assigned by the site.
    pseudonym: str


class Suggestion(TypedDict):
    """Bounds with which a gait would have been better than that of a trial."""

    # Name or pseudonym of the author.
    author: str
    # Suggested values of all tuned bounds.
    bounds: dict[str, float]
    # Time of recording.
    created_at: Instant
    # Identifier.
    id: FeedbackId
    # Free text.
    note: str
    # Trial whose gait could be better.
    over: TrialId
    # Retraction. Null if it was not retracted.
    retraction: Optional[Retraction]
    # Sequence number.
    seq: int
    # Source of the suggestion.
    source: Source
    # Identifier of the study.
    study_id: StudyId


class SurvivedPushes(TypedDict):
    """Largest pushes in a fixed, increasing series that the walker survives without other disturbances."""

    # Backwards, N s; 0 if it survives none.
    backwards_n_s: float
    # Forwards, N s; 0 if it survives none.
    forwards_n_s: float
    # Largest push of the series, N s.
    largest_tried_n_s: float


class _TellRequestRequired(TypedDict):
    # Whether the evaluation found a gait.
    label: ReportedLabel


class TellRequest(_TellRequestRequired, total=False):
    """The result of a trial, as a script reports it."""

    # Cost of transport.
    cost_of_transport: Optional[float]
    # Gait RMSE, rad. Required for `converged` if Gait RMSE answers the comparisons of the study.
    gait_rmse_rad: Optional[float]
    # Reason why no gait was found, 1 to 2000 characters. Required for `not_converged`.
    reason: str


class TightenedBounds(TypedDict):
    """Margins of tightened bounds, scaled."""

    # For each tightened row a list of its number, from 0, and the margin of its lower bound.
    rows: list[list[float]]
    # For each tightened variable a list of its number, from 0, and a list of two margins, of its lower and of its upper
    # bound.
    variables: list[list[MarginEntry]]


class Trial(TypedDict):
    """Trial of a study."""

    # The action: the values of all bounds, tuned or fixed.
    action: Bounds
    # Index of the action in the search space.
    action_index: int
    # Best trial when this one was proposed. Null if there was none.
    best_before: Optional[TrialId]
    # Cost of transport of the gait, dimensionless. Null if the trial has no gait, or if the script that evaluated it
    # did not report the value.
    cost_of_transport: Optional[float]
    # Time of proposal.
    created_at: Instant
    # Time at which it ended. Null while it is open.
    finished_at: Optional[Instant]
    # Gait RMSE of the gait, rad. Null if the trial has no gait, or if the script that evaluated it did not report the
    # value. If the trial did not converge, `report` has the Gait RMSE of the last iterate.
    gait_rmse_rad: Optional[float]
    # Identifier.
    id: TrialId
    # Number of interior-point iterations. Null without a completed solve.
    iterations: Optional[int]
    # Largest violation, scaled. Null without a completed solve.
    max_violation: Optional[float]
    # Mean strides of the simulated walks on which the result of the trial depends. Null if the trial has no gait, or if
    # the results of the study do not depend on simulated walks.
    mean_strides: Optional[float]
    # Human-readable message about how the trial ended; may be empty.
    message: str
    # Number within the study, from 1, in the order of proposal.
    number: int
    # Objective of the solve. Null without a completed solve.
    objective: Optional[float]
    # Reason for the trial.
    reason: str
    # All numerical results of the solve. Null without a completed solve.
    report: Optional[SolveReport]
    # Script that evaluates the trial. Null if the service does.
    script: Optional[str]
    # Wall time of the solve, s. Null without a completed solve.
    seconds_total: Optional[float]
    # Time at which a worker first started it. Null before.
    started_at: Optional[Instant]
    # State of the trial.
    state: TrialState
    # How the solve ended. Null without a completed solve.
    status: Optional[SolveStatus]
    # Identifier of the study to which the trial belongs.
    study_id: StudyId
    # Most violated constraints, worst first.
    violations: list[Violation]
    # Trial whose gait is the warm start. Null for a cold start.
    warm_started_from: Optional[TrialId]


class TrialCounts(TypedDict):
    """Numbers of trials of a study by state."""

    # Converged trials.
    converged: int
    # Trials that did not converge.
    not_converged: int
    # Trials with a gait that is not executable.
    not_executable: int
    # Queued or running trials.
    open: int
    # All trials.
    total: int
    # Failed, lost or cancelled trials.
    without_result: int


class TrialExecutionReport(TypedDict):
    """Execution report of a gait."""

    # Time of creation.
    created_at: Instant
    # Version of the program that made it.
    program: str
    # The report, as `gaitwright simulate --json` prints it.
    report: ExecutionReport
    # How many simulated walks were complete, as a sentence.
    sentence: str
    # Trial of the gait.
    trial_id: TrialId


class TrialExplanation(TypedDict):
    """Infeasibility explanation of a trial."""

    # Tuned bounds that are active at the last iterate.
    at_limit: list[BoundAtLimit]
    # Conflicts between tuned bounds: the first one, and others if relaxing a single bound does not resolve it. Empty in
    # older explanations.
    conflicts: list[Conflict]
    # Time of creation.
    created_at: Instant
    # Whether the search for a conflict found a gait with the given bounds, which the solve had missed.
    gait_found: bool
    # SHA-256 of the trial's `problem.json`.
    problem_sha256: str
    # Version of the program that made it.
    program: str
    # Effect of relaxing each bound of the first conflict alone: the smallest relaxation first, ineffective ones last.
    relaxations: list[Relaxation]
    # The explanation in sentences.
    sentences: list[str]
    # Status of the solve.
    status: SolveStatus
    # Whether the explanation was cancelled after it had found the first conflict. Further conflicts and relaxations may
    # then be missing; another request makes a complete explanation.
    stopped_early: bool
    # Effect of relaxing several bounds together, if no single one helps.
    together: list[JointRelaxation]
    # Explained trial.
    trial_id: TrialId
    # Violations of the last iterate, worst first.
    violations: list[Violation]


class TrialSensitivities(TypedDict):
    """Sensitivities of a gait with respect to the tuned bounds."""

    # One entry for each bound that can be tuned.
    bounds: list[SensitivityToBound]
    # Mechanical cost of transport of the gait.
    cost_of_transport: float
    # The sensitivities in sentences.
    sentences: list[str]
    # Trial of the gait.
    trial_id: TrialId


class UnblindedPair(TypedDict):
    """Pair shown to a rater who has been unblinded, with the trial shown on each side."""

    # Answer in terms of what was shown. Null if there is none yet.
    answer: Optional[OrderedAnswer]
    # Time of the answer. Null if there is none yet.
    answered_at: Optional[Instant]
    # Whether the rater could have known the allocation.
    could_have_known: bool
    # Time at which the pair was drawn.
    created_at: Instant
    # Identifier.
    id: BlindPairId
    # Why it was shown.
    kind: BlindPairKind
    # Number of the pair for this rater in this study, from 1.
    number: int
    # Name of the rater.
    rater: str
    # Earlier pair that it repeats. Null if it is not a repeat.
    repeats: Optional[BlindPairId]
    # Trial shown first.
    shown_first: TrialId
    # Trial shown second.
    shown_second: TrialId
    # Identifier of the study.
    study_id: StudyId


class UnblindedRater(TypedDict):
    """Unblinded rater."""

    # Name of the rater.
    rater: str
    # Identifier of the study.
    study_id: StudyId


class UnchangedBound(TypedDict):
    """A tuned bound and the range of its values for which a gait remains a solution."""

    # Name of the bound.
    bound: str
    # Smallest value, in the unit of the bound. Null if every smaller one leaves the gait as it is.
    least: Optional[float]
    # Largest value, in the unit of the bound. Null if every larger one leaves the gait as it is.
    most: Optional[float]


class User(TypedDict):
    """A person who signs in: administrator, clinician or rater."""

    # Time of creation.
    created_at: Instant
    # Time at which the user was disabled. Null if the user is not disabled.
    disabled_at: Optional[Instant]
    # Whether the user has a password. Otherwise only one-time links work.
    has_password: bool
    # Identifier.
    id: UserId
    # Name or code, unique ignoring case.
    name: str
    # Role, which determines the rights of the user.
    role: Role


class Violation(TypedDict):
    """A violated constraint of the gait problem."""

    # Amount of the violation.
    amount: float
    # The constraint in words: domain, node, constraint, component.
    row: str
    # Unit of the amount.
    unit: str


class WalkActivity(TypedDict):
    """Muscle activity of a walk over the gait cycle."""

    # Mean of each channel over the cycle, relative to the peak of walk 1.
    averages: list[float]
    # Mean and standard deviation of each channel at 0, 1, ..., 100 % of the cycle from the heel strike of its leg,
    # relative to the peak of walk 1.
    channels: list[CycleActivity]
    # EMG RMSE against walk 1, in total and for each channel. Null for walk 1.
    emg_rmse: Optional[EmgRmse]
    # Measurement file that it was computed from.
    measurement_file_id: MeasurementFileId
    # Number of the walk, 1 to 3.
    walk: int


class WalkModel(TypedDict):
    """Muscle activity of the model for a walk."""

    # Each channel whose muscle is in the model.
    muscles: list[ModelActivity]
    # Number of the walk, 2 or 3.
    walk: int


class WalkView(TypedDict):
    """Walk of a session."""

    # Condition of the walk. Null while it is blinded.
    condition: Optional[WalkCondition]
    # Number of the walk, 1 to 3.
    number: int
    # Actor and time of the recording of the walk. Null if it is not recorded yet.
    recorded: Optional[LabSessionStep]
    # Whether it was recorded after unblinding, or by a user who had fetched a controller file.
    recorded_after_unblinding: bool


class WalkerSubject(TypedDict):
    """Height and mass of the person who walks."""

    # Body mass, kg.
    body_mass_kg: float
    # Body height, m.
    height_m: float


class _WarmStartRequired(TypedDict):
    # Mesh of the earlier solve.
    mesh: MeshIntervals
    # Whether the earlier solve had muscles.
    muscles: bool
    # Scaled variables and multipliers.
    point: PrimalDualPoint


class WarmStart(_WarmStartRequired, total=False):
    """The solution of an earlier solve, from which a solve begins."""

    # Margins by which bounds are tightened, because an earlier gait violated them between nodes. Absent if there are
    # none.
    margins: TightenedBounds


class Worker(TypedDict):
    """A worker that runs solves."""

    # Name of the worker.
    name: str
    # Number of solves that it is running.
    running_solves: int


# Values before a change: settings of a study, height and mass of a subject, or the role of a user.
AuditedBefore = Union[AuditedStudySettings, AuditedBodyMeasures, Role]


# Kind of a member or of a measurement file.
AuditedKind = Union[MemberKind, MeasurementKind]


# State of a study, or a number of trials.
AuditedStateOrNumber = Union[StudyState, int]


# The number of a variable, or the margins of its lower and of its upper bound.
MarginEntry = Union[int, list[float]]


# Content of a preference, in terms of trials.
PreferenceContent = Union[PreferenceContentPreference, PreferenceContentNoDifference]
