//! The file that `solve --out` writes, and `atlas --best` for its best gait.

use super::lineage::Lineage;
use gait_optimizer::SolveOutcome;
use gaitwright_service::error::Error;
use serde::Serialize;

#[derive(Debug, Serialize)]
struct SolveFile<'a> {
    #[serde(flatten)]
    outcome: &'a SolveOutcome,
    lineage: &'a Lineage,
}

/// The file as JSON.
pub(super) fn text(outcome: &SolveOutcome, lineage: &Lineage) -> Result<String, Error> {
    serde_json::to_string(&SolveFile { outcome, lineage }).map_err(|e| Error::Internal(e.to_string()))
}
