//! Computes and caches the learner's posterior of a study, with marginals, probabilities of being best and agreement.

use super::seed::{Purpose, derive};
use super::snapshot::StudySnapshot;
use gait_learner::{ActionIndex, Agreement, BestProbability, Learner, LearnerError, Marginal, Posterior};
use gaitwright_compute::OnPool;
use gaitwright_store::StudyId;
use gaitwright_store::feedback::{FeedbackContent, FeedbackRow, LogVersion};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// Joint draws for the probabilities of being best. Their standard error is below 1.6 %.
const DRAWS: usize = 1000;
/// Above this number of answers a page cannot wait for the posterior: its computing time grows with the third power.
pub const MOST_ANSWERS: usize = 1500;
/// Number of studies whose results are cached.
const KEPT: usize = 16;
/// Number of studies whose learner is cached, so that a proposal and the pages share one fit.
const KEPT_LEARNERS: usize = 4;
/// The learner of a study with more trials is not cached: its memory grows with the square, here to about 100 MB.
const MOST_KEPT_TRIALS: usize = 2000;

/// The posterior after a log, with everything that pages and REST show of it.
#[derive(Debug)]
pub struct Belief {
    /// The posterior itself.
    pub posterior: Arc<Posterior>,
    /// For each dimension, the utility of its levels, averaged over all other dimensions.
    pub marginals: Vec<Vec<Marginal>>,
    /// The tried actions, by decreasing probability of being best.
    pub best: Vec<BestProbability>,
    /// How many answers the posterior agrees with.
    pub agreement: Agreement,
    /// Every comparison that was not retracted, the most surprising first.
    pub comparisons: Vec<Comparison>,
}

/// An answered comparison and its probability under the posterior.
#[derive(Debug)]
pub struct Comparison {
    /// The answer.
    pub given: FeedbackRow,
    /// The probability of the same answer to the same question.
    pub probability: f64,
}

impl Belief {
    /// Derives the rest from the posterior of a study. CPU-bound.
    fn of(snapshot: &StudySnapshot, posterior: Arc<Posterior>) -> Result<Self, LearnerError> {
        let plan = &snapshot.study.plan;
        let dimensions = 0..plan.search_space.dimensions().len();
        let marginals = dimensions.map(|d| posterior.marginal(d)).collect::<Result<_, _>>()?;
        let mut comparisons = Vec::new();
        for row in snapshot.feedback.iter().filter(|row| row.retraction.is_none()) {
            let Some((winner, loser)) = preferred(snapshot, row) else { continue };
            let probability = posterior.preference_probability(winner, loser)?;
            comparisons.push(Comparison { given: row.clone(), probability });
        }
        comparisons.sort_by(|a, b| a.probability.total_cmp(&b.probability));
        Ok(Self {
            marginals,
            best: posterior.best_of_visited(DRAWS, derive(plan.seed, Purpose::Belief, 0))?,
            agreement: posterior.agreement(),
            posterior,
            comparisons,
        })
    }
}

/// Winner and loser of a preference between two trials with different actions.
fn preferred(snapshot: &StudySnapshot, row: &FeedbackRow) -> Option<(ActionIndex, ActionIndex)> {
    let action = |id| snapshot.trial(id).map(|trial| trial.action_index);
    match row.content {
        FeedbackContent::Preference { winner, loser } => {
            Some((action(winner)?, action(loser)?)).filter(|(winner, loser)| winner != loser)
        }
        _ => None,
    }
}

/// Cache of recent posteriors and of the learners that computed them.
#[derive(Debug, Default)]
pub struct Beliefs {
    learners: Mutex<VecDeque<(StudyId, Arc<Mutex<Learner>>)>>,
    posteriors: Kept<Posterior>,
    shown: Kept<Belief>,
}

impl Beliefs {
    /// The posterior of a study, recomputed if the log has changed. CPU-bound.
    ///
    /// # Errors
    /// When the learner cannot work with the log.
    pub fn posterior(&self, _: &OnPool, snapshot: &StudySnapshot) -> Result<Arc<Posterior>, LearnerError> {
        let plan = &snapshot.study.plan;
        let learner = self.learner(snapshot.study.id);
        // Concurrent callers for the same study wait for this result instead of computing it again.
        let mut learner = learner.lock().unwrap_or_else(|poisoned| {
            let mut learner = poisoned.into_inner();
            *learner = Learner::default();
            learner
        });
        let posterior =
            self.posteriors.get_or(snapshot, || learner.posterior(&plan.search_space, &snapshot.log(), &plan.learner));
        if snapshot.trials.len() > MOST_KEPT_TRIALS {
            *learner = Learner::default();
        }
        posterior
    }

    /// The cached learner of a study, or a new one.
    fn learner(&self, study: StudyId) -> Arc<Mutex<Learner>> {
        let mut learners = self.learners.lock().unwrap_or_else(PoisonError::into_inner);
        let kept = learners.iter().position(|(id, _)| *id == study).and_then(|at| learners.remove(at));
        let (study, learner) = kept.unwrap_or_else(|| (study, Arc::default()));
        learners.push_back((study, Arc::clone(&learner)));
        if learners.len() > KEPT_LEARNERS {
            learners.pop_front();
        }
        learner
    }

    /// The belief of a study, recomputed if the log has changed. CPU-bound.
    ///
    /// # Errors
    /// When the learner cannot work with the log.
    pub fn of(&self, pool: &OnPool, snapshot: &StudySnapshot) -> Result<Arc<Belief>, LearnerError> {
        self.shown.get_or(snapshot, || Belief::of(snapshot, self.posterior(pool, snapshot)?))
    }
}

/// A cache of values that derive from the log of a study.
#[derive(Debug)]
struct Kept<T>(Mutex<VecDeque<(StudyId, LogVersion, Arc<T>)>>);

impl<T> Default for Kept<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T> Kept<T> {
    fn get_or(
        &self,
        snapshot: &StudySnapshot,
        compute: impl FnOnce() -> Result<T, LearnerError>,
    ) -> Result<Arc<T>, LearnerError> {
        let (study, version) = (snapshot.study.id, snapshot.version);
        // The list is consistent between statements, so a poisoned lock is usable.
        let kept = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, _, found)) = kept().iter().find(|(id, at, _)| (*id, *at) == (study, version)) {
            return Ok(Arc::clone(found));
        }
        let computed = Arc::new(compute()?);
        let mut kept = kept();
        kept.retain(|(id, ..)| *id != study);
        kept.push_back((study, version, Arc::clone(&computed)));
        if kept.len() > KEPT {
            kept.pop_front();
        }
        Ok(computed)
    }
}
