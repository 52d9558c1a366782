//! What a solve gives back: figures, gait, violations.

use super::attempts::Choice;
use super::run::Context;
use super::warm_start::WarmStart;
use crate::gait::Gait;
use crate::gait_problem::GaitProgramme;
use crate::gait_problem::margins::Margins;
use crate::gait_problem::programme::RowViolation;
use crate::metrics::gait_rmse;
use crate::nlp::{NlpResult, NlpStatus, NonlinearProgram};
use serde::{Deserialize, Serialize};

/// How a solve ended. Only `Converged` is a gait that satisfies every constraint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SolveStatus {
    /// First-order optimal and feasible to tolerance.
    Converged,
    /// The constraint violation is at a stationary point: locally infeasible.
    Infeasible,
    /// No further progress could be made.
    Stalled,
    /// Iteration limit reached.
    IterationLimit,
    /// Time limit reached.
    TimeLimit,
    /// Cancelled through the token.
    Cancelled,
}

impl From<NlpStatus> for SolveStatus {
    fn from(status: NlpStatus) -> Self {
        match status {
            NlpStatus::Converged => SolveStatus::Converged,
            NlpStatus::Infeasible => SolveStatus::Infeasible,
            NlpStatus::IterationLimit => SolveStatus::IterationLimit,
            NlpStatus::TimeLimit => SolveStatus::TimeLimit,
            NlpStatus::Cancelled => SolveStatus::Cancelled,
            _ => SolveStatus::Stalled,
        }
    }
}

/// What a solve started from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StartedFrom {
    /// Its own cold start.
    Cold,
    /// The warm start that was given.
    Warm,
    /// A cold start after the given warm start did not converge.
    ColdAfterWarm,
}

/// One thing that a solve tried.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Attempt {
    /// What, in words.
    pub strategy: String,
    /// How it ended.
    pub status: SolveStatus,
    /// Iterations over its phases.
    pub iterations: usize,
    /// Wall time, s.
    pub seconds: f64,
    /// Objective where it ended.
    pub objective: f64,
    /// Gait RMSE where it ended, rad.
    pub gait_rmse_rad: f64,
    /// Why it could not be carried through, in words; empty when it could.
    #[serde(default)]
    pub reason: String,
    /// Which of the local optima that were found it ended in, from 1 in the order of the attempts; none where it did not
    /// converge. Attempts of one number ended in the same gait.
    #[serde(default)]
    pub basin: Option<usize>,
    /// Whether it is the answer.
    pub chosen: bool,
}

/// The first-order conditions of a local optimum, measured anew where the solve ended, as the solver scales them (by the
/// size of the multipliers, WB06 eq. 5), of the problem with its tightened bounds. With `max_violation` they are the certificate of a converged gait.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Optimality {
    /// Largest entry of the Lagrangian's gradient.
    pub dual_infeasibility: f64,
    /// Largest product of a distance to a bound and its multiplier.
    pub complementarity: f64,
    /// Last barrier parameter.
    pub barrier: f64,
}

/// What the linear algebra of a solve took, over all its attempts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
pub struct LinearAlgebra {
    /// Analysing the matrices' structure, once a phase, s.
    pub seconds_analysis: f64,
    /// Assembling and factorising, s.
    pub seconds_factorisation: f64,
    /// Substitutions, residuals and refinement, s.
    pub seconds_solves: f64,
    /// Numerical factorisations.
    pub factorisations: usize,
    /// Forward-backward substitutions, those of refinement included.
    pub substitutions: usize,
    /// Times a factorisation broke down or was not trusted, and another method was asked.
    pub fallbacks: usize,
}

impl LinearAlgebra {
    /// Adds what one phase took.
    pub(super) fn add_phase(&mut self, result: &NlpResult) {
        self.add(&Self {
            seconds_analysis: result.timing.analysis,
            seconds_factorisation: result.timing.factorisation,
            seconds_solves: result.timing.backsolves,
            factorisations: result.counts.factorisations,
            substitutions: result.counts.backsolves,
            fallbacks: result.counts.solver_fallbacks,
        });
    }

    /// Adds what another attempt took.
    pub(super) fn add(&mut self, other: &Self) {
        self.seconds_analysis += other.seconds_analysis;
        self.seconds_factorisation += other.seconds_factorisation;
        self.seconds_solves += other.seconds_solves;
        self.factorisations += other.factorisations;
        self.substitutions += other.substitutions;
        self.fallbacks += other.fallbacks;
    }

    fn seconds(&self) -> f64 {
        self.seconds_analysis + self.seconds_factorisation + self.seconds_solves
    }
}

