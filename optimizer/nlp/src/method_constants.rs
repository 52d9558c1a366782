//! Constants of the method.
//!
//! "WB06" is the paper of the [settings](crate::settings).

/// Constants and mechanisms of the method that no caller has a reason to change. They are values rather than `const`s
/// so that `optimizer/examples/ablation` can change or switch off one at a time, which is how each of them is justified
/// (docs/benchmarks.md).
#[doc(hidden)]
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)] // documented, but not part of the interface
pub struct MethodConstants {
    /// Largest unscaled gradient of the Lagrangian of a converged point (IPOPT `dual_inf_tol`).
    pub dual_tolerance: f64,
    /// |x| beyond which the problem is called unbounded (IPOPT `diverging_iterates_tol`).
    pub divergence_limit: f64,

    /// Error tolerance of a barrier problem, in units of mu (WB06 kappa_epsilon).
    pub kappa_epsilon: f64,
    /// Linear decrease of mu (WB06 kappa_mu).
    pub kappa_mu: f64,
    /// Superlinear decrease mu^theta_mu (WB06 theta_mu).
    pub theta_mu: f64,
    /// Smallest fraction to the boundary (WB06 tau_min).
    pub tau_min: f64,
    /// Linear damping of variables with one bound (WB06 kappa_d); 0: none.
    pub damping: f64,
    /// Bound multipliers stay within this factor of mu / slack (WB06 kappa_Sigma); infinite: anywhere.
    pub kappa_sigma: f64,
    /// Whether a bound whose slack is lost to rounding is moved (WB06 section 3.5).
    pub moves_bounds: bool,

    /// Smallest bound multiplier of a warm start.
    pub warm_multiplier_push: f64,
    /// Least-squares row multipliers larger than this are replaced by zero, as are those whose system is not solved to
    /// `residual_limit` (WB06 lambda_max). 0: no least-squares multipliers.
    pub multiplier_limit: f64,

    /// Smallest regularisation of the Hessian (WB06 delta_w^min).
    pub hessian_regularisation_min: f64,
    /// Regularisation of the Hessian that counts as failure.
    pub hessian_regularisation_max: f64,
    /// delta_c = this * mu^(1/4) (WB06 delta_c bar, kappa_c).
    pub dual_regularisation_value: f64,

    /// Relative residual of the full KKT system at which iterative refinement stops.
    pub residual_target: f64,
    /// Relative residual above which a step is rejected and the matrix treated as singular. Above it before
    /// refinement, the matrix is factorised with delayed pivots.
    pub residual_limit: f64,
    /// Refinement steps per system.
    pub max_refinements: usize,
    /// Whether a large residual before refinement is a reason to reject the factorisation.
    pub distrusts_unrefined: bool,
    /// After this many consecutive distrusted matrices, the next ones go to the most trusted factorisation directly; 0:
    /// never.
    pub doubts: usize,
    /// Whether fronts eliminate equality rows and their variables in two stages.
    pub two_stage_fronts: bool,
    /// Whether fronts with more room for deferred pivots come before delayed pivots when a factorisation breaks down.
    pub roomy_fronts: bool,

    /// Shortened steps that start the watchdog, which takes full steps without testing them and returns if none
    /// becomes acceptable; 0: never. A full step cancels half a shortened one (IPOPT
    /// `watchdog_shortened_iter_trigger`).
    pub watchdog_trigger: usize,
    /// Full steps of the watchdog (IPOPT `watchdog_trial_iter_max`).
    pub watchdog_trials: usize,

    /// Weight of the l1 violation in the restoration phase (WB06 rho).
    pub elastic_weight: f64,
    /// Largest number of restoration phases, after which the solve is stalled.
    pub max_restoration_phases: usize,
    /// Whether bound multipliers take the Newton step that belongs to the movement of the phase.
    pub steps_multipliers: bool,
    /// Bound multipliers above this are reset after the phase (IPOPT `bound_mult_reset_threshold`).
    pub multiplier_reset: f64,
}

impl Default for MethodConstants {
    fn default() -> Self {
        Self {
            dual_tolerance: 1.0,
            divergence_limit: 1e20,
            kappa_epsilon: 10.0,
            kappa_mu: 0.2,
            theta_mu: 1.5,
            tau_min: 0.99,
            damping: 1e-5,
            kappa_sigma: 1e10,
            moves_bounds: true,
            warm_multiplier_push: 1e-9,
            multiplier_limit: 1000.0,
            hessian_regularisation_min: 1e-20,
            hessian_regularisation_max: 1e20,
            dual_regularisation_value: 1e-8,
            residual_target: 1e-7,
            residual_limit: 1e-5,
            max_refinements: 10,
            distrusts_unrefined: true,
            doubts: 3,
            two_stage_fronts: true,
            roomy_fronts: true,
            watchdog_trigger: 10,
            watchdog_trials: 3,
            elastic_weight: 1000.0,
            max_restoration_phases: 50,
            steps_multipliers: true,
            multiplier_reset: 1e3,
        }
    }
}
