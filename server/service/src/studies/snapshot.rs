//! A consistent snapshot of a study: its trials, its feedback log and its walkable gaits.

use super::walkable::{Grounds, NotWalkable, WalkableGait};
use crate::error::Error;
use gait_learner::{ActionIndex, Feedback, FeedbackLog};
use gaitwright_store::feedback::{FeedbackContent, FeedbackRow, LogVersion, Source};
use gaitwright_store::safety_reviews::{self, SafetyVersion};
use gaitwright_store::studies::{AnswerSource, AtlasRole, Study};
use gaitwright_store::trials::{Label, NewTrial, Trial, TrialState};
use gaitwright_store::{Connection, StoreResult, TrialId, Writer, feedback, studies, trials};
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// How often a decision is repeated because the study has changed in the meantime.
pub const MAX_TRIES: usize = 20;

/// Refuses a decision because the study has changed in the meantime.
pub fn has_changed() -> Error {
    Error::conflict("The study was changed at the same time. Try again.")
}

/// Everything on which the next decision of a study depends, read at one instant.
#[derive(Debug, Clone)]
pub struct StudySnapshot {
    /// The study.
    pub study: Study,
    /// Its trials, by number.
    pub trials: Vec<Trial>,
    /// Its feedback log, retracted rows included.
    pub feedback: Vec<FeedbackRow>,
    /// Version of the feedback log. A decision is written only if it is still current.
    pub version: LogVersion,
    /// Version of the safety reports and reviews, used in the same way.
    pub safety: SafetyVersion,
    /// Facts that decide which gaits are walkable.
    pub grounds: Grounds,
    /// The trials of the atlas from which the study takes gaits, by number; empty without one.
    pub atlas: Arc<[Trial]>,
}

impl StudySnapshot {
    /// Reads the snapshot of a study.
    ///
    /// # Errors
    /// Errors of the database.
    pub async fn read(db: &mut Connection, study: Study) -> StoreResult<Self> {
        let version = feedback::version(db, study.id).await?;
        let safety = safety_reviews::version(db, study.id).await?;
        let trials = trials::of_study(db, study.id).await?;
        let feedback = feedback::of_study(db, study.id, 0).await?;
        let grounds = Grounds::read(db, study.id).await?;
        let atlas = match study.plan.atlas {
            AtlasRole::Use => studies::finished_atlas(db, &study.plan).await?,
            AtlasRole::None | AtlasRole::Make => None,
        };
        let atlas = match atlas {
            Some(atlas) => trials::of_study(db, atlas).await?,
            None => Vec::new(),
        };
        Ok(Self { study, trials, feedback, version, safety, grounds, atlas: atlas.into() })
    }

    /// Whether there is no new answer and no new safety report since this was read. A decision may then be written in
    /// the same transaction.
    ///
    /// # Errors
    /// Errors of the database.
    pub async fn is_current(&self, writer: &mut Writer) -> StoreResult<bool> {
        let study = self.study.id;
        Ok(feedback::version(writer, study).await? == self.version
            && safety_reviews::version(writer, study).await? == self.safety)
    }

    /// Whether the study has the same revision, and no answer, safety report or trial was added.
    ///
    /// # Errors
    /// Errors of the database.
    pub async fn is_unchanged(&self, writer: &mut Writer) -> StoreResult<bool> {
        Ok(self.is_current(writer).await?
            && self.has_every_trial(writer).await?
            && studies::get(writer, self.study.id).await?.revision == self.study.revision)
    }

    /// A person may add a trial while the scheduler chooses one.
    async fn has_every_trial(&self, db: &mut Connection) -> StoreResult<bool> {
        Ok(trials::counts(db, self.study.id).await?.total as usize == self.trials.len())
    }

    /// Writes a trial that was chosen from this snapshot: the one way to a new trial. `None` when an answer, a safety report or
    /// another trial came since.
    ///
    /// # Errors
    /// A violated constraint or trigger, or errors of the database.
    pub async fn write_trial(&self, writer: &mut Writer, new: &NewTrial) -> StoreResult<Option<TrialId>> {
        if !self.is_current(writer).await? || !self.has_every_trial(writer).await? {
            return Ok(None);
        }
        trials::insert(writer, self.study.id, new).await.map(Some)
    }

