//! Computes and caches the learner's posterior of a study, with marginals, the pooled gaits and agreement.

use super::gait_utilities::{GaitUtility, gait_utilities};
use super::snapshot::StudySnapshot;
use super::utility_history::{UtilityHistory, UtilityPoint};
use gait_learner::{Agreement, Feedback, Learner, LearnerError, MainEffect, Marginal, Posterior};
use gaitwright_compute::OnPool;
use gaitwright_store::StudyId;
use gaitwright_store::feedback::{FeedbackRow, LogVersion};
use gaitwright_store::safety_reviews::SafetyVersion;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// From this number of trials on, requests do not wait for the posterior.
pub const MAX_TRIALS_TO_WAIT_FOR: usize = 400;
/// Above this number of entries of the feedback log, requests do not wait for the posterior.
pub const MAX_ANSWERS: usize = 1500;

/// Why no request waits for the posterior of a study with so many trials and entries of the feedback log: its computing
/// time grows with their third power. `None` if requests wait.
pub fn too_large_to_wait(trials: usize, answers: usize) -> Option<String> {
    if trials >= MAX_TRIALS_TO_WAIT_FOR {
        return Some(format!("{MAX_TRIALS_TO_WAIT_FOR} trials or more"));
    }
    (answers > MAX_ANSWERS).then(|| format!("more than {MAX_ANSWERS} labels and answers"))
}

/// Number of studies whose results are cached.
const CACHED_STUDIES: usize = 16;
/// Number of studies whose learner is cached, so that a proposal and the pages share one fit.
const KEPT_LEARNERS: usize = 4;
/// The learner of a study with more trials is not cached: its memory grows with the square, here to about 100 MB.
const MAX_KEPT_TRIALS: usize = 2000;

/// The posterior after a log, with everything that pages and REST show of it.
#[derive(Debug)]
pub struct Analysis {
    /// The posterior itself.
    pub posterior: Arc<Posterior>,
    /// For each dimension, the utility of its levels, averaged over all other dimensions.
    pub marginals: Vec<Vec<Marginal>>,
    /// For each dimension, how much it matters.
    pub main_effects: Vec<MainEffect>,
    /// The gaits that can be recommended, by decreasing utility, identical ones pooled.
    pub gaits: Vec<GaitUtility>,
    /// How many answers the posterior agrees with.
    pub agreement: Agreement,
    /// The answers that it does not agree with, the most surprising first.
    pub surprising_answers: Vec<SurprisingAnswer>,
}

/// An answer that the posterior does not agree with.
#[derive(Debug)]
pub struct SurprisingAnswer {
    /// The answer.
    pub answer: FeedbackRow,
    /// For a preference or suggestion, the probability that its order of utilities is right; `None` for an answer of no
    /// difference.
    pub probability: Option<f64>,
}

impl Analysis {
    /// Derives the rest from the posterior of a study. CPU-bound.
    fn of(snapshot: &StudySnapshot, posterior: Arc<Posterior>) -> Result<Self, LearnerError> {
        let plan = &snapshot.study.plan;
        let dimensions = 0..plan.search_space.dimensions().len();
        let marginals = dimensions.map(|d| posterior.marginal(d)).collect::<Result<_, _>>()?;
        let main_effects = (0..plan.search_space.dimensions().len()).map(|d| posterior.main_effect(d));
        Ok(Self {
            marginals,
            main_effects: main_effects.collect::<Result<_, _>>()?,
            gaits: gait_utilities(snapshot, &posterior)?,
            agreement: posterior.agreement(),
            surprising_answers: surprising_answers(snapshot, &posterior)?,
            posterior,
        })
    }
}

/// The comparisons that the posterior does not agree with, the most surprising first; answers of no difference last.
fn surprising_answers(snapshot: &StudySnapshot, posterior: &Posterior) -> Result<Vec<SurprisingAnswer>, LearnerError> {
    let mut surprising_answers = Vec::new();
    for row in snapshot.feedback.iter().filter(|row| row.retraction.is_none()) {
        let Some(feedback) = snapshot.feedback_for_learner(&row.content) else { continue };
        let order = match feedback {
            Feedback::Label { .. } => continue,
            Feedback::Preference { winner, loser } => Some((winner, loser)),
            Feedback::Suggestion { suggested, over } => Some((suggested, over)),
            Feedback::NoDifference { .. } => None,
        };
        if posterior.agrees_with(feedback) {
            continue;
        }
        let probability = match order {
            Some((winner, loser)) => Some(posterior.difference(winner, loser)?.probability_above_zero()),
            None => None,
        };
        surprising_answers.push(SurprisingAnswer { answer: row.clone(), probability });
    }
    surprising_answers.sort_by(|a, b| a.probability.unwrap_or(1.0).total_cmp(&b.probability.unwrap_or(1.0)));
    Ok(surprising_answers)
}

