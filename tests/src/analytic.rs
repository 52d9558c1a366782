//! An analytic solver: answers at once, deterministically, with a gait of the right shape.
//!
//! It is for tests of the service only; its figures do not describe walking.

use gait_learner::{Dimension, SearchSpace};
use gait_optimizer::body::{Axis, FootPoint, Side};
use gait_optimizer::gait::{ContactRowName, MuscleTrajectory};
use gait_optimizer::solve::{SolvePhase, StartedFrom};
use gait_optimizer::{
    CancelToken, DomainTrajectory, Gait, IterationRecord, LinearAlgebra, Margins, OtherLocalOptimum, SolveOutcome,
    SolveReport, SolveStatus, TunedBounds, UnchangedBound, Violation, WarmPoint, WarmStart,
};
use gaitwright_service::workers::{Assignment, Evaluate};
use gaitwright_store::TrialId;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Number of iterations that every analytic solve reports.
const ITERATIONS: usize = 12;

/// The analytic solver.
#[derive(Debug, Default)]
pub struct Analytic {
    /// Time between two iterations.
    pub pause: Duration,
    /// Trials with these numbers panic.
    pub panics: Vec<u32>,
    /// Trials with these numbers panic the first time only.
    pub panics_once: Vec<u32>,
    /// Number of solves that hang after their first iteration and ignore cancellation.
    pub hangs: u32,
    /// The objectives of trials with these numbers are those of another local optimum.
    pub jumps: Vec<u32>,
    /// Trials with these numbers converge from a cold start, because their warm start does not.
    pub cold_after_warm: Vec<u32>,
    /// Whether reports state for which bounds a gait is unchanged: every value of the bounds that this solver ignores.
    pub states_unchanged_bounds: bool,
    /// Number of other local optima that a converged cold start reaches.
    pub other_local_optima: usize,
    /// Number of started solves.
    pub begun: AtomicU32,
    /// Which solve made each iteration, in order: by the trial of its attempt.
    pub made: Arc<Mutex<Vec<TrialId>>>,
}

impl Analytic {
    /// With a pause between iterations.
    pub fn slow(pause: Duration) -> Self {
        Self { pause, ..Self::default() }
    }
}

/// Values of a bound that is never active here: two trials that start from the same gait find the same one.
pub fn inactive_bound() -> SearchSpace {
    let acceleration = Dimension { name: "a2".to_owned(), values: vec![70.0, 80.0, 90.0], lengthscale: 10.0 };
    SearchSpace::new(vec![acceleration]).unwrap()
}

impl Evaluate for Analytic {
    fn evaluate(
        &self,
        assignment: &Assignment,
        observer: &mut dyn FnMut(&IterationRecord),
        cancel: &CancelToken,
    ) -> Result<SolveOutcome, String> {
        let begun = self.begun.fetch_add(1, Ordering::SeqCst);
        assert!(!self.panics.contains(&assignment.number), "trial {} panics", assignment.number);
        assert!(!(self.panics_once.contains(&assignment.number) && begun == 0), "the first solve panics");
        let a = assignment.problem.bounds.to_array();
        // A value without a short decimal form, to test that stored values are read back exactly.
        let distance = (a[4] - 0.026).abs() * 10.0 + (a[5] - 0.3).abs() + (a[6] - 35.0).abs() / 50.0 + 1.0 / a[0];
        let warm = assignment.warm_start.as_ref().map_or(0.1, |w| w.point.x[0]);
        let rmse = 0.1 + distance / 3.0 + warm * 1e-3;
        let mut status = if a[4] > 0.03 && a[5] < 0.15 { SolveStatus::Infeasible } else { SolveStatus::Converged };
        for iteration in 0..ITERATIONS {
            if cancel.is_cancelled() {
                status = SolveStatus::Cancelled;
                break;
            }
            self.made.lock().unwrap().push(assignment.attempt.trial);
            let decay = 0.5_f64.powi(i32::try_from(iteration).unwrap_or(0));
            observer(&IterationRecord {
                iteration,
                phase: SolvePhase::Cost,
                objective: 0.2 + decay,
                constraint_violation: decay,
                dual_infeasibility: decay,
                barrier: decay * 0.1,
                step: 1.0,
                guess: 0,
            });
            if begun < self.hangs {
                loop {
                    std::thread::park();
                }
            }
            std::thread::sleep(self.pause);
        }
        let mut outcome = outcome(assignment, status, rmse);
        if self.jumps.contains(&assignment.number) {
            outcome.report.objective += 0.1;
        }
        if self.cold_after_warm.contains(&assignment.number) {
            outcome.report.started_from = StartedFrom::ColdAfterWarm;
        }
        if self.states_unchanged_bounds && status == SolveStatus::Converged {
            outcome.report.unchanged_bounds = unchanged_bounds(a);
        }
        if outcome.report.status == SolveStatus::Converged && assignment.warm_start.is_none() {
            outcome.other_local_optima = other_local_optima(assignment, &outcome, self.other_local_optima);
        }
        Ok(outcome)
    }
}