    /// The newest trials and the best one of a large study, for pages. Not for the learner.
    ///
    /// # Errors
    /// Errors of the database.
    pub async fn newest(db: &mut Connection, study: Study, limit: u32) -> StoreResult<Self> {
        let version = feedback::version(db, study.id).await?;
        let safety = safety_reviews::version(db, study.id).await?;
        let mut trials = trials::newest(db, study.id, None, limit).await?;
        if let Some(best) = trials.last().and_then(|newest| newest.best_before)
            && !trials.iter().any(|trial| trial.id == best)
        {
            trials.insert(0, trials::get(db, best).await?);
        }
        let feedback = feedback::newest_of_people(db, study.id, limit).await?;
        let grounds = Grounds::read(db, study.id).await?;
        Ok(Self { study, trials, feedback, version, safety, grounds, atlas: Arc::default() })
    }

    /// The trial with this identifier.
    pub fn trial(&self, id: TrialId) -> Option<&Trial> {
        self.trials.iter().find(|trial| trial.id == id)
    }

    /// The trial with the result of an action.
    pub fn trial_of(&self, action: ActionIndex) -> Option<&Trial> {
        self.trials.iter().find(|trial| trial.state.is_result() && trial.action_index == action)
    }

    /// Whether people answer the comparisons, and have given no valid answer yet.
    pub fn waits_for_first_answer(&self) -> bool {
        self.study.plan.answer_source == AnswerSource::People && !self.feedback.iter().any(is_answer_of_a_person)
    }

    /// Whether results and answers name a best action: a trial converged, and people, if they answer, have done so.
    pub fn has_best_action(&self) -> bool {
        !self.waits_for_first_answer() && self.trials.iter().any(|trial| trial.state == TrialState::Converged)
    }

    /// Number of queued or running trials.
    pub fn open(&self) -> usize {
        self.trials.iter().filter(|trial| trial.state.is_open()).count()
    }

    /// The gait of a trial, if it is walkable.
    ///
    /// # Errors
    /// The first reason why it is not.
    pub fn walkable(&self, trial: &Trial) -> Result<WalkableGait, NotWalkable> {
        self.grounds.admit(trial)
    }

    /// Whether only a certificate is missing for the gait to be walkable.
    pub fn waits_for_certificate(&self, trial: &Trial) -> bool {
        matches!(self.walkable(trial), Err(NotWalkable::NotCertified { .. }))
    }

    /// Actions whose gaits Gait RMSE compares: converged, without a safety report in force. Nobody walks because of such a
    /// comparison, so it needs no certificate.
    pub fn comparable(&self) -> HashSet<ActionIndex> {
        let shown = |trial: &&Trial| {
            trial.state == TrialState::Converged && !self.grounds.safety_reports.unsafe_motions.include(trial)
        };
        self.trials.iter().filter(shown).map(|trial| trial.action_index).collect()
    }

    /// The input of the learner: results in the order of recording, and every answer that was not retracted.
    pub fn log(&self) -> FeedbackLog {
        let by_id: HashMap<TrialId, &Trial> = self.trials.iter().map(|trial| (trial.id, trial)).collect();
        let action = |id: TrialId| by_id.get(&id).map(|trial| trial.action_index);
        let mut log = FeedbackLog::default();
        for row in &self.feedback {
            if let FeedbackContent::Label { trial, .. } = row.content
                && let Some(trial) = by_id.get(&trial)
            {
                log.visited.push(trial.action_index);
            }
            if row.retraction.is_none() {
                log.feedback.extend(in_terms_of_actions(&row.content, action));
            }
        }
        log
    }

    /// An entry of the log as the learner observes it. `None` if both trials have the same action.
    pub fn feedback_for_learner(&self, content: &FeedbackContent) -> Option<Feedback> {
        in_terms_of_actions(content, |id| self.trial(id).map(|trial| trial.action_index))
    }
}

/// Whether a person or a script answered, and the answer was not retracted.
pub(super) fn is_answer_of_a_person(row: &FeedbackRow) -> bool {
    row.retraction.is_none() && !matches!(row.source, Source::Evaluation | Source::GaitRmse)
}

/// Converts an answer about trials to one about actions. `None` if both trials have the same action.
fn in_terms_of_actions(content: &FeedbackContent, action: impl Fn(TrialId) -> Option<ActionIndex>) -> Option<Feedback> {
    let feedback = match *content {
        FeedbackContent::Label { trial, label } => {
            // The default threshold of the learner separates two categories.
            Feedback::Label { action: action(trial)?, category: usize::from(label == Label::Converged) }
        }
        FeedbackContent::Preference { winner, loser } => {
            Feedback::Preference { winner: action(winner)?, loser: action(loser)? }
        }
        FeedbackContent::NoDifference { a, b } => Feedback::NoDifference { a: action(a)?, b: action(b)? },
        FeedbackContent::Suggestion { suggested, over } => Feedback::Suggestion { suggested, over: action(over)? },
    };
    match feedback.actions() {
        (a, Some(b)) if a == b => None,
        _ => Some(feedback),
    }
}