/// The figures of one solve: a contract for scripts (`gaitwright solve --json`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SolveReport {
    /// How it ended.
    pub status: SolveStatus,
    /// What it started from.
    pub started_from: StartedFrom,
    /// Interior-point iterations over all phases.
    pub iterations: usize,
    /// Objective: cost of transport plus regularisation.
    pub objective: f64,
    /// Mechanical cost of transport, dimensionless.
    pub cost_of_transport: f64,
    /// Gait RMSE: sum over the five human coordinates, rad.
    pub gait_rmse_rad: f64,
    /// Its parts: torso, hip_L, knee_L, ankle_L, hip_R.
    pub gait_rmse_parts_rad: [f64; 5],
    /// Largest violation of any constraint row or bound, in scaled units.
    pub max_violation: f64,
    /// How well the conditions of a local optimum are met; `None` where that could not be measured, and in records of
    /// versions that did not say.
    #[serde(default)]
    pub optimality: Option<Optimality>,
    /// How many bounds at nodes are tightened so that the gait keeps them between the points too.
    #[serde(default)]
    pub tightened_bounds: usize,
    /// Wall time, s.
    pub seconds_total: f64,
    /// Evaluating functions and derivatives, s. This and what follows are sums over the attempts: of attempts side by side
    /// they may be more than the wall time.
    pub seconds_evaluation: f64,
    /// Linear algebra, s.
    pub seconds_linear_algebra: f64,
    /// Its parts; `None` in records of versions that did not say.
    #[serde(default)]
    pub linear_algebra: Option<LinearAlgebra>,
    /// Number of variables.
    pub variables: usize,
    /// Number of equality rows.
    pub equalities: usize,
    /// Number of inequality rows.
    pub inequalities: usize,
    /// Mean walking speed, m/s.
    pub speed_m_s: f64,
    /// Stride length, m.
    pub stride_length_m: f64,
    /// Durations of the eight domains, s.
    pub durations_s: [f64; 8],
    /// v_hip of the four impact-free runs, m/s.
    pub vhip_m_s: [f64; 4],
    /// Everything that was tried, in order; the figures above are those of the chosen one, iterations and seconds the
    /// sum.
    #[serde(default)]
    pub attempts: Vec<Attempt>,
}

/// A constraint row or bound that is not met, in words and numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Violation {
    /// Name of the row: domain, node, constraint, component.
    pub row: String,
    /// By how much, in `unit`.
    pub amount: f64,
    /// Unit of `amount`.
    pub unit: String,
}

/// A local optimum that the guesses of a solve reached beside the answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OtherBasin {
    /// Its number among the attempts.
    pub basin: usize,
    /// Objective there.
    pub objective: f64,
    /// Gait RMSE there, rad.
    pub gait_rmse_rad: f64,
    /// The gait, which keeps its bounds at its nodes; a solve from `warm_start` sees to it between them too.
    pub gait: Gait,
    /// For solving on in this basin.
    pub warm_start: WarmStart,
}

/// What a solve gives back, converged or not.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SolveOutcome {
    /// The figures.
    pub report: SolveReport,
    /// The last iterate as a gait. Only a gait to trust when the status is `Converged`.
    pub gait: Gait,
    /// For warm-starting another solve.
    pub warm_start: WarmStart,
    /// The most violated rows, worst first; empty when converged.
    pub violations: Vec<Violation>,
    /// The other local optima that were found, one gait each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub other_basins: Vec<OtherBasin>,
}

/// What all attempts of one solve cost together.
#[derive(Default)]
pub(super) struct Tally {
    pub(super) iterations: usize,
    pub(super) evaluation_s: f64,
    pub(super) linear_algebra: LinearAlgebra,
    pub(super) attempts: Vec<Attempt>,
}

/// Most violations reported.
const MAX_VIOLATIONS: usize = 20;