/// Local optima with the numbers after that of the outcome.
fn other_local_optima(assignment: &Assignment, outcome: &SolveOutcome, most: usize) -> Vec<OtherLocalOptimum> {
    let other = |number: usize| {
        let gait_rmse_rad = outcome.report.gait_rmse_rad + 0.1 * number as f64;
        OtherLocalOptimum {
            local_optimum: number,
            objective: outcome.report.objective + 0.1,
            gait_rmse_rad,
            gait: gait(assignment, gait_rmse_rad),
            warm_start: outcome.warm_start.clone(),
        }
    };
    (2..most + 2).map(other).collect()
}

fn unchanged_bounds(action: [f64; TunedBounds::COUNT]) -> Vec<UnchangedBound> {
    let used = ["a1", "a5", "a6", "a7"];
    let of = |(name, value): (&str, f64)| {
        let only = Some(value).filter(|_| used.contains(&name));
        UnchangedBound { bound: name.to_owned(), least: only, most: only }
    };
    TunedBounds::NAMES.into_iter().zip(action).map(of).collect()
}

fn outcome(assignment: &Assignment, status: SolveStatus, rmse: f64) -> SolveOutcome {
    let violations = if status == SolveStatus::Converged {
        Vec::new()
    } else {
        vec![Violation { row: "SS2_R node 3, swing foot clearance".to_owned(), amount: 0.004, unit: "m".to_owned() }]
    };
    SolveOutcome {
        other_local_optima: Vec::new(),
        report: SolveReport {
            status,
            started_from: if assignment.warm_start.is_some() { StartedFrom::Warm } else { StartedFrom::Cold },
            iterations: ITERATIONS,
            // Differences are so small that they show no other local optimum.
            objective: 0.2 + 5e-4 * rmse,
            cost_of_transport: 0.2 + rmse / 10.0,
            gait_rmse_rad: rmse,
            gait_rmse_parts_rad: [rmse / 5.0; 5],
            max_violation: if status == SolveStatus::Converged { 1e-9 } else { 0.004 },
            optimality: None,
            tightened_bounds: 0,
            unchanged_bounds: Vec::new(),
            seconds_total: 0.01,
            seconds_evaluation: 0.005,
            seconds_linear_algebra: 0.005,
            linear_algebra: Some(LinearAlgebra {
                seconds_factorisation: 0.004,
                seconds_solves: 0.001,
                factorisations: ITERATIONS,
                substitutions: 2 * ITERATIONS,
                ..LinearAlgebra::default()
            }),
            variables: 8,
            equalities: 4,
            inequalities: 2,
            speed_m_s: 1.1,
            stride_length_m: 1.3,
            durations_s: [0.1, 0.1, 0.3, 0.1, 0.1, 0.1, 0.3, 0.1],
            vhip_m_s: [1.0; 4],
            solver_runs: vec![gait_optimizer::SolverRun {
                strategy: "analytic".to_owned(),
                status: SolveStatus::Converged,
                iterations: 3,
                seconds: 0.0,
                objective: 0.1,
                gait_rmse_rad: rmse,
                reason: String::new(),
                local_optimum: Some(1),
                chosen: true,
            }],
        },
        gait: gait(assignment, rmse),
        warm_start: WarmStart {
            muscles: assignment.problem.muscles,
            mesh: assignment.problem.settings.mesh,
            point: WarmPoint {
                x: vec![rmse; 8],
                row_multipliers: vec![rmse / 3.0; 6],
                lower_multipliers: vec![0.1; 8],
                upper_multipliers: vec![0.1; 8],
                slacks: Vec::new(),
                slack_lower_multipliers: Vec::new(),
                slack_upper_multipliers: Vec::new(),
            },
            margins: Margins::default(),
        },
        violations,
    }
}

