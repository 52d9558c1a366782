//! The state of the iteration on one formulation: iterate, derivatives, filter and barrier parameter.

use std::time::Instant;

use crate::barrier;
use crate::formulation::{Formulation, Objective, RowForm};
use crate::inertia_correction::InertiaCorrection;
use crate::line_search_filter::Filter;
use crate::line_search_state::LineSearchState;
use crate::newton_system::NewtonSystem;
use crate::optimality::OptimalityError;
use crate::primal_dual::{Linearisation, PrimalDual};
use crate::settings::NlpSettings;
use crate::status::{NlpCounts, NlpIteration, NlpPhase};

/// The data that the problem and its restoration phases share in one solve.
pub(crate) struct SolveSession<'a> {
    pub settings: &'a NlpSettings,
    pub observer: &'a mut dyn FnMut(&NlpIteration),
    pub cancel: &'a dyn Fn() -> bool,
    pub started: Instant,
    pub newton: NewtonSystem,
    pub iterations: usize,
    pub counts: NlpCounts,
    pub last_step: StepRecord,
}

/// The step that led to an iterate.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct StepRecord {
    pub alpha_primal: f64,
    pub alpha_dual: f64,
    pub delta_w: f64,
    pub delta_c: f64,
    pub trials: usize,
}

/// How the iteration on a formulation ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum IterationEnd {
    Converged,
    /// The restoration phase reached an acceptable point.
    Left,
    Infeasible,
    Stalled,
    Unbounded,
    IterationLimit,
    TimeLimit,
    Cancelled,
}

/// Iterate, derivatives and globalisation state on one formulation.
pub(crate) struct Iterate<'p> {
    pub form: Formulation<'p>,
    pub point: PrimalDual,
    pub at: Linearisation,
    pub objective: f64,
    pub c: Vec<f64>,
    pub gradient: Vec<f64>,
    /// grad F + A^T y - z_L + z_U.
    pub lagrangian: Vec<f64>,
    pub mu: f64,
    pub filter: Filter,
    pub theta_min: f64,
    pub correction: InertiaCorrection,
    pub direction: PrimalDual,
    pub rhs: PrimalDual,
    pub search: LineSearchState,
    pub free_mu: FreeMu,
    /// Work vector: the rows without elastic variables.
    own_rows: Vec<f64>,
    /// Whether the Hessian includes the rows (`NlpSettings::curvature_from_violation`).
    pub rows_curve: bool,
}

/// State of the adaptive barrier strategy.
#[derive(Debug, Clone, Default)]
pub(crate) struct FreeMu {
    /// In the free mode (otherwise in the monotone mode).
    pub free: bool,
    /// The most recent optimality errors.
    pub recent: Vec<f64>,
}

fn unscaled_violation(c: &[f64], scale: &[f64]) -> f64 {
    c.iter().zip(scale).fold(0.0, |v: f64, (c, s)| if c.is_nan() { f64::INFINITY } else { v.max(c.abs() / s) })
}

impl<'p> Iterate<'p> {
    /// An iterate at a point strictly inside its bounds, not evaluated yet.
    pub(crate) fn new(form: Formulation<'p>, point: PrimalDual, mu: f64) -> Self {
        let length = form.length();
        let at = Linearisation {
            jacobian: vec![0.0; form.program.jacobian_pattern().row_indices.len()],
            hessian: vec![0.0; form.program.hessian_pattern().row_indices.len()],
            slack_lower: vec![f64::INFINITY; length],
            slack_upper: vec![f64::INFINITY; length],
        };
        Self {
            at,
            objective: 0.0,
            c: vec![0.0; form.m],
            own_rows: vec![0.0; form.m],
            gradient: vec![0.0; length],
            lagrangian: vec![0.0; length],
            mu,
            filter: Filter::default(),
            theta_min: 0.0,
            correction: InertiaCorrection::default(),
            direction: PrimalDual::zeros(&form),
            rhs: PrimalDual::zeros(&form),
            search: LineSearchState::new(&form),
            free_mu: FreeMu { free: true, recent: Vec::new() },
            rows_curve: false,
            point,
            form,
        }
    }

