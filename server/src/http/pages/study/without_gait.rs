//! Why trials of a study have no gait, in a line.

use super::format;
use crate::store::TrialId;
use crate::store::explanations::{Common, Relief};
use crate::store::trials::{Trial, TrialState};
use std::collections::BTreeMap;

/// The trials without a gait.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::http::pages) struct WithoutGait {
    /// What most of them have in common.
    pub(super) reason: String,
    /// One of those: identifier and number.
    pub(super) instance: (TrialId, u32),
}

impl WithoutGait {
    /// None where every trial that the program solved has a gait.
    pub(super) fn of(trials: &[Trial], common: &Common) -> Option<Self> {
        let of = common.explained;
        if let Some(Relief { bound, trials, instance }) = &common.relief {
            let limited = format::limited(bound);
            let reason =
                format!("{bound} ({limited}) alone, relaxed, gives a gait in {trials} of {of} that are explained");
            return Some(Self { reason, instance: *instance });
        }
        let mut missed: BTreeMap<&str, Vec<&Trial>> = BTreeMap::new();
        for trial in trials.iter().filter(|trial| trial.state == TrialState::NotConverged) {
            if let Some(worst) = trial.violations.first() {
                missed.entry(worst.constraint()).or_default().push(trial);
            }
        }
        let (constraint, trials) = missed.into_iter().max_by_key(|(_, trials)| trials.len())?;
        let newest = trials.last()?;
        let alone = if of > 0 {
            format!("; no bound alone gives a gait in the {of} that are explained")
        } else {
            String::new()
        };
        let reason = format!("most often missed: {constraint}, in {}{alone}", trials.len());
        Some(Self { reason, instance: (newest.id, newest.number) })
    }
}
