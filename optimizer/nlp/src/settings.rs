//! Settings of the solver, each with its meaning, default, range and source.
//!
//! "WB06" is Wächter & Biegler, *On the implementation of an interior-point filter line-search algorithm for
//! large-scale nonlinear programming*, Math. Program. 106 (2006); symbols in brackets are that paper's.

use serde::{Deserialize, Serialize};

use crate::method_constants::MethodConstants;
use crate::status::NlpError;

/// How the barrier parameter mu is driven to zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum BarrierStrategy {
    /// Fiacco-McCormick: mu is reduced each time the barrier problem is solved to `kappa_epsilon * mu` (WB06 section
    /// 2.1).
    #[default]
    Monotone,
    /// In each iteration by the LOQO rule (Vanderbei & Shanno 1999; Nocedal & Wright section 19.3) while the
    /// optimality error decreases, otherwise monotone until it decreases again.
    Adaptive,
}

/// Initial bound multipliers of a cold start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum BoundMultiplierStart {
    /// z = 1 (WB06 section 3.6).
    #[default]
    One,
    /// z = mu / slack, so that complementarity holds at the start. Better when `mu_initial` is small.
    Centred,
}

/// Factorisation of the KKT systems.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum LinearSolver {
    /// Multifrontal with elimination blocks, supernodal without; delayed pivots where solutions are inaccurate before
    /// refinement.
    #[default]
    Auto,
    /// Supernodal LBL^T with Bunch-Kaufman pivoting inside supernodes; one dense front for matrices of order up to 120.
    /// Needs the feature `supernodal`, as do larger problems without elimination blocks; without it, it is refused.
    Supernodal,
    /// Static multifrontal LBL^T over the elimination blocks, with Bunch-Kaufman pivoting inside fronts.
    Multifrontal,
    /// Multifrontal LBL^T with threshold pivoting and delayed pivots: slow and reliable.
    DelayedPivots,
}

/// Settings of [`solve`](crate::solve). The default is a good general choice. Numbers without a stated
/// range are positive, counts are zero or more.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct NlpSettings {
    /// Scaled optimality error below which a point is converged. Default 1e-8 (WB06 epsilon_tol).
    pub tolerance: f64,
    /// Largest unscaled |g - bounds| and |x - bounds| of a converged point. Default 1e-6 (tighter than IPOPT's 1e-4).
    pub violation_tolerance: f64,
    /// Largest unscaled complementarity product of a converged point. Default 1e-4 (IPOPT `compl_inf_tol`).
    pub complementarity_tolerance: f64,
    /// Iterations (restoration phase included) before [`NlpStatus::IterationLimit`](crate::NlpStatus). Default 1000.
    pub max_iterations: usize,
    /// Wall time in seconds before [`NlpStatus::TimeLimit`](crate::NlpStatus). Default infinity (JSON: null). From 0.
    /// With a finite limit, equal inputs give equal bits only if the solve ends before it.
    #[serde(with = "infinite_as_null")]
    pub max_seconds: f64,

    /// Barrier strategy. Default monotone.
    pub barrier_strategy: BarrierStrategy,
    /// Initial barrier parameter of a cold start. Default 0.1 (WB06 mu_0). Small values preserve a good starting point.
    /// A warm start begins with the average complementarity of its point, at most this.
    pub mu_initial: f64,

    /// Relaxation of every bound, relative to max(1, |bound|). Default 1e-8 (WB06 section 3.5).
    /// 0 to `violation_tolerance`.
    pub bound_relaxation: f64,
    /// Smallest distance of a cold start from its bounds, relative to max(1, |bound|) and to the distance between two
    /// bounds, whichever is smaller. Default 0.01 (WB06 kappa_1, kappa_2). Up to 0.5.
    pub bound_push: f64,
    /// [`bound_push`](Self::bound_push) of a warm start. Default 1e-6. Up to 0.5.
    pub warm_bound_push: f64,
    /// Initial bound multipliers of a cold start. Default one.
    pub bound_multiplier_start: BoundMultiplierStart,

    /// Gradient-based scaling at the start: objective and rows are scaled down until their largest derivative is
    /// this. `None`: no scaling (the problem is scaled by hand). Default none. IPOPT uses 100.
    pub gradient_scaling: Option<f64>,

    /// Until the unscaled violation has first reached this value, the Hessian is that of the objective alone. Far
    /// from a feasible point large multipliers give the rows a curvature that leads to regularisation and short
    /// steps. Default infinite (JSON: null): always the exact Hessian. From 0.
    #[serde(with = "infinite_as_null")]
    pub curvature_from_violation: f64,
    /// First regularisation of the Hessian. Default 1e-4 (WB06 delta_w^0).
    pub hessian_regularisation_first: f64,
    /// After two consecutive iterations in which the unregularised matrix had the wrong inertia, this many iterations
    /// at most start with a decreasing regularisation instead of the unregularised matrix, one more for each further
    /// time. Default 0 (WB06: start without).
    pub regularisation_memory: usize,
    /// Initial weight of the proximal term after steps that the line search shortened often; 0: none. Default 1e-4. 0
    /// to 1e4.
    pub proximal_first: f64,

    /// Second-order corrections per iteration. Default 4 (WB06 p^max).
    pub max_second_order_corrections: usize,

    /// The restoration phase ends when the violation is reduced to this fraction and the filter accepts the point.
    /// Default 0.9 (WB06 kappa_resto). 0 to 0.999999.
    pub required_reduction: f64,
    /// Consecutive steps below 0.05 after which the restoration phase starts without a failed line search: iterates
    /// close to their bounds with growing multipliers rarely recover. Default 5; 0: never.
    pub short_step_limit: usize,

    /// Factorisation. Default auto.
    pub linear_solver: LinearSolver,
    /// Threads of the multifrontal factorisation, 1 to 16. The result does not depend on it; small matrices use one
    /// thread. Default 1.
    pub threads: usize,

    #[doc(hidden)]
    #[serde(skip)]
    pub constants: MethodConstants,
}

