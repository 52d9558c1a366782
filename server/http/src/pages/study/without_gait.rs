//! One sentence about why trials of a study have no gait.

use gait_optimizer::TunedBounds;
use gaitwright_store::TrialId;
use gaitwright_store::explanations::{Common, Relief};
use gaitwright_store::trials::{Trial, TrialState};
use std::collections::BTreeMap;

/// A sentence about the trials without a gait, and an example.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct TrialsWithoutGait {
    /// The sentence.
    pub(super) reason: String,
    /// One of these trials: identifier and number.
    pub(super) instance: (TrialId, u32),
}

impl TrialsWithoutGait {
    /// `None` if every solved trial has a gait.
    pub(super) fn of(trials: &[Trial], common: &Common) -> Option<Self> {
        let explained = common.explained;
        if let Some(Relief { bound, trials, instance }) = &common.relief {
            let limited = TunedBounds::quantity_of(bound);
            let reason = format!(
                "In {trials} of the {explained} trials with an explanation, relaxing {bound} ({limited}) alone gives a gait."
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
            _ => {
                format!(" Relaxing a single bound gives no gait in any of the {explained} trials with an explanation.")
            }
        };
        let reason =
            format!("{constraint} has the largest violation in {} of {all} trials without a gait.{alone}", most.len());
        Some(Self { reason, instance: (newest.id, newest.number) })
    }
}
