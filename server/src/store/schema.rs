//! Shapes of what other crates define, for the description of the REST interface. Types here are never built.

use utoipa::ToSchema;

/// The tuned bounds of one action.
#[derive(Debug, ToSchema)]
pub struct Bounds {
    /// Every coordinate velocity, rad/s.
    pub a1: f64,
    /// Every coordinate acceleration, rad/s².
    pub a2: f64,
    /// Hip velocity from below, m/s.
    pub a3: f64,
    /// Hip velocity from above, m/s.
    pub a4: f64,
    /// Swing-foot clearance, m.
    pub a5: f64,
    /// Torso lean, rad.
    pub a6: f64,
    /// Hip angles, degrees.
    pub a7: f64,
    /// Ankle angles, degrees.
    pub a8: f64,
}

/// A grid of actions.
#[derive(Debug, ToSchema)]
pub struct SearchSpace {
    /// One per tuned bound.
    pub dimensions: Vec<Dimension>,
}

/// One tuned bound of a grid.
#[derive(Debug, ToSchema)]
pub struct Dimension {
    /// `a1` to `a8`.
    pub name: String,
    /// Its values, ascending.
    pub values: Vec<f64>,
    /// Over which distance values are alike.
    pub lengthscale: f64,
}

/// A row of the gait problem that was not met.
#[derive(Debug, ToSchema)]
pub struct Violation {
    /// The row in words: domain, mesh point, constraint, component.
    pub row: String,
    /// By how much.
    pub amount: f64,
    /// In which unit.
    pub unit: String,
}

/// A tuned bound that the last iterate of a solve runs into.
#[derive(Debug, ToSchema)]
pub struct BoundAtLimit {
    /// `a1` to `a8`.
    pub bound: String,
    /// What it limits, with its unit.
    pub meaning: String,
    /// Its value.
    pub value: f64,
    /// Where it is reached: domains, or `stride`.
    pub domains: Vec<String>,
}

/// What relaxing one tuned bound alone achieves.
#[derive(Debug, ToSchema)]
pub struct Relaxation {
    /// `a1` to `a8`.
    pub bound: String,
    /// What it limits, with its unit.
    pub meaning: String,
    /// Its value.
    pub from: f64,
    /// The value nearest to it, of those tried, with which a gait converged; null: not even with the loosest.
    pub to: Option<f64>,
    /// The loosest value tried with which none did.
    pub not_with: f64,
    /// A solve without a gait gave up: that there is no gait is not known then.
    pub undecided: bool,
    /// Solves that this took.
    pub solves: u64,
}

/// One iteration of a solve.
#[derive(Debug, ToSchema)]
pub struct Iteration {
    /// Number over all phases.
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
    /// Cold guess it belongs to.
    pub guess: u64,
}
