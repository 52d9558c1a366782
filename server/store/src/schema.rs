//! OpenAPI schemas of types of other crates. These types are never constructed.

use utoipa::ToSchema;

/// Height and mass of a subject.
#[derive(Debug, ToSchema)]
pub struct Body {
    /// Body height, m.
    pub height_m: f64,
    /// Body mass, kg.
    pub body_mass_kg: f64,
}

/// The tuned bounds of one action.
#[derive(Debug, ToSchema)]
pub struct Bounds {
    /// Maximum of all coordinate velocities, rad/s.
    pub a1: f64,
    /// Maximum of all coordinate accelerations, rad/s².
    pub a2: f64,
    /// Minimum hip velocity, m/s.
    pub a3: f64,
    /// Maximum hip velocity, m/s.
    pub a4: f64,
    /// Minimum clearance of the swing foot, m.
    pub a5: f64,
    /// Maximum torso lean, rad.
    pub a6: f64,
    /// Maximum hip angle, degrees.
    pub a7: f64,
    /// Maximum ankle angle, degrees.
    pub a8: f64,
}

/// A grid of actions.
#[derive(Debug, ToSchema)]
pub struct SearchSpace {
    /// One dimension for each tuned bound.
    pub dimensions: Vec<Dimension>,
}

/// One tuned bound of a grid.
#[derive(Debug, ToSchema)]
pub struct Dimension {
    /// `a1` to `a8`.
    pub name: String,
    /// Its values, ascending.
    pub values: Vec<f64>,
    /// Difference between values up to which gaits of similar utility are expected.
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
    /// `a1` to `a8`.
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
    /// `a1` to `a8`.
    pub bound: String,
    /// What it limits, with its unit.
    pub meaning: String,
    /// Given value.
    pub value: f64,
}

/// Tuned bounds that conflict. With all other tuned bounds at their loosest, no gait was found with all of them, and
/// one was found without any single one of them.
#[derive(Debug, ToSchema)]
pub struct Conflict {
    /// The bounds. Empty if the fixed constraints conflict with each other.
    pub bounds: Vec<GivenBound>,
    /// Bounds of other conflicts that were relaxed when this one was found.
    pub without: Option<Vec<String>>,
    /// Naturalness terms that take part, if fixed constraints conflict; absent: none.
    pub naturalness_terms: Option<Vec<String>>,
    /// What is violated where the search for a gait came nearest, all other tuned bounds at their loosest, worst first.
    pub violations: Vec<Violation>,
    /// Number of starting points of the search.
    pub starts: u64,
    /// Whether a solve gave up, so that infeasibility is not certain.
    pub undecided: bool,
}

/// Effect of relaxing one tuned bound alone.
#[derive(Debug, ToSchema)]
pub struct Relaxation {
    /// `a1` to `a8`.
    pub bound: String,
    /// What it limits, with its unit.
    pub meaning: String,
    /// Given value.
    pub from: f64,
    /// The tried value nearest to it that gives a gait. Null if not even the loosest one does.
    pub to: Option<f64>,
    /// The loosest tried value that gives none.
    pub not_with: f64,
    /// Whether a solve with that value gave up, so that infeasibility is not certain.
    pub undecided: bool,
    /// Number of solves.
    pub solves: u64,
    /// Number of starting points of the search with `not_with`. 0 if unknown.
    pub starts: u64,
}

/// Relaxation of one of several bounds.
#[derive(Debug, ToSchema)]
pub struct RelaxedBound {
    /// `a1` to `a8`.
    pub bound: String,
    /// What it limits, with its unit.
    pub meaning: String,
    /// Given value.
    pub from: f64,
    /// The value nearest to it that gives a gait together with the others. Null if not even the loosest one does.
    pub to: Option<f64>,
    /// The loosest value that gives none together with the others.
    pub not_with: f64,
}

/// Effect of relaxing several tuned bounds together, each by the same fraction of the way to its loosest value.
/// Computed if no single relaxation gives a gait.
#[derive(Debug, ToSchema)]
pub struct JointRelaxation {
    /// The bounds, one of each conflict.
    pub bounds: Vec<RelaxedBound>,
    /// Whether a solve with `not_with` gave up, so that infeasibility is not certain.
    pub undecided: bool,
    /// Number of solves.
    pub solves: u64,
    /// Number of starting points of the search with `not_with`.
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
