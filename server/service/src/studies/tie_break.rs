//! Ties of Gait RMSE, broken by simulated walks: the gait with more strides is better.

use gaitwright_store::TrialId;
use gaitwright_store::studies::{SimulatedWalks, SimulatedWalksEffect};
use gaitwright_store::trials::Trial;

/// A gait with the values that decide its comparisons.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ComparedGait {
    pub(super) trial: TrialId,
    pub(super) number: u32,
    pub(super) gait_rmse_rad: f64,
    pub(super) mean_strides: Option<f64>,
}

impl ComparedGait {
    /// The gait of a trial; `None` without Gait RMSE.
    pub(super) fn of(trial: &Trial) -> Option<Self> {
        Some(Self {
            trial: trial.id,
            number: trial.number,
            gait_rmse_rad: trial.gait_rmse_rad?,
            mean_strides: trial.mean_strides,
        })
    }
}

/// The decision of simulated walks between two gaits whose Gait RMSE is nearly the same.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct BrokenTie {
    pub(super) winner: TrialId,
    pub(super) loser: TrialId,
    pub(super) reason: String,
}

impl BrokenTie {
    /// `None` if Gait RMSE decides: simulated walks break no ties, there is no tie, or both gaits have the same mean strides.
    pub(super) fn between(walks: &SimulatedWalks, new: ComparedGait, old: ComparedGait) -> Option<Self> {
        let (of_new, of_old) = (new.mean_strides?, old.mean_strides?);
        let difference = (new.gait_rmse_rad - old.gait_rmse_rad).abs();
        let is_tie = walks.effect == SimulatedWalksEffect::TieBreak && difference < walks.gait_rmse_tolerance_rad;
        if !is_tie || of_new == of_old {
            return None;
        }
        let (winner, loser) = if of_new > of_old { (new, old) } else { (old, new) };
        let reason = format!(
            "Gait RMSE differs by {difference:.4} rad, less than the tolerance of {} rad, so simulated walks decide: {:.2} strides \
             on average with trial {}, {:.2} with trial {}.",
            walks.gait_rmse_tolerance_rad,
            of_new.max(of_old),
            winner.number,
            of_new.min(of_old),
            loser.number,
        );
        Some(Self { winner: winner.trial, loser: loser.trial, reason })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reason_names_both_gaits_and_the_tolerance() {
        let gait = |number, gait_rmse_rad, mean_strides| ComparedGait {
            trial: TrialId::fresh(),
            number,
            gait_rmse_rad,
            mean_strides: Some(mean_strides),
        };
        let walks = SimulatedWalks { effect: SimulatedWalksEffect::TieBreak, ..SimulatedWalks::default() };
        let broken = BrokenTie::between(&walks, gait(7, 0.62, 4.25), gait(3, 0.6, 2.0));
        assert_eq!(
            broken.map(|tie| tie.reason).as_deref(),
            Some(
                "Gait RMSE differs by 0.0200 rad, less than the tolerance of 0.05 rad, so simulated walks decide: 4.25 strides \
                 on average with trial 7, 2.00 with trial 3."
            )
        );
    }
}