/// The outcome of the attempt that was chosen.
pub(super) fn outcome(
    context: &Context<'_>,
    choice: Choice,
    margins: &Margins,
    tally: Tally,
    started_from: StartedFrom,
) -> SolveOutcome {
    let (problem, programme) = (context.problem, context.programme);
    let Choice { result, gait, status, .. } = choice;
    let x = &result.x;
    let rmse = gait_rmse(&gait, &problem.reference);
    let margins = margins.bearing_on(programme, x);
    let violations = programme.violations(x);
    let parts = programme.objective_parts(x);
    let equalities = (0..programme.rows()).filter(|&r| programme.rows.lower[r] == programme.rows.upper[r]).count();
    let report = SolveReport {
        status,
        started_from,
        iterations: tally.iterations,
        objective: programme.objective(x),
        cost_of_transport: parts.cost_of_transport,
        gait_rmse_rad: rmse.total,
        gait_rmse_parts_rad: rmse.parts,
        max_violation: violations.first().map_or(0.0, |v| v.amount),
        optimality: Some(Optimality {
            dual_infeasibility: result.scaled_residuals.dual_infeasibility,
            complementarity: result.scaled_residuals.complementarity,
            barrier: result.mu,
        })
        .filter(|o| o.dual_infeasibility.is_finite() && o.complementarity.is_finite()),
        tightened_bounds: margins.count(),
        seconds_total: context.started.elapsed().as_secs_f64(),
        seconds_evaluation: tally.evaluation_s,
        seconds_linear_algebra: tally.linear_algebra.seconds(),
        linear_algebra: Some(tally.linear_algebra),
        variables: programme.variables(),
        equalities,
        inequalities: programme.rows() - equalities,
        speed_m_s: gait.speed_m_s,
        stride_length_m: gait.stride_length_m,
        durations_s: std::array::from_fn(|d| gait.domains[d].duration_s),
        vhip_m_s: gait.hip_velocity_m_s,
        attempts: tally.attempts,
    };
    let violations = if status == SolveStatus::Converged {
        Vec::new()
    } else {
        violations.iter().take(MAX_VIOLATIONS).map(|v| describe(programme, v)).collect()
    };
    let warm_start = warm_start(context, &result, margins);
    SolveOutcome { report, gait, warm_start, violations, other_basins: Vec::new() }
}

/// A gait of a basin of its own, as it was found.
pub(super) fn other_basin(context: &Context<'_>, choice: Choice, attempt: &Attempt, basin: usize) -> OtherBasin {
    OtherBasin {
        basin,
        objective: attempt.objective,
        gait_rmse_rad: attempt.gait_rmse_rad,
        warm_start: warm_start(context, &choice.result, Margins::default()),
        gait: choice.gait,
    }
}

fn warm_start(context: &Context<'_>, result: &NlpResult, margins: Margins) -> WarmStart {
    let problem = context.problem;
    WarmStart { muscles: problem.muscles, mesh: problem.settings.mesh, point: result.warm_point(), margins }
}

fn describe(programme: &GaitProgramme, violation: &RowViolation) -> Violation {
    if let Some(row) = violation.row {
        let name = &programme.rows.names[row];
        let (_, unit, scale) = name.kind.description();
        Violation { row: name.label(), amount: violation.amount * scale, unit: unit.to_owned() }
    } else {
        let variable = violation.variable.unwrap_or(0);
        let (label, unit) = programme.layout.variable_label(variable);
        Violation { row: label, amount: violation.amount * programme.layout.scale[variable], unit: unit.to_owned() }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::{LinearAlgebra, SolveReport};
    use serde_json::{Value, json};

    fn older() -> Value {
        json!({
            "status": "converged", "started_from": "cold", "iterations": 3, "objective": 0.06, "cost_of_transport": 0.05,
            "gait_rmse_rad": 0.5, "gait_rmse_parts_rad": [0.1, 0.1, 0.1, 0.1, 0.1], "max_violation": 1e-9,
            "seconds_total": 1.0, "seconds_evaluation": 0.1, "seconds_linear_algebra": 0.8, "variables": 8,
            "equalities": 4, "inequalities": 2, "speed_m_s": 1.0, "stride_length_m": 1.1,
            "durations_s": [0.1, 0.1, 0.3, 0.1, 0.1, 0.1, 0.3, 0.1], "vhip_m_s": [1.0, 1.0, 1.0, 1.0]
        })
    }

    #[test]
    fn a_report_of_an_older_version_is_read_and_says_nothing_of_the_parts() {
        let report: SolveReport = serde_json::from_value(older()).unwrap();
        assert_eq!((report.seconds_linear_algebra, report.linear_algebra), (0.8, None));
    }

    #[test]
    fn attempts_add_up() {
        let one = LinearAlgebra {
            seconds_analysis: 0.25,
            seconds_factorisation: 0.5,
            seconds_solves: 0.125,
            factorisations: 3,
            substitutions: 7,
            fallbacks: 1,
        };
        let mut sum = one;
        sum.add(&one);
        assert_eq!(sum.seconds(), 2.0 * one.seconds());
        assert_eq!((sum.factorisations, sum.substitutions, sum.fallbacks), (6, 14, 2));
    }
}
