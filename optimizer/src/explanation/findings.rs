//! Findings of an explanation: conflicts, the bounds that were reached, and relaxations.

use super::given_bound::BoundValue;
use super::relaxation::{JointRelaxation, Relaxation};
use crate::solve::{SolveStatus, Violation, WarmStart};
use serde::{Deserialize, Serialize};

/// A tuned bound that the last iterate reaches.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BoundAtLimit {
    /// Name of the bound.
    pub bound: String,
    /// Limited quantity and its unit.
    pub meaning: String,
    /// Its value.
    pub value: f64,
    /// Domains in which it is reached.
    pub domains: Vec<String>,
}

/// A conflict of tuned bounds: with the other tuned bounds at their loosest values, no gait was found with all of
/// them, and a gait was found without any one of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Conflict {
    /// The conflicting bounds. Empty if no gait was found with every tuned bound at its loosest value: then fixed
    /// constraints conflict.
    pub bounds: Vec<BoundValue>,
    /// Bounds of other conflicts that were relaxed when this conflict remained.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub without: Vec<String>,
    /// Naturalness terms that take part, if fixed constraints conflict.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub naturalness_terms: Vec<String>,
    /// Violations of the nearest motion with these bounds and the other tuned bounds relaxed, worst first. Stationary
    /// points of the violation are preferred.
    pub violations: Vec<Violation>,
    /// Number of starts of the search.
    pub starts: usize,
    /// Whether a solve ended at a limit or stalled instead of at a stationary point of the violation.
    pub undecided: bool,
}

/// An infeasibility explanation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Explanation {
    /// Status of the solve.
    pub status: SolveStatus,
    /// Violations of the last iterate, worst first.
    pub violations: Vec<Violation>,
    /// The conflicts: the first one, and further ones if no single bound resolves it. Empty if unknown.
    #[serde(default)]
    pub conflicts: Vec<Conflict>,
    /// Whether the search found a gait with exactly the given bounds, which the solve had missed.
    #[serde(default)]
    pub gait_found: bool,
    /// The bounds that the last iterate reaches.
    pub at_limit: Vec<BoundAtLimit>,
    /// Relaxations of each bound of the first conflict; no other bound can resolve it. The smallest one, as a factor
    /// or a share of the range, is first. Insufficient ones are last.
    pub relaxations: Vec<Relaxation>,
    /// Joint relaxations, if no single one is sufficient, smallest first.
    #[serde(default)]
    pub together: Vec<JointRelaxation>,
    /// Whether the search was cancelled after it had found the first conflict, so that further conflicts and relaxations may
    /// be missing.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub stopped_early: bool,
    /// Warm start of the gait that the solve had missed.
    #[serde(skip)]
    pub missed: Option<WarmStart>,
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn explanation_without_conflicts_is_read() {
        let kept = r#"{"status": "infeasible", "violations": [], "at_limit": [], "relaxations": [{"bound": "a5",
            "meaning": "swing-foot clearance, m", "from": 0.04, "to": 0.03, "not_with": 0.031, "undecided": false, "solves": 8}]}"#;
        let read: Explanation = serde_json::from_str(kept).unwrap();
        assert_eq!((read.conflicts.len(), read.together.len(), read.gait_found), (0, 0, false));
        assert_eq!((read.relaxations[0].starts, read.relaxations[0].to), (0, Some(0.03)));
    }
}
