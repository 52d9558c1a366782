//! The lineage of a gait: the gaits from which it was computed by warm starts, back to the local optimum of the first cold
//! start. Files of `solve --out` contain it.

use gait_optimizer::{SolveOutcome, SolveReport, StartedFrom, WarmStart};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// Number of digits of an identifier.
const DIGITS: usize = 16;

/// The identifier of a gait, derived from the point where its solve ended. It does not depend on the version of the
/// file.
pub(super) fn identifier(end: &WarmStart) -> String {
    let mut hash = Sha256::new();
    for value in &end.point.x {
        hash.update(value.to_le_bytes());
    }
    let mut digits = hex::encode(hash.finalize());
    digits.truncate(DIGITS);
    digits
}

/// A gait from which another one was computed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Ancestor {
    /// Its identifier.
    pub(super) id: String,
    /// Its local optimum, as numbered by the solve that found it.
    #[serde(default)]
    pub(super) local_optimum: Option<usize>,
    /// Its objective, with the bounds of its own solve.
    #[serde(default)]
    pub(super) objective: Option<f64>,
    /// Its Gait RMSE, rad.
    #[serde(default)]
    pub(super) gait_rmse_rad: Option<f64>,
}

impl Ancestor {
    /// As text: `gait 0123456789abcdef (local optimum 2, objective 0.06341, Gait RMSE 1.0938 rad)`.
    pub(super) fn in_words(&self) -> String {
        let known = [
            self.local_optimum.map(|number| format!("local optimum {number}")),
            self.objective.map(|objective| format!("objective {objective:.5}")),
            self.gait_rmse_rad.map(|rmse| format!("Gait RMSE {rmse:.4} rad")),
        ];
        let known: Vec<String> = known.into_iter().flatten().collect();
        if known.is_empty() { format!("gait {}", self.id) } else { format!("gait {} ({})", self.id, known.join(", ")) }
    }
}

/// The gait of a solve and its ancestors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Lineage {
    /// Identifier of the gait.
    pub(super) id: String,
    /// Its local optimum, as numbered by this solve; `None` if the solve did not converge.
    pub(super) local_optimum: Option<usize>,
    /// Its ancestors by warm starts, the nearest first. Empty after a cold start, even if that followed a failed warm
    /// start.
    #[serde(default)]
    pub(super) ancestors: Vec<Ancestor>,
}

impl Lineage {
    /// The lineage of an outcome; `start` is the warm start that was given to the solve.
    pub(super) fn of(outcome: &SolveOutcome, start: Option<&LineageStart>) -> Self {
        let ancestors = match outcome.report.started_from {
            StartedFrom::Warm => {
                start.into_iter().flat_map(|s| [&s.gait].into_iter().chain(&s.before)).cloned().collect()
            }
            StartedFrom::Cold | StartedFrom::ColdAfterWarm => Vec::new(),
        };
        Self { id: identifier(&outcome.warm_start), local_optimum: chosen_local_optimum(&outcome.report), ancestors }
    }
}

/// A warm start and its gait.
#[derive(Debug, Clone)]
pub(super) struct LineageStart {
    pub(super) point: WarmStart,
    pub(super) gait: Ancestor,
    /// The ancestors of that gait, the nearest first.
    before: Vec<Ancestor>,
}

impl LineageStart {
    /// A point without further information.
    pub(super) fn unknown(point: WarmStart) -> Self {
        let gait = Ancestor { id: identifier(&point), local_optimum: None, objective: None, gait_rmse_rad: None };
        Self { point, gait, before: Vec::new() }
    }

    /// The gait of an outcome; `lineage` is the one in its file.
    pub(super) fn answer(outcome: SolveOutcome, lineage: Option<Lineage>) -> Self {
        let report = &outcome.report;
        let values = (chosen_local_optimum(report), report.objective, report.gait_rmse_rad);
        let mut start = Self::cold(outcome.warm_start, values);
        // Ignore the lineage of a different gait.
        let own = lineage.filter(|lineage| lineage.id == start.gait.id);
        start.before = own.map_or_else(Vec::new, |lineage| lineage.ancestors);
        start
    }

    /// A gait that a cold start found, with local optimum, objective and Gait RMSE.
    pub(super) fn cold(point: WarmStart, (local_optimum, objective, rmse): (Option<usize>, f64, f64)) -> Self {
        let finite = |value: f64| Some(value).filter(|value| value.is_finite());
        let (objective, gait_rmse_rad) = (finite(objective), finite(rmse));
        let gait = Ancestor { id: identifier(&point), local_optimum, objective, gait_rmse_rad };
        Self { point, gait, before: Vec::new() }
    }
}

/// The local optimum whose gait is the result of a solve.
pub(super) fn chosen_local_optimum(report: &SolveReport) -> Option<usize> {
    report.solver_runs.iter().find(|run| run.chosen).and_then(|run| run.local_optimum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gait_optimizer::WarmPoint;
    use gait_optimizer::{Margins, Mesh};

    fn end(x: &[f64]) -> WarmStart {
        let point = WarmPoint { x: x.to_vec(), ..WarmPoint::default() };
        WarmStart { muscles: false, mesh: Mesh { ds2: 4, ds3: 4, ss2: 6, ss1: 6 }, point, margins: Margins::default() }
    }

    #[test]
    fn identifier_depends_on_the_point_alone() {
        let id = identifier(&end(&[0.5, -1.0]));
        assert_eq!(id.len(), DIGITS);
        assert_eq!(identifier(&end(&[0.5, -1.0])), id);
        assert_ne!(identifier(&end(&[0.5, -1.0 - f64::EPSILON])), id);
    }

    #[test]
    fn ancestor_text_has_all_known_values() {
        let start = LineageStart::cold(end(&[0.5]), (Some(2), 0.063_41, f64::NAN));
        let id = &start.gait.id;
        assert_eq!(start.gait.in_words(), format!("gait {id} (local optimum 2, objective 0.06341)"));
        assert_eq!(LineageStart::unknown(end(&[0.5])).gait.in_words(), format!("gait {id}"));
    }
}
