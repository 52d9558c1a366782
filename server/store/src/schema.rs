//! Shapes of what other crates define, for the description of the REST interface. Types here are never built.

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
    /// The row in words: domain, node, constraint, component.
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

/// A tuned bound as it is given.
#[derive(Debug, ToSchema)]
pub struct GivenBound {
    /// `a1` to `a8`.
    pub bound: String,
    /// What it limits, with its unit.
    pub meaning: String,
    /// Its value.
    pub value: f64,
}

/// Tuned bounds that contradict each other: no gait was found with all of them, one was without any one of them, every
/// other tuned bound being at its loosest.
#[derive(Debug, ToSchema)]
pub struct Conflict {
    /// Those bounds; none: what is fixed contradicts itself.
    pub bounds: Vec<GivenBound>,
    /// Bounds of the other conflicts that had given way when this one was left; absent: none.
    pub without: Option<Vec<String>>,
    /// Wishes that are part of what is fixed, where that contradicts itself; absent: none.
    pub wishes: Option<Vec<String>>,
    /// What is violated where the search for a gait came nearest, all other tuned bounds at their loosest, worst first.
    pub violations: Vec<Violation>,
    /// From how many starts a gait was looked for.
    pub starts: u64,
    /// A solve gave up: that there is no gait is not known then.
    pub undecided: bool,
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
    /// A solve with it gave up: that there is no gait is not known then.
    pub undecided: bool,
    /// Solves that this took.
    pub solves: u64,
    /// From how many starts a gait with `not_with` was looked for; 0: unknown.
    pub starts: u64,
}

/// How far one of several bounds gives way.
#[derive(Debug, ToSchema)]
pub struct RelaxedBound {
    /// `a1` to `a8`.
    pub bound: String,
    /// What it limits, with its unit.
    pub meaning: String,
    /// Its value.
    pub from: f64,
    /// The value nearest to it, of those tried together, with which a gait converged; null: not even with the loosest.
    pub to: Option<f64>,
    /// The loosest value tried, together with those of the others, with which none did.
    pub not_with: f64,
}

/// What relaxing several tuned bounds together achieves, where no single one helps: each by the same share of the way to
/// its loosest.
#[derive(Debug, ToSchema)]
pub struct JointRelaxation {
    /// Those bounds, one of each conflict.
    pub bounds: Vec<RelaxedBound>,
    /// A solve with `not_with` gave up: that there is no gait is not known then.
    pub undecided: bool,
    /// Solves that this took.
    pub solves: u64,
    /// From how many starts a gait with `not_with` was looked for.
    pub starts: u64,
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
