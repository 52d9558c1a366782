//! Why trials of a study have no gait, in a line.

use super::format;
use gaitwright_store::TrialId;
use gaitwright_store::explanations::{Common, Relief};
use gaitwright_store::trials::{Trial, TrialState};
use std::collections::BTreeMap;

/// The trials without a gait.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct WithoutGait {
    /// What most of them have in common.
    pub(super) reason: String,
    /// One of those: identifier and number.
    pub(super) instance: (TrialId, u32),
}

impl WithoutGait {
    /// None where every trial that the program solved has a gait.
    pub(super) fn of(trials: &[Trial], common: &Common) -> Option<Self> {
        let explained = common.explained;
        if let Some(Relief { bound, trials, instance }) = &common.relief {
            let limited = format::limited(bound);
            let reason = format!(
                "{bound} ({limited}) alone, relaxed, gives one in {trials} of {explained} trials that are explained"
            );
            return Some(Self { reason, instance: *instance });
        }
        let (mut missed, mut all): (BTreeMap<&str, Vec<&Trial>>, usize) = (BTreeMap::new(), 0);
        for trial in trials.iter().filter(|trial| trial.state == TrialState::NotConverged) {
            if let Some(worst) = trial.violations.first() {
                missed.entry(worst.constraint()).or_default().push(trial);
                all += 1;
            }
        }
        let (constraint, most) = missed.into_iter().max_by_key(|(_, trials)| trials.len())?;
        let newest = most.last()?;
        let alone = match explained {
            0 => String::new(),
            _ => format!("; no bound alone, relaxed, gives one in the {explained} that are explained"),
        };
        let reason = format!("{constraint} was missed most, in {} of {all} trials{alone}", most.len());
        Some(Self { reason, instance: (newest.id, newest.number) })
    }
}
