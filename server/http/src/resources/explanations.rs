//! Parts of infeasibility explanations.

use super::solve_reports::Violation;
use gait_optimizer::explanation;
use serde::Serialize;
use utoipa::ToSchema;

/// A tuned bound that is active at the last iterate of a solve.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct BoundAtLimit {
    /// Name of the bound.
    bound: String,
    /// Limited quantity and its unit.
    meaning: String,
    /// Value of the bound in the problem.
    value: f64,
    /// Domains in which the bound is active; `stride` for a constraint on the whole stride.
    domains: Vec<String>,
}

impl From<explanation::BoundAtLimit> for BoundAtLimit {
    fn from(limit: explanation::BoundAtLimit) -> Self {
        let explanation::BoundAtLimit { bound, meaning, value, domains } = limit;
        Self { bound, meaning, value, domains }
    }
}

/// A tuned bound with its given value.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct BoundValue {
    /// Name of the bound.
    bound: String,
    /// Limited quantity and its unit.
    meaning: String,
    /// Value of the bound in the problem.
    value: f64,
}

impl From<explanation::BoundValue> for BoundValue {
    fn from(bound: explanation::BoundValue) -> Self {
        let explanation::BoundValue { bound, meaning, value } = bound;
        Self { bound, meaning, value }
    }
}

/// Tuned bounds that conflict. With all other tuned bounds at their loosest, no gait satisfied all of these bounds, but
/// relaxing any one of them gave a gait.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Conflict {
    /// The bounds. Empty if the fixed constraints conflict with each other.
    bounds: Vec<BoundValue>,
    /// Bounds of other conflicts that were relaxed when this conflict was found.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schema(value_type = Vec<String>, required = false)]
    without: Vec<String>,
    /// Requirements for natural walking that take part in a conflict between fixed constraints, in words; absent if
    /// there are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schema(value_type = Vec<String>, required = false)]
    naturalness_terms: Vec<String>,
    /// Violations in the motion closest to feasibility that the search found, with all other tuned bounds at their
    /// loosest, worst first.
    violations: Vec<Violation>,
    /// Number of starting points of the search.
    #[schema(value_type = u64)]
    starts: usize,
    /// Whether a solve ended without a decision, for example as `stalled` or `time_limit`. If so, infeasibility is not certain.
    undecided: bool,
}

impl From<explanation::Conflict> for Conflict {
    fn from(conflict: explanation::Conflict) -> Self {
        let explanation::Conflict { bounds, without, naturalness_terms, violations, starts, undecided } = conflict;
        Self {
            bounds: bounds.into_iter().map(Into::into).collect(),
            without,
            naturalness_terms,
            violations: violations.into_iter().map(Into::into).collect(),
            starts,
            undecided,
        }
    }
}

/// Effect of relaxing one tuned bound alone.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Relaxation {
    /// Name of the bound.
    bound: String,
    /// Limited quantity and its unit.
    meaning: String,
    /// Value of the bound in the problem.
    from: f64,
    /// The value nearest to the given one that was found to give a gait. Null if not even the loosest value does.
    to: Option<f64>,
    /// The loosest value tried that does not give a gait.
    not_with: f64,
    /// Whether the solve at the `not_with` value ended without a decision. If so, infeasibility is not certain.
    undecided: bool,
    /// Number of solves.
    #[schema(value_type = u64)]
    solves: usize,
    /// Number of starting points of the search at the `not_with` value. 0 if unknown.
    #[schema(value_type = u64)]
    starts: usize,
}

impl From<explanation::Relaxation> for Relaxation {
    fn from(relaxation: explanation::Relaxation) -> Self {
        let explanation::Relaxation { bound, meaning, from, to, not_with, undecided, solves, starts, warm_start: _ } =
            relaxation;
        Self { bound, meaning, from, to, not_with, undecided, solves, starts }
    }
}

/// Relaxation of one of several bounds.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct RelaxedBound {
    /// Name of the bound.
    bound: String,
    /// Limited quantity and its unit.
    meaning: String,
    /// Value of the bound in the problem.
    from: f64,
    /// The value nearest to the given one that gives a gait together with the others. Null if not even the loosest
    /// value does.
    to: Option<f64>,
    /// The loosest value that does not give a gait together with the others.
    not_with: f64,
}

impl From<explanation::RelaxedBound> for RelaxedBound {
    fn from(bound: explanation::RelaxedBound) -> Self {
        let explanation::RelaxedBound { bound, meaning, from, to, not_with } = bound;
        Self { bound, meaning, from, to, not_with }
    }
}

/// Effect of relaxing several tuned bounds together, each by the same fraction of the way to its loosest value.
/// Computed if no single relaxation gives a gait.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct JointRelaxation {
    /// The bounds, one from each conflict.
    bounds: Vec<RelaxedBound>,
    /// Whether a solve at the `not_with` values ended without a decision. If so, infeasibility is not certain.
    undecided: bool,
    /// Number of solves.
    #[schema(value_type = u64)]
    solves: usize,
    /// Number of starting points of the search at the `not_with` values.
    #[schema(value_type = u64)]
    starts: usize,
}

impl From<explanation::JointRelaxation> for JointRelaxation {
    fn from(relaxation: explanation::JointRelaxation) -> Self {
        let explanation::JointRelaxation { bounds, undecided, solves, starts, warm_start: _ } = relaxation;
        Self { bounds: bounds.into_iter().map(Into::into).collect(), undecided, solves, starts }
    }
}
