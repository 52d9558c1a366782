//! The results of the study of an atlas: the trial that has the gait of each action.

use super::gait_values::active_bounds;
use super::of_study::replayed;
use super::progress::AtlasProgress;
use crate::error::Error;
use gait_learner::ActionIndex;
use gaitwright_compute::OnPool;
use gaitwright_store::TrialId;
use gaitwright_store::certificates::CertificateOnRecord;
use gaitwright_store::studies::{AtlasRole, StudyPlan};
use gaitwright_store::trials::Trial;
use std::collections::{BTreeMap, HashMap};

/// The results so far.
#[derive(Debug)]
pub struct StudyAtlas {
    /// How far it is.
    pub progress: AtlasProgress,
    trials: Vec<Trial>,
    numbers: Vec<Option<u32>>,
    place_of: BTreeMap<ActionIndex, usize>,
}

/// The result of one action.
#[derive(Debug, Clone, Copy)]
pub struct AtlasResult<'a> {
    /// The action.
    pub action: ActionIndex,
    /// The number of its gait, from 1, the root; `None` without a gait. Actions with the same number have the same gait.
    pub gait: Option<u32>,
    /// The trial that found it.
    pub trial: &'a Trial,
}

impl AtlasResult<'_> {
    /// The bounds that cannot move without changing the gait.
    pub fn active_bounds(&self) -> Vec<&str> {
        let report = self.trial.report.as_ref().filter(|_| self.gait.is_some());
        report.map_or_else(Vec::new, |report| active_bounds(&report.unchanged_bounds))
    }
}

impl StudyAtlas {
    /// The results of a study with these trials.
    ///
    /// # Errors
    /// [`Error::Conflict`] if the study makes no atlas.
    pub fn of(_: &OnPool, plan: &StudyPlan, trials: &[Trial]) -> Result<Self, Error> {
        if plan.atlas != AtlasRole::Make {
            return Err(Error::conflict("This study makes no atlas."));
        }
        let replay = replayed(&plan.search_space, trials);
        Ok(Self {
            progress: AtlasProgress::of(&replay),
            numbers: replay.map.gait_numbers(),
            place_of: replay.map.solves().collect(),
            trials: replay.trials.into_iter().cloned().collect(),
        })
    }

    /// The result of an action, if it has one.
    pub fn result_of(&self, action: ActionIndex) -> Option<AtlasResult<'_>> {
        let place = *self.place_of.get(&action)?;
        Some(AtlasResult { action, gait: *self.numbers.get(place)?, trial: self.trials.get(place)? })
    }

    /// The result of each action that has one, in the order of the search space.
    pub fn results(&self) -> impl Iterator<Item = AtlasResult<'_>> {
        self.place_of.keys().filter_map(|action| self.result_of(*action))
    }

    /// Each gait by the action that found it, the lowest Gait RMSE first.
    pub fn by_gait_rmse(&self) -> Vec<AtlasResult<'_>> {
        let mut gaits: Vec<AtlasResult<'_>> = self.results().filter(|result| result.gait.is_some()).collect();
        gaits.retain(|result| result.action == result.trial.action_index);
        let rmse = |result: &AtlasResult<'_>| result.trial.gait_rmse_rad.unwrap_or(f64::INFINITY);
        gaits.sort_by(|a, b| rmse(a).total_cmp(&rmse(b)).then(a.gait.cmp(&b.gait)));
        gaits
    }

    /// The gait with the lowest Gait RMSE among those that passed certification.
    pub fn best_certified(&self, certified: &HashMap<TrialId, CertificateOnRecord>) -> Option<AtlasResult<'_>> {
        let state = |result: &AtlasResult<'_>| certified.get(&result.trial.id).copied();
        self.by_gait_rmse().into_iter().find(|result| state(result) == Some(CertificateOnRecord::Passed))
    }
}