/// Cached values of the studies used last, the one used last at the end.
type Recent<T> = Mutex<VecDeque<(StudyId, Arc<Mutex<T>>)>>;

/// Cache of recent posteriors and of the learners that computed them.
#[derive(Debug, Default)]
pub struct Analyses {
    learners: Recent<Learner>,
    posteriors: StudyCache<LogVersion, Posterior>,
    // A safety report changes which gaits can be recommended.
    shown: StudyCache<(LogVersion, SafetyVersion), Analysis>,
    histories: Recent<UtilityHistory>,
    /// Number of posteriors computed, those of histories not included.
    computed: AtomicU64,
}

impl Analyses {
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
        let posterior = self.posteriors.get_or(snapshot.study.id, snapshot.version, || {
            self.computed.fetch_add(1, Ordering::Relaxed);
            learner.posterior(&plan.search_space, &snapshot.log(), &plan.learner)
        });
        if snapshot.trials.len() > MAX_KEPT_TRIALS {
            *learner = Learner::default();
        }
        posterior
    }

    /// Number of posteriors computed so far, without cached ones and those of histories.
    pub fn computed(&self) -> u64 {
        self.computed.load(Ordering::Relaxed)
    }

    /// The cached learner of a study, or a new one.
    fn learner(&self, study: StudyId) -> Arc<Mutex<Learner>> {
        kept_or_new(&self.learners, study, KEPT_LEARNERS)
    }

    /// The analysis of a study, recomputed if the log has changed. CPU-bound.
    ///
    /// # Errors
    /// When the learner cannot work with the log.
    pub fn of(&self, pool: &OnPool, snapshot: &StudySnapshot) -> Result<Arc<Analysis>, LearnerError> {
        let version = (snapshot.version, snapshot.safety);
        self.shown.get_or(snapshot.study.id, version, || Analysis::of(snapshot, self.posterior(pool, snapshot)?))
    }

    /// The utility of the recommended gait after each answer of a person. Only the answers since the last call are
    /// computed. CPU-bound.
    ///
    /// # Errors
    /// When the learner cannot work with the log.
    pub fn utility_history(&self, _: &OnPool, snapshot: &StudySnapshot) -> Result<Vec<UtilityPoint>, LearnerError> {
        let history = kept_or_new(&self.histories, snapshot.study.id, CACHED_STUDIES);
        let mut history = history.lock().unwrap_or_else(|poisoned| {
            let mut history = poisoned.into_inner();
            *history = UtilityHistory::default();
            history
        });
        history.of(snapshot)
    }
}

/// The value of a study in a list of those used last, or a new one.
fn kept_or_new<T: Default>(list: &Recent<T>, study: StudyId, limit: usize) -> Arc<Mutex<T>> {
    let mut list = list.lock().unwrap_or_else(PoisonError::into_inner);
    let kept = list.iter().position(|(id, _)| *id == study).and_then(|at| list.remove(at));
    let (study, value) = kept.unwrap_or_else(|| (study, Arc::default()));
    list.push_back((study, Arc::clone(&value)));
    if list.len() > limit {
        list.pop_front();
    }
    value
}

/// A cache of values that derive from the log of a study.
#[derive(Debug)]
struct StudyCache<V, T>(Mutex<VecDeque<(StudyId, V, Arc<T>)>>);

impl<V, T> Default for StudyCache<V, T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<V: Copy + PartialEq, T> StudyCache<V, T> {
    fn get_or(
        &self,
        study: StudyId,
        version: V,
        compute: impl FnOnce() -> Result<T, LearnerError>,
    ) -> Result<Arc<T>, LearnerError> {
        // The list is consistent between statements, so a poisoned lock is usable.
        let kept = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, _, found)) = kept().iter().find(|(id, at, _)| (*id, *at) == (study, version)) {
            return Ok(Arc::clone(found));
        }
        let computed = Arc::new(compute()?);
        let mut kept = kept();
        kept.retain(|(id, ..)| *id != study);
        kept.push_back((study, version, Arc::clone(&computed)));
        if kept.len() > CACHED_STUDIES {
            kept.pop_front();
        }
        Ok(computed)
    }
}
