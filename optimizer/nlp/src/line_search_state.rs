//! State of the line search between steps: work vectors and the watchdog.

use crate::formulation::Formulation;
use crate::primal_dual::PrimalDual;

/// Work vectors and watchdog.
pub(crate) struct LineSearchState {
    /// The last trial point, its rows and its objective.
    pub trial: Vec<f64>,
    pub trial_c: Vec<f64>,
    pub trial_objective: f64,
    pub corrected_c: Vec<f64>,
    pub corrected_rhs: Vec<f64>,
    pub correction: PrimalDual,
    /// Counts shortened steps: each adds two, each full step subtracts one, so that alternating steps trigger the
    /// watchdog too.
    pub shortened: usize,
    pub watch: Option<Watchdog>,
    /// Point and direction that the watchdog returns to.
    pub watched_point: PrimalDual,
    pub watched_direction: PrimalDual,
}

/// The watchdog: its reference, the length of its first step and the number of its trials.
#[derive(Clone, Copy)]
pub(crate) struct Watchdog {
    pub reference: MeritReference,
    pub alpha: f64,
    pub trials: usize,
}

impl LineSearchState {
    pub(crate) fn new(form: &Formulation) -> Self {
        Self {
            trial: vec![0.0; form.length()],
            trial_c: vec![0.0; form.m],
            trial_objective: f64::NAN,
            corrected_c: vec![0.0; form.m],
            corrected_rhs: vec![0.0; form.m],
            correction: PrimalDual::zeros(form),
            shortened: 0,
            watch: None,
            watched_point: PrimalDual::zeros(form),
            watched_direction: PrimalDual::zeros(form),
        }
    }

    /// Ends the watchdog, because the merit values have changed.
    pub(crate) fn end_watch(&mut self) {
        self.watch = None;
        self.shortened = 0;
    }
}

/// Merit values that trial points are compared with.
#[derive(Clone, Copy)]
pub(crate) struct MeritReference {
    pub theta: f64,
    pub phi: f64,
    /// Directional derivative of phi.
    pub slope: f64,
}
