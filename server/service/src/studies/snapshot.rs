//! Where a study stands, as its learner sees it: the log of results and answers, by action.

use super::walkable::{Grounds, NotWalkable, WalkableGait};
use gait_learner::{ActionIndex, Feedback, FeedbackLog};
use gaitwright_store::feedback::{FeedbackContent, FeedbackRow, LogVersion, Source};
use gaitwright_store::safety_reviews::{self, SafetyVersion};
use gaitwright_store::studies::{FeedbackMode, Study};
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{Connection, StoreResult, TrialId, Writer, feedback, trials};
use std::collections::{HashMap, HashSet};

/// Everything that the next decision of a study depends on, read in one go.
#[derive(Debug, Clone)]
pub struct StudySnapshot {
    /// The study.
    pub study: Study,
    /// Its trials, by number.
    pub trials: Vec<Trial>,
    /// Its feedback, as heard, retracted rows included.
    pub feedback: Vec<FeedbackRow>,
    /// The version of the feedback: a decision is written only if it is still current.
    pub version: LogVersion,
    /// The version of what was said about safety: likewise.
    pub safety: SafetyVersion,
    /// Which gaits people may be asked about and given.
    pub grounds: Grounds,
}

impl StudySnapshot {
    /// Reads the snapshot of a study.
    ///
    /// # Errors
    /// What the database reports.
    pub async fn read(db: &mut Connection, study: Study) -> StoreResult<Self> {
        let version = feedback::version(db, study.id).await?;
        let safety = safety_reviews::version(db, study.id).await?;
        let trials = trials::of_study(db, study.id).await?;
        let feedback = feedback::of_study(db, study.id, 0).await?;
        let grounds = Grounds::read(db, study.id).await?;
        Ok(Self { study, trials, feedback, version, safety, grounds })
    }

    /// Whether nothing was heard and nothing was said about safety since this was read: what follows from it may then be
    /// written, in the transaction that asks.
    ///
    /// # Errors
    /// What the database reports.
    pub async fn is_current(&self, writer: &mut Writer) -> StoreResult<bool> {
        let study = self.study.id;
        Ok(feedback::version(writer, study).await? == self.version
            && safety_reviews::version(writer, study).await? == self.safety)
    }

    /// The newest trials of a large study and the best one, for showing: the learner is not asked about it.
    ///
    /// # Errors
    /// What the database reports.
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
        Ok(Self { study, trials, feedback, version, safety, grounds })
    }

    /// The trial with this identifier.
    pub fn trial(&self, id: TrialId) -> Option<&Trial> {
        self.trials.iter().find(|trial| trial.id == id)
    }

    /// The trial that gave the result of an action.
    pub fn trial_of(&self, action: ActionIndex) -> Option<&Trial> {
        self.trials.iter().find(|trial| trial.state.is_result() && trial.action_index == action)
    }

    /// Whether people are to answer the comparisons and no answer of theirs stands.
    pub fn waits_for_first_answer(&self) -> bool {
        let answered = |row: &FeedbackRow| {
            row.retraction.is_none() && !matches!(row.source, Source::Convergence | Source::GaitRmse)
        };
        self.study.plan.feedback_mode == FeedbackMode::Human && !self.feedback.iter().any(answered)
    }

    /// How many trials are queued or running.
    pub fn open(&self) -> usize {
        self.trials.iter().filter(|trial| trial.state.is_open()).count()
    }

    /// Why no further trial is needed though the number of trials would allow one: the time is used, or the best
    /// action stayed the same for long enough.
    pub fn is_enough(&self) -> Option<String> {
        let plan = &self.study.plan;
        let spent: f64 = self.trials.iter().filter_map(|trial| trial.seconds_total).sum();
        if let Some(budget) = plan.solve_seconds_budget
            && spent >= budget
        {
            return Some(format!("the solves took {spent:.0} s of {budget:.0} s"));
        }
        let limit = plan.unchanged_limit? as usize;
        // What was the best when a trial was proposed, newest first.
        let bests: Vec<TrialId> =
            self.trials.iter().rev().filter_map(|trial| trial.best_before).take(limit + 1).collect();
        let same = bests.len() > limit && bests.iter().all(|best| *best == bests[0]);
        same.then(|| format!("the best action stayed the same over {limit} results"))
    }

    /// The gait of a trial, if people may walk with it and be asked about it.
    ///
    /// # Errors
    /// Why not.
    pub fn walkable(&self, trial: &Trial) -> Result<WalkableGait, NotWalkable> {
        self.grounds.admit(trial)
    }

    /// Whether a gait has everything that a walkable one needs but a certificate.
    pub fn waits_for_certificate(&self, trial: &Trial) -> bool {
        matches!(self.walkable(trial), Err(NotWalkable::NotCertified { .. }))
    }

    /// Actions whose gaits Gait RMSE compares: they exist, and no safety report against them is open. Nobody walks because
    /// of such a comparison, so it does not wait for certificates.
    pub fn comparable(&self) -> HashSet<ActionIndex> {
        let shown =
            |trial: &&Trial| trial.state == TrialState::Converged && !self.grounds.safety_reports.closes(trial.id);
        self.trials.iter().filter(shown).map(|trial| trial.action_index).collect()
    }

    /// What the learner hears: results in the order in which they were recorded, and every answer that was
    /// not taken back.
    pub fn log(&self) -> FeedbackLog {
        let by_id: HashMap<TrialId, &Trial> = self.trials.iter().map(|trial| (trial.id, trial)).collect();
        let action = |id: TrialId| by_id.get(&id).map(|trial| trial.action_index);
        let mut log = FeedbackLog::default();
        for row in &self.feedback {
            if let FeedbackContent::Label { trial, .. } = row.said
                && let Some(trial) = by_id.get(&trial)
            {
                log.visited.push(trial.action_index);
            }
            if row.retraction.is_none() {
                log.feedback.extend(heard(&row.said, action));
            }
        }
        log
    }

    /// Actions that may not be proposed though they gave no result: being solved, or given up.
    pub fn taken_without_result(&self) -> Vec<ActionIndex> {
        self.trials.iter().filter(|trial| !trial.state.is_result()).map(|trial| trial.action_index).collect()
    }
}

/// An answer about trials as an answer about actions. `None` when it speaks of one action only.
fn heard(said: &FeedbackContent, action: impl Fn(TrialId) -> Option<ActionIndex>) -> Option<Feedback> {
    let feedback = match *said {
        FeedbackContent::Label { trial, category } => {
            Feedback::Label { action: action(trial)?, category: usize::try_from(category).ok()? }
        }
        FeedbackContent::Preference { winner, loser } => {
            Feedback::Preference { winner: action(winner)?, loser: action(loser)? }
        }
        FeedbackContent::Tie { a, b } => Feedback::Tie { a: action(a)?, b: action(b)? },
        FeedbackContent::Suggestion { suggested, over } => Feedback::Suggestion { suggested, over: action(over)? },
    };
    match feedback.actions() {
        (a, Some(b)) if a == b => None,
        _ => Some(feedback),
    }
}