fn gait(assignment: &Assignment, rmse: f64) -> Gait {
    let names = ["DS2_R", "DS3_R", "SS2_R", "SS1_R", "DS2_L", "DS3_L", "SS2_L", "SS1_L"];
    let problem = &assignment.problem;
    let points = 9;
    let domain = |(index, name): (usize, &&str)| {
        let phase = |i: usize| (index as f64 + i as f64 / (points - 1) as f64) / 8.0 * std::f64::consts::TAU;
        let wave = |i: usize, shift: f64| 0.3 * (phase(i) + shift).sin() + rmse * 0.01;
        let knee = |i: usize, shift: f64| 0.5 - 0.4 * (phase(i) + shift).cos();
        let q = |i: usize| {
            [
                1.3 * phase(i) / std::f64::consts::TAU,
                0.9,
                0.1,
                wave(i, std::f64::consts::PI),
                knee(i, std::f64::consts::PI),
                wave(i, 2.0),
                wave(i, 0.0),
                knee(i, 0.0),
                0.1,
            ]
        };
        let row = |point, axis| ContactRowName { point, side: if index < 4 { Side::Right } else { Side::Left }, axis };
        DomainTrajectory {
            name: (*name).to_owned(),
            duration_s: 0.15,
            time_s: (0..points).map(|i| 0.15 * (index as f64 + i as f64 / (points - 1) as f64)).collect(),
            q: (0..points).map(q).collect(),
            qd: vec![[0.1; 9]; points],
            qdd: vec![[0.2; 9]; points],
            u: (0..points).map(|i| [40.0 * wave(i, 0.5); 6]).collect(),
            contact_rows: vec![row(FootPoint::Heel, Axis::X), row(FootPoint::Heel, Axis::Z)],
            contact_forces: (0..points).map(|i| vec![50.0 * wave(i, 0.0), 650.0 + 100.0 * wave(i, 1.0)]).collect(),
            muscles: problem.muscles.then(|| MuscleTrajectory {
                fibre_length: vec![[1.0; 10]; points],
                fibre_velocity: vec![[0.0; 10]; points],
                activation: (0..points).map(|i| [0.2 + wave(i, 0.0).abs(); 10]).collect(),
            }),
            outputs: vec![2, 3],
            bezier: vec![vec![0.0; 6]; 2],
            phase_start_m: 0.0,
            phase_end_m: 0.1,
            impulse: None,
        }
    };
    Gait {
        format_version: 1,
        subject: problem.subject,
        device: problem.device.clone(),
        muscles: problem.muscles,
        bounds: problem.bounds,
        settings: problem.settings,
        speed_m_s: 1.1,
        stride_length_m: 1.3,
        right_step_length_m: 0.65,
        stride_time_s: 1.2,
        hip_velocity_m_s: [1.0; 4],
        domains: names.iter().enumerate().map(domain).collect(),
    }
}