impl Default for NlpSettings {
    fn default() -> Self {
        Self {
            tolerance: 1e-8,
            violation_tolerance: 1e-6,
            complementarity_tolerance: 1e-4,
            max_iterations: 1000,
            max_seconds: f64::INFINITY,
            barrier_strategy: BarrierStrategy::default(),
            mu_initial: 0.1,
            bound_relaxation: 1e-8,
            bound_push: 0.01,
            warm_bound_push: 1e-6,
            bound_multiplier_start: BoundMultiplierStart::default(),
            gradient_scaling: None,
            curvature_from_violation: f64::INFINITY,
            hessian_regularisation_first: 1e-4,
            regularisation_memory: 0,
            proximal_first: 1e-4,
            max_second_order_corrections: 4,
            required_reduction: 0.9,
            short_step_limit: 5,
            linear_solver: LinearSolver::default(),
            threads: 1,
            constants: MethodConstants::default(),
        }
    }
}

impl NlpSettings {
    /// Checks every range.
    ///
    /// # Errors
    /// [`NlpError::InvalidSetting`] names the first field out of range, its value and the range; [`NlpError::NotBuiltIn`]
    /// names a setting that needs a missing feature.
    pub fn validate(&self) -> Result<(), NlpError> {
        let positive = |field: &'static str, value: f64| in_range(field, value, f64::MIN_POSITIVE, f64::MAX);
        positive("tolerance", self.tolerance)?;
        positive("violation_tolerance", self.violation_tolerance)?;
        positive("complementarity_tolerance", self.complementarity_tolerance)?;
        in_range("max_seconds", self.max_seconds, 0.0, f64::INFINITY)?;
        positive("mu_initial", self.mu_initial)?;
        in_range("bound_relaxation", self.bound_relaxation, 0.0, self.violation_tolerance)?;
        in_range("bound_push", self.bound_push, f64::MIN_POSITIVE, 0.5)?;
        in_range("warm_bound_push", self.warm_bound_push, f64::MIN_POSITIVE, 0.5)?;
        if let Some(limit) = self.gradient_scaling {
            positive("gradient_scaling", limit)?;
        }
        in_range("curvature_from_violation", self.curvature_from_violation, 0.0, f64::INFINITY)?;
        positive("hessian_regularisation_first", self.hessian_regularisation_first)?;
        in_range("proximal_first", self.proximal_first, 0.0, 1e4)?;
        in_range("required_reduction", self.required_reduction, 0.0, 0.999_999)?;
        in_range("threads", self.threads as f64, 1.0, 16.0)?;
        self.linear_solver.validate()
    }
}

impl LinearSolver {
    /// Refuses a factorisation that this build does not have.
    fn validate(self) -> Result<(), NlpError> {
        if self == Self::Supernodal && !cfg!(feature = "supernodal") {
            return Err(NlpError::NotBuiltIn { field: "linear_solver", value: "supernodal", feature: "supernodal" });
        }
        Ok(())
    }
}

fn in_range(field: &'static str, value: f64, low: f64, high: f64) -> Result<(), NlpError> {
    if value >= low && value <= high { Ok(()) } else { Err(NlpError::InvalidSetting { field, value, low, high }) }
}

/// JSON has no infinity, so an infinite limit is null.
mod infinite_as_null {
    use serde::{Deserialize, Deserializer, Serializer};

    #[allow(clippy::trivially_copy_pass_by_ref)] // the signature serde asks for
    pub(crate) fn serialize<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        if value.is_finite() { serializer.serialize_some(value) } else { serializer.serialize_none() }
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::INFINITY))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factorisation_that_is_not_built_in_is_refused() {
        let settings = NlpSettings { linear_solver: LinearSolver::Supernodal, ..NlpSettings::default() };
        assert_eq!(settings.validate().is_ok(), cfg!(feature = "supernodal"));
        assert!(NlpSettings::default().validate().is_ok());
    }
}
