//! The variants: each changes one setting or mechanism.

use gait_optimizer::InitialGuess;
use interior_point::{BarrierStrategy, BoundMultiplierStart, LinearSolver};

use crate::instances::Target;

pub(crate) struct Variant {
    pub name: &'static str,
    pub change: Box<dyn Fn(&mut Target) + Sync>,
}

fn variant(name: &'static str, change: impl Fn(&mut Target) + Sync + 'static) -> Variant {
    Variant { name, change: Box::new(change) }
}

/// Sets a field of the settings, or of the constants of the method.
macro_rules! set {
    ($name:literal, constants.$field:ident = $value:expr) => {
        variant($name, |target| target.settings.constants.$field = $value)
    };
    ($name:literal, $field:ident = $value:expr) => {
        variant($name, |target| target.settings.$field = $value)
    };
}

/// Infinite limits are 1e300, because settings are written as JSON.
pub(crate) fn all() -> Vec<Variant> {
    vec![
        // Termination.
        set!("complementarity_tolerance: none", complementarity_tolerance = 1e300),
        set!("dual_tolerance: none", constants.dual_tolerance = 1e300),
        set!("divergence_limit: none", constants.divergence_limit = 1e300),
        // Barrier.
        set!("barrier_strategy: adaptive", barrier_strategy = BarrierStrategy::Adaptive),
        set!("mu_initial: 0.01", mu_initial = 0.01),
        set!("kappa_epsilon: 1", constants.kappa_epsilon = 1.0),
        set!("kappa_epsilon: 100", constants.kappa_epsilon = 100.0),
        set!("kappa_mu: 0.05", constants.kappa_mu = 0.05),
        set!("theta_mu: 1 (linear)", constants.theta_mu = 1.0),
        set!("tau_min: 0.9", constants.tau_min = 0.9),
        set!("tau_min: 0.999", constants.tau_min = 0.999),
        set!("damping: off", constants.damping = 0.0),
        set!("kappa_sigma: off", constants.kappa_sigma = f64::INFINITY),
        set!("moves_bounds: off", constants.moves_bounds = false),
        // Start.
        set!("bound_relaxation: 0", bound_relaxation = 0.0),
        set!("bound_push: 1e-4", bound_push = 1e-4),
        variant("bound_push: 0.1 (gaits 0.01)", |target| {
            target.settings.bound_push = if target.is_gait { 0.01 } else { 0.1 };
        }),
        variant("bound_multiplier_start: other", |target| {
            target.settings.bound_multiplier_start = match target.settings.bound_multiplier_start {
                BoundMultiplierStart::One => BoundMultiplierStart::Centred,
                BoundMultiplierStart::Centred => BoundMultiplierStart::One,
            };
        }),
        set!("warm_multiplier_push: none", constants.warm_multiplier_push = 1e-300),
        set!("least-squares multipliers: off", constants.multiplier_limit = 0.0),
        set!("multiplier_limit: none", constants.multiplier_limit = 1e300),
        set!("gradient_scaling: 100", gradient_scaling = Some(100.0)),
        // Regularisation.
        variant("curvature_from: off (others 0.03)", |target| {
            if target.is_gait {
                target.guess = InitialGuess { curvature_from: 1e6, ..target.guess };
            } else {
                target.settings.curvature_from_violation = 0.03;
            }
        }),
        set!("hessian_regularisation_first: 1e-2", hessian_regularisation_first = 1e-2),
        set!("hessian_regularisation_min: 1e-8", constants.hessian_regularisation_min = 1e-8),
        set!("hessian_regularisation_max: none", constants.hessian_regularisation_max = 1e300),
        variant("regularisation_memory: off (others 4)", |target| {
            target.settings.regularisation_memory = if target.is_gait { 0 } else { 4 };
        }),
        set!("proximal term: off", proximal_first = 0.0),
        set!("dual_regularisation_value: 1e-6", constants.dual_regularisation_value = 1e-6),
        // Linear algebra.
        set!("residual_target: 1e-10", constants.residual_target = 1e-10),
        set!("residual_limit: none", constants.residual_limit = 1e300),
        set!("refinement: off", constants.max_refinements = 0),
        set!("refinements: at most 1", constants.max_refinements = 1),
        set!("distrusts_unrefined: off", constants.distrusts_unrefined = false),
        set!("doubts: off", constants.doubts = 0),
        set!("two_stage_fronts: off", constants.two_stage_fronts = false),
        set!("roomy_fronts: off", constants.roomy_fronts = false),
        set!("linear_solver: multifrontal", linear_solver = LinearSolver::Multifrontal),
        set!("linear_solver: supernodal", linear_solver = LinearSolver::Supernodal),
        set!("linear_solver: delayed pivots", linear_solver = LinearSolver::DelayedPivots),
        // Line search.
        set!("second-order corrections: off", max_second_order_corrections = 0),
        variant("second-order corrections: 1 (gaits 4)", |target| {
            target.settings.max_second_order_corrections = if target.is_gait { 4 } else { 1 };
        }),
        set!("watchdog: off", constants.watchdog_trigger = 0),
        set!("watchdog_trials: 1", constants.watchdog_trials = 1),
        // Restoration.
        set!("short_step_limit: off", short_step_limit = 0),
        set!("required_reduction: 0.1", required_reduction = 0.1),
        set!("elastic_weight: 10", constants.elastic_weight = 10.0),
        set!("restoration phases: 0", constants.max_restoration_phases = 0),
        set!("restoration phases: 3", constants.max_restoration_phases = 3),
        set!("steps_multipliers: off", constants.steps_multipliers = false),
        set!("multiplier_reset: off", constants.multiplier_reset = f64::INFINITY),
    ]
}