    /// Computes the slacks of the bounds. A bound whose slack is lost to rounding is moved (WB06 section 3.5).
    pub(crate) fn measure_slacks(&mut self) {
        let smallest = f64::EPSILON * self.mu.min(1.0);
        let movement = f64::EPSILON.powf(0.75);
        let moves = self.form.constants.moves_bounds;
        for j in 0..self.form.length() {
            let (l, u, w) = (self.form.lower[j], self.form.upper[j], self.point.w[j]);
            if l.is_finite() {
                self.at.slack_lower[j] = w - l;
                if w - l < smallest && moves {
                    let slack = (self.mu / self.point.zl[j]).max(smallest).min(movement * l.abs().max(1.0));
                    self.form.lower[j] = w - slack;
                    self.at.slack_lower[j] = (w - self.form.lower[j]).max(f64::MIN_POSITIVE);
                }
            }
            if u.is_finite() {
                self.at.slack_upper[j] = u - w;
                if u - w < smallest && moves {
                    let slack = (self.mu / self.point.zu[j]).max(smallest).min(movement * u.abs().max(1.0));
                    self.form.upper[j] = w + slack;
                    self.at.slack_upper[j] = (self.form.upper[j] - w).max(f64::MIN_POSITIVE);
                }
            }
        }
    }

    /// Evaluates objective, rows and first derivatives at the point.
    pub(crate) fn evaluate(&mut self) {
        self.measure_slacks();
        self.objective = self.form.objective(&self.point.w);
        self.form.constraints(&self.point.w, &mut self.c);
        self.linearise();
    }

    /// Evaluates the first derivatives at the point.
    pub(crate) fn linearise(&mut self) {
        self.form.gradient(&self.point.w, &mut self.gradient);
        self.form.jacobian(&self.point.w, &mut self.at.jacobian);
    }

    /// Whether all first-order values are finite.
    pub(crate) fn is_finite(&self) -> bool {
        self.objective.is_finite()
            && [&self.c, &self.gradient, &self.at.jacobian].iter().all(|v| v.iter().all(|x| x.is_finite()))
    }

    /// theta = |c|_1.
    pub(crate) fn theta(&self) -> f64 {
        self.c.iter().map(|v| v.abs()).sum()
    }

    /// phi_mu.
    pub(crate) fn phi(&self) -> f64 {
        self.objective + barrier::barrier_term(&self.form, &self.point.w, self.mu)
    }

    /// Sets the limits of the filter by the violation at the start (WB06 section 2.3).
    pub(crate) fn begin_filter(&mut self) {
        let theta = self.theta().max(1.0);
        self.filter = Filter::new(1e4 * theta);
        self.theta_min = 1e-4 * theta;
    }

    pub(crate) fn update_lagrangian(&mut self) {
        self.lagrangian.copy_from_slice(&self.gradient);
        self.form.add_transpose(&self.at.jacobian, &self.point.y, &mut self.lagrangian);
        for j in 0..self.form.length() {
            self.lagrangian[j] += self.point.zu[j] - self.point.zl[j];
        }
    }

    pub(crate) fn optimality(&self, mu: f64) -> OptimalityError {
        OptimalityError::new(&self.form, &self.point, &self.at, &self.c, &self.lagrangian, mu)
    }

    /// Largest violation of the rows, unscaled; infinite for NaN.
    pub(crate) fn largest_violation(&self) -> f64 {
        unscaled_violation(&self.c, &self.form.row_scale)
    }

    /// Largest violation of the rows of the program, unscaled, without elastic variables.
    pub(crate) fn program_violation(&mut self) -> f64 {
        let Objective::Restoration { first, .. } = self.form.objective else { return self.largest_violation() };
        self.own_rows.copy_from_slice(&self.c);
        for (a, t) in self.form.row_variables.iter().zip(&self.point.w[self.form.n..]).skip(first) {
            self.own_rows[a.row] -= a.sign * t;
        }
        unscaled_violation(&self.own_rows, &self.form.row_scale)
    }

    pub(crate) fn current_optimality(&mut self) -> OptimalityError {
        self.update_lagrangian();
        self.optimality(0.0)
    }

    pub(crate) fn phase(&self) -> NlpPhase {
        match self.form.objective {
            Objective::Program => NlpPhase::Regular,
            Objective::Restoration { .. } => NlpPhase::Restoration,
        }
    }

    /// Value of each row by its form: the unscaled slack of an inequality, the target of an equality.
    pub(crate) fn row_slacks(&self) -> Vec<f64> {
        (0..self.form.m)
            .map(|i| match self.form.rows[i] {
                RowForm::Equality(target) => target / self.form.row_scale[i],
                RowForm::Inequality(k) => self.point.w[self.form.n + k] / self.form.row_scale[i],
                RowForm::Free => 0.0,
            })
            .collect()
    }
}
