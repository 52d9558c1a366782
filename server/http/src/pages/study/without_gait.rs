//! One sentence about why trials of a study have no gait.

use gait_optimizer::TunedBounds;
use gaitwright_store::TrialId;
use gaitwright_store::explanations::{Common, Relief};
use gaitwright_store::trials::{Trial, TrialState};
use std::collections::BTreeMap;

/// A sentence about the trials without a gait, and an example.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct TrialsWithoutGait {
    /// The conflict in words, for a study without any gait; empty if it is unknown.
    pub(super) conflict: String,
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
            let relaxing = format!("elaxing {bound} ({limited}) alone gives a gait");
            let reason = match explained {
                1 => format!("R{relaxing}."),
                _ if *trials == explained => format!("In all {explained} trials with an explanation, r{relaxing}."),
                _ => format!("In {trials} of the {explained} trials with an explanation, r{relaxing}."),
            };
            return Some(Self { conflict: String::new(), reason, instance: *instance });
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
            1 => " Relaxing a single bound gives no gait in the trial with an explanation.".to_owned(),
            _ => {
                format!(" Relaxing a single bound gives no gait in any of the {explained} trials with an explanation.")
            }
        };
        let reason = match (most.len(), all) {
            (_, 1) => format!("{constraint} has the largest violation.{alone}"),
            (same, all) if same == all => {
                format!("{constraint} has the largest violation in all {all} trials without a gait.{alone}")
            }
            (some, all) => {
                format!("{constraint} has the largest violation in {some} of {all} trials without a gait.{alone}")
            }
        };
        Some(Self { conflict: String::new(), reason, instance: (newest.id, newest.number) })
    }
}
