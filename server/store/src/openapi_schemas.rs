//! OpenAPI schemas of types of other crates. These types are never constructed.

use serde_json::Value;
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// A document whose fields the description does not list.
macro_rules! document {
    ($(#[$says:meta])* $name:ident) => {
        $(#[$says])*
        #[derive(Debug, ToSchema)]
        pub struct $name(pub BTreeMap<String, Value>);
    };
}

document! {
    /// A gait as the optimiser writes it. `format_version` is the version of its layout.
    GaitDocument
}
document! {
    /// Input for `gaitwright solve --problem`: subject, device, bounds, settings, reference gait, limits and warm start.
    SolveProblem
}
document! {
    /// The file that the controller of a device reads. It describes its own fields.
    ControllerFile
}
document! {
    /// A reference gait: joint angles over the gait cycle, the measured person, and the processing.
    ReferenceGaitDocument
}
document! {
    /// What exactly was changed; its fields depend on the kind of change.
    AuditDetail
}

// The rules of these come from the crates that read them.
document! {
    /// Settings of the gait problem.
    GaitSettings
}
document! {
    /// Limits of one solve.
    SolveOptions
}
document! {
    /// Settings of the learner.
    LearnerSettings
}
document! {
    /// Muscle values that differ from the default ones.
    MuscleParameters
}
document! {
    /// A device: measurements of the prosthesis, each with its range.
    DeviceDefinition
}
document! {
    /// The tuned bounds of one action.
    Bounds
}

/// Height and mass of a subject.
#[derive(Debug, ToSchema)]
pub struct Body {
    /// Body height, m.
    pub height_m: f64,
    /// Body mass, kg.
    pub body_mass_kg: f64,
}

/// A grid of actions.
#[derive(Debug, ToSchema)]
pub struct SearchSpace {
    /// One dimension for each tuned bound.
    pub dimensions: Vec<Dimension>,
}

/// One tuned bound of a search space.
#[derive(Debug, ToSchema)]
pub struct Dimension {
    /// Name of the bound.
    pub name: String,
    /// Its values, ascending.
    pub values: Vec<f64>,
    /// How far apart two values can be while their gaits are still expected to have similar utility.
    pub lengthscale: f64,
}

/// A violated row of the gait problem.
#[derive(Debug, ToSchema)]
pub struct Violation {
    /// The row in words: domain, node, constraint, component.
    pub row: String,
    /// Amount of the violation.
    pub amount: f64,
    /// Unit of the amount.
    pub unit: String,
}

/// A tuned bound that is active at the last iterate of a solve.
#[derive(Debug, ToSchema)]
pub struct BoundAtLimit {
    /// Name of the bound.
    pub bound: String,
    /// What it limits, with its unit.
    pub meaning: String,
    /// Given value.
    pub value: f64,
    /// Domains in which it is active, or `stride`.
    pub domains: Vec<String>,
}

/// A tuned bound with its given value.
#[derive(Debug, ToSchema)]
pub struct GivenBound {
    /// Name of the bound.
    pub bound: String,
    /// What it limits, with its unit.
    pub meaning: String,
    /// Given value.
    pub value: f64,
}

/// Tuned bounds that conflict. With all other tuned bounds at their loosest, no gait was found with all of these, but
/// relaxing any one of them gave a gait.
#[derive(Debug, ToSchema)]
pub struct Conflict {
    /// The bounds. Empty if the fixed constraints conflict with each other.
    pub bounds: Vec<GivenBound>,
    /// Bounds of other conflicts that were relaxed when this one was found.
    pub without: Option<Vec<String>>,
    /// Requirements for natural walking that take part in a conflict between fixed constraints, in words; absent if
    /// there are none.
    pub naturalness_terms: Option<Vec<String>>,
    /// Violations in the motion closest to feasibility that the search found, with all other tuned bounds at their
    /// loosest, worst first.
    pub violations: Vec<Violation>,
    /// Number of starting points of the search.
    pub starts: u64,
    /// Whether a solve gave up, so that infeasibility is not certain.
    pub undecided: bool,
}

/// Effect of relaxing one tuned bound alone.
#[derive(Debug, ToSchema)]
pub struct Relaxation {
    /// Name of the bound.
    pub bound: String,
    /// What it limits, with its unit.
    pub meaning: String,
    /// Given value.
    pub from: f64,
    /// The value nearest to the given one that was found to give a gait. Null if not even the loosest value does.
    pub to: Option<f64>,
    /// The loosest value tried that does not give a gait.
    pub not_with: f64,
    /// Whether the solve at the `not_with` value gave up, so that infeasibility is not certain.
    pub undecided: bool,
    /// Number of solves.
    pub solves: u64,
    /// Number of starting points of the search at the `not_with` values. 0 if unknown.
    pub starts: u64,
}

/// Relaxation of one of several bounds.
#[derive(Debug, ToSchema)]
pub struct RelaxedBound {
    /// Name of the bound.
    pub bound: String,
    /// What it limits, with its unit.
    pub meaning: String,
    /// Given value.
    pub from: f64,
    /// The value nearest to the given one that gives a gait together with the others. Null if not even the loosest
    /// value does.
    pub to: Option<f64>,
    /// The loosest value that does not give a gait together with the others.
    pub not_with: f64,
}

/// Effect of relaxing several tuned bounds together, each by the same fraction of the way to its loosest value.
/// Computed if no single relaxation gives a gait.
#[derive(Debug, ToSchema)]
pub struct JointRelaxation {
    /// The bounds, one from each conflict.
    pub bounds: Vec<RelaxedBound>,
    /// Whether a solve at the `not_with` values gave up, so that infeasibility is not certain.
    pub undecided: bool,
    /// Number of solves.
    pub solves: u64,
    /// Number of starting points of the search at the `not_with` values.
    pub starts: u64,
}

/// One iteration of a solve.
#[derive(Debug, ToSchema)]
pub struct Iteration {
    /// Number of the iteration over all phases.
    pub iteration: u64,
    /// Phase of the solve.
    pub phase: String,
    /// Objective of the phase.
    pub objective: f64,
    /// Largest violation of a scaled row.
    pub constraint_violation: f64,
    /// Largest entry of the dual infeasibility.
    pub dual_infeasibility: f64,
    /// Barrier parameter.
    pub barrier: f64,
    /// Primal step length.
    pub step: f64,
    /// Initial guess it belongs to.
    pub guess: u64,
}

/// How a solve ended.
#[derive(Debug, ToSchema)]
#[schema(rename_all = "snake_case")]
pub enum SolveStatus {
    /// Every row and bound is satisfied.
    Converged,
    /// A local minimum of the violation: no gait near it.
    Infeasible,
    /// No further progress.
    Stalled,
    /// The limit of iterations.
    IterationLimit,
    /// The limit of time.
    TimeLimit,
    /// Somebody cancelled it.
    Cancelled,
}

/// What a solve started from.
#[derive(Debug, ToSchema)]
#[schema(rename_all = "snake_case")]
pub enum StartedFrom {
    /// Its own cold start.
    Cold,
    /// The warm start that was given.
    Warm,
    /// A cold start after the given warm start did not converge.
    ColdAfterWarm,
}

/// The figures of one solve.
#[derive(Debug, ToSchema)]
pub struct SolveReport {
    /// How it ended.
    pub status: SolveStatus,
    /// What it started from.
    pub started_from: StartedFrom,
    /// Interior-point iterations over all phases.
    pub iterations: u64,
    /// Objective: cost of transport plus regularisation.
    pub objective: f64,
    /// Mechanical cost of transport, dimensionless.
    pub cost_of_transport: f64,
    /// Gait RMSE: sum over the five human coordinates, rad.
    pub gait_rmse_rad: f64,
    /// Parts of Gait RMSE: torso, `hip_L`, `knee_L`, `ankle_L`, `hip_R`.
    pub gait_rmse_parts_rad: Vec<f64>,
    /// Largest violation of a constraint or of a limit on a variable, scaled.
    pub max_violation: f64,
    /// How well the conditions of a local optimum are met. Null if unknown.
    pub optimality: Option<Optimality>,
    /// Number of limits that were tightened at nodes, so that the gait satisfies them between the nodes as well.
    pub tightened_bounds: u64,
    /// For each tuned bound, the range of values for which the gait remains a solution, even if several bounds change
    /// at once. Empty if the solve did not converge, or if unknown.
    pub unchanged_bounds: Vec<UnchangedBound>,
    /// Wall time, s.
    pub seconds_total: f64,
    /// Time for evaluating functions and derivatives, s.
    pub seconds_evaluation: f64,
    /// Time for linear algebra, s.
    pub seconds_linear_algebra: f64,
    /// Breakdown of the linear algebra. Null if unknown.
    pub linear_algebra: Option<LinearAlgebra>,
    /// Number of variables.
    pub variables: u64,
    /// Number of equality rows.
    pub equalities: u64,
    /// Number of inequality rows.
    pub inequalities: u64,
    /// Mean walking speed, m/s.
    pub speed_m_s: f64,
    /// Stride length, m.
    pub stride_length_m: f64,
    /// Durations of the eight domains, s.
    pub durations_s: Vec<f64>,
    /// Hip velocity in the four intervals between impacts, m/s.
    pub vhip_m_s: Vec<f64>,
    /// All attempts, in order.
    pub attempts: Vec<SolveAttempt>,
}

/// A tuned bound and the range of its values for which a gait remains a solution.
#[derive(Debug, ToSchema)]
pub struct UnchangedBound {
    /// Name of the bound.
    pub bound: String,
    /// Smallest value. Null if every smaller one leaves the gait as it is.
    pub least: Option<f64>,
    /// Largest value. Null if every larger one leaves the gait as it is.
    pub most: Option<f64>,
}

/// One attempt within a solve, from one starting point.
#[derive(Debug, ToSchema)]
pub struct SolveAttempt {
    /// Strategy, in words.
    pub strategy: String,
    /// How it ended.
    pub status: SolveStatus,
    /// Iterations over its phases.
    pub iterations: u64,
    /// Wall time, s.
    pub seconds: f64,
    /// Objective where it ended.
    pub objective: f64,
    /// Gait RMSE where it ended, rad.
    pub gait_rmse_rad: f64,
    /// Reason if it could not be completed; otherwise empty.
    pub reason: String,
    /// Number of the local optimum in which it ended, counted from 1; null if it did not converge.
    pub basin: Option<u64>,
    /// Whether its gait is the result of the solve.
    pub chosen: bool,
}

/// First-order conditions of a local optimum.
#[derive(Debug, ToSchema)]
pub struct Optimality {
    /// Largest entry of the Lagrangian's gradient.
    pub dual_infeasibility: f64,
    /// Largest product of the distance to a limit and its multiplier.
    pub complementarity: f64,
    /// Last barrier parameter.
    pub barrier: f64,
}

/// Operations and times of the linear algebra of a solve.
#[derive(Debug, ToSchema)]
pub struct LinearAlgebra {
    /// Time for analysing the structure of matrices, s.
    pub seconds_analysis: f64,
    /// Time for assembling and factorising matrices, s.
    pub seconds_factorisation: f64,
    /// Time for substitutions, residuals and refinement, s.
    pub seconds_solves: f64,
    /// Number of numerical factorisations.
    pub factorisations: u64,
    /// Number of forward and backward substitutions.
    pub substitutions: u64,
    /// Number of factorisations that failed and were replaced by a fallback method.
    pub fallbacks: u64,
}

/// A certificate: the result of checking a gait independently of the optimiser.
#[derive(Debug, ToSchema)]
pub struct Certificate {
    /// Version of this layout and of its checks.
    pub format_version: u32,
    /// The gait that was checked; null if it is malformed.
    pub certified: Option<CertifiedGait>,
    /// Whether every check is within its limit, the walker does not fall, and the gait is stable.
    pub passed: bool,
    /// Reasons if it failed; otherwise empty.
    pub failures: Vec<String>,
    /// Every quantity with its worst value and its limit.
    pub checks: Vec<CertificateCheck>,
    /// How the simulation ended early; null if it did not.
    pub fall: Option<String>,
    /// The stride-to-stride map.
    pub return_map: Option<ReturnMap>,
    /// The stride-to-stride map with a free hip velocity (zero dynamics).
    pub free_hip_return_map: Option<ReturnMap>,
    /// Largest pushes from which the walker recovers. Null if the gait is not stable.
    pub pushes: Option<Pushes>,
}

/// What a certificate is about, computed from the gait.
#[derive(Debug, ToSchema)]
pub struct CertifiedGait {
    /// SHA-256 of the gait as compact JSON, hexadecimal.
    pub gait_sha256: String,
    /// Version of the optimiser that made the certificate.
    pub optimizer_version: String,
    /// The subject.
    pub subject: CertifiedSubject,
    /// Name of the device. `differences` shows whether its values are those of the built-in device.
    pub device: String,
    /// Whether the muscle constraints were checked.
    pub muscles: bool,
    /// Values of the device and of the settings that differ from AMPRO3 and the default settings.
    pub differences: Vec<CertifiedDifference>,
    /// Mechanical cost of transport, computed with the unsmoothed magnitudes of the joint powers. The objective, and
    /// therefore the `cost_of_transport` of a trial, uses smoothed magnitudes, which are smaller.
    pub unsmoothed_cost_of_transport: f64,
}

/// Height and mass of a certified walker.
#[derive(Debug, ToSchema)]
pub struct CertifiedSubject {
    /// Body height, m.
    pub height_m: f64,
    /// Body mass, kg.
    pub body_mass_kg: f64,
}

/// A value that differs from the built-in problem.
#[derive(Debug, ToSchema)]
pub struct CertifiedDifference {
    /// Name, as in the gait: `settings.limits.friction`, `device.knee_torque_limit_n_m`.
    pub name: String,
    /// Value of the gait; null if it is not set.
    pub value: Value,
    /// Value of the built-in problem; null if it is not set.
    pub built_in: Value,
}

/// The worst value of a quantity.
#[derive(Debug, ToSchema)]
pub struct CertificateCheck {
    /// What was measured.
    pub name: String,
    /// Unit of the value and the limit; empty if dimensionless.
    pub unit: String,
    /// Worst value; null if it could not be determined, which counts as failed.
    pub value: Option<f64>,
    /// Largest allowed value. Null if the value is only reported.
    pub limit: Option<f64>,
    /// Domain and time of the worst value.
    pub place: String,
}

/// Stability of a gait, from the stride-to-stride map.
#[derive(Debug, ToSchema)]
pub struct ReturnMap {
    /// Largest change of the state over one stride from the gait's own first state, rad and rad/s.
    pub gait_residual: f64,
    /// Largest change of the state over one stride from the nearby fixed point of the closed loop, rad and rad/s.
    pub fixed_point_residual: f64,
    /// Largest component of the difference between the gait's first state and the fixed point, rad and rad/s.
    pub fixed_point_distance: f64,
    /// Multipliers from variational equations and saltation matrices, largest first.
    pub multipliers: Vec<Multiplier>,
    /// Largest modulus of the multipliers.
    pub largest: f64,
    /// Largest modulus of the multipliers, from finite differences of simulated domains.
    pub largest_by_differences: f64,
    /// Resolution of the finite differences.
    pub differences_resolve: f64,
    /// Fraction of a proportional change of all velocities that remains after one stride.
    pub speed_kept: f64,
    /// Change in other coordinates that a proportional change of all velocities causes within one stride, relative to its size.
    pub speed_leak: f64,
}

/// A multiplier of the stride-to-stride map.
#[derive(Debug, ToSchema)]
pub struct Multiplier {
    /// Real part.
    pub real: f64,
    /// Imaginary part.
    pub imaginary: f64,
}

/// Largest changes in the hip's forward velocity from which the walker recovers, m/s.
#[derive(Debug, ToSchema)]
pub struct Pushes {
    /// Forwards.
    pub forwards_m_s: f64,
    /// Backwards.
    pub backwards_m_s: f64,
}

/// Joint positions of one leg: forward and up, m.
#[derive(Debug, ToSchema)]
pub struct LegPoints {
    /// Knee.
    pub knee: Vec<f64>,
    /// Ankle.
    pub ankle: Vec<f64>,
    /// Heel.
    pub heel: Vec<f64>,
    /// Toe.
    pub toe: Vec<f64>,
}

/// Positions of the body at an instant: forward and up, m.
#[derive(Debug, ToSchema)]
pub struct StickFigure {
    /// Time from the start of the stride, s.
    pub time_s: f64,
    /// Hip.
    pub hip: Vec<f64>,
    /// Shoulder.
    pub shoulder: Vec<f64>,
    /// Left (intact) leg.
    pub left: LegPoints,
    /// Right (prosthetic) leg.
    pub right: LegPoints,
}

/// Angle and velocity of a joint, sample by sample.
#[derive(Debug, ToSchema)]
pub struct PhasePortrait {
    /// Name of the joint.
    pub joint: String,
    /// Angle, rad.
    pub angle_rad: Vec<f64>,
    /// Velocity, rad/s.
    pub velocity_rad_s: Vec<f64>,
}

/// Activity of a channel at 0, 1, ..., 100 % of the gait cycle, mean over strides.
#[derive(Debug, ToSchema)]
pub struct CycleActivity {
    /// Name of the channel.
    pub channel: String,
    /// Mean.
    pub mean: Vec<f64>,
    /// Standard deviation over strides; zero for one stride.
    pub standard_deviation: Vec<f64>,
    /// Number of strides.
    pub strides: u64,
}

/// EMG RMSE of a walk, in total and for each channel, relative to the peak of the walk without the device.
#[derive(Debug, ToSchema)]
pub struct EmgRmse {
    /// Sum of the parts.
    pub total: f64,
    /// RMS difference of each channel, in the order of the channels of the walk without the device.
    pub parts: Vec<f64>,
    /// Reasons to doubt the comparison. Absent if there are none.
    pub warnings: Option<Vec<String>>,
}

/// The activation of the muscle of a channel over the gait cycle.
#[derive(Debug, ToSchema)]
pub struct ModelActivity {
    /// Name of the channel.
    pub channel: String,
    /// Name of the muscle.
    pub muscle: String,
    /// Activation at 0, 1, ..., 100 % of the cycle, 0 to 1.
    pub activation: Vec<f64>,
    /// RMS difference between activation and measured activity.
    pub rms_difference: f64,
    /// Correlation between activation and measured activity over the cycle; null if one of them is constant.
    pub correlation: Option<f64>,
}

/// Filters for EMG recordings. Absent settings take their default values.
#[derive(Debug, ToSchema)]
pub struct EmgSettings {
    /// Lower cut-off frequency of the band-pass filter, Hz.
    #[schema(required = false)]
    pub band_low_hz: f64,
    /// Upper cut-off frequency of the band-pass filter, Hz; below half the sampling rate.
    #[schema(required = false)]
    pub band_high_hz: f64,
    /// Cut-off frequency of the low-pass filter for the envelope, Hz.
    #[schema(required = false)]
    pub envelope_hz: f64,
    /// Order of both filters: 2, 4, 6 or 8.
    #[schema(required = false)]
    pub order: u64,
}

/// Simulated walks with a gait, outside the optimiser's model.
#[derive(Debug, ToSchema)]
pub struct ExecutionReport {
    /// Version of this layout and of the simulation.
    pub format_version: u32,
    /// SHA-256 of the gait as compact JSON, as in its certificate.
    pub gait_sha256: String,
    /// Seed of the disturbances.
    pub seed: u64,
    /// Strides of a complete simulated walk.
    pub strides: u32,
    /// Range from which the body masses of disturbed walks are drawn, kg: ±5 %, limited to the range of the model.
    #[schema(min_items = 2, max_items = 2)]
    pub body_mass_kg: Vec<f64>,
    /// Completed strides without any disturbance.
    pub undisturbed_strides: u32,
    /// Randomly disturbed walks, for each kind of ground.
    pub grounds: Vec<WalksOnGround>,
    /// Undisturbed walks on level ground, ordered from hard ground to soft ground. In all other walks the ground yields
    /// 0.01 m under body weight.
    pub strides_by_yield: Vec<StridesOnYield>,
    /// Largest pushes survived. Null if the walker does not complete the undisturbed walk.
    pub pushes: Option<SurvivedPushes>,
}

/// Simulated walks on one kind of ground.
#[derive(Debug, ToSchema)]
pub struct WalksOnGround {
    /// Largest height and depth of the plateaus of the ground, m.
    pub ground_height_m: f64,
    /// Number of simulated walks.
    pub walks: u32,
    /// Walks that completed all strides.
    pub completed: u32,
    /// Walks that ended with a fall.
    pub fell: u32,
    /// Walks that ended with a halt: the walker took no further step.
    pub halted: u32,
    /// Share of completed walks.
    pub completed_share: f64,
    /// 95 % confidence interval of this share (Wilson).
    #[schema(min_items = 2, max_items = 2)]
    pub completed_share_interval: Vec<f64>,
    /// Mean number of completed strides.
    pub mean_strides: f64,
    /// Share of the time in which the controller demanded more than the largest torque of the prosthetic knee.
    pub knee_saturated_share: f64,
    /// Share of the time in which the controller demanded more than the largest torque of the prosthetic ankle.
    pub ankle_saturated_share: f64,
    /// Share of the time in which the controller demanded a faster change of the knee torque than the actuator can
    /// make.
    pub knee_rate_limited_share: f64,
    /// Share of the time in which the controller demanded a faster change of the ankle torque than the actuator can
    /// make.
    pub ankle_rate_limited_share: f64,
}

/// Undisturbed simulated walk on ground of a given stiffness.
#[derive(Debug, ToSchema)]
pub struct StridesOnYield {
    /// How far the ground yields under body weight, m.
    pub yield_m: f64,
    /// Completed strides.
    pub strides: u32,
}

/// Largest pushes, of a fixed series of increasing ones, that the walker survives without other disturbances.
#[derive(Debug, ToSchema)]
pub struct SurvivedPushes {
    /// Forwards, N s; 0 if it survives none.
    pub forwards_n_s: f64,
    /// Backwards, N s.
    pub backwards_n_s: f64,
    /// Largest push of the series, N s.
    pub largest_tried_n_s: f64,
}

/// Constraint that is active at a node or over the stride.
#[derive(Debug, ToSchema)]
pub struct ActiveConstraint {
    /// Domain, node and quantity.
    pub place: String,
    /// Multiplier of the scaled constraint: decrease of the objective per unit by which the constraint is relaxed.
    pub multiplier: f64,
}

/// Derivatives of figures per unit of a tuned bound.
#[derive(Debug, ToSchema)]
pub struct FigureDerivatives {
    /// Of the objective.
    pub objective: f64,
    /// Derivative of the mechanical cost of transport.
    pub cost_of_transport: f64,
    /// Derivative of Gait RMSE, rad per unit of the bound.
    pub gait_rmse_rad: f64,
    /// Derivative of the mean walking speed, m/s per unit of the bound.
    pub speed_m_s: f64,
    /// Derivatives of the largest angle over all nodes, rad per unit of the bound, for torso, hip_L, knee_L, ankle_L,
    /// hip_R, knee_R and ankle_R in this order.
    #[schema(min_items = 7, max_items = 7)]
    pub largest_angles_rad: Vec<f64>,
    /// Derivatives of the smallest angle over all nodes, in the order of the largest angles, rad per unit of the bound.
    #[schema(min_items = 7, max_items = 7)]
    pub smallest_angles_rad: Vec<f64>,
}
