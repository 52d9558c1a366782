//! What the learner believes about a study's search space, in the forms people ask for, kept until it hears more.

use super::seed::{Purpose, derive};
use super::standing::Standing;
use crate::store::StudyId;
use crate::store::feedback::{FeedbackRow, LogVersion, Said};
use gait_learner::{ActionIndex, Agreement, BestProbability, LearnerError, Marginal, Posterior, posterior};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// Joint draws behind the probabilities of being best: their standard error is below 1.6 %.
const DRAWS: usize = 1000;
/// From so many answers on the belief takes longer than a page may: its time grows with their third power.
pub const MOST_ANSWERS: usize = 1500;
/// So many studies are kept.
const KEPT: usize = 16;

/// What the learner believes after a log.
#[derive(Debug)]
pub struct Belief {
    /// The belief itself, for what else is asked.
    pub posterior: Posterior,
    /// For each dimension the utility of its levels, averaged over all others.
    pub marginals: Vec<Vec<Marginal>>,
    /// The actions tried, the one that is most likely the best first.
    pub best: Vec<BestProbability>,
    /// How many answers it agrees with.
    pub agreement: Agreement,
    /// Every comparison that stands, the one that surprises it most first.
    pub comparisons: Vec<Comparison>,
}

/// A comparison that was answered, and what is believed of it now.
#[derive(Debug)]
pub struct Comparison {
    /// The answer.
    pub given: FeedbackRow,
    /// The probability that the same answer would be given to the same question.
    pub probability: f64,
}

impl Belief {
    /// The belief of a study: CPU work.
    ///
    /// # Errors
    /// When the learner refuses the log.
    pub fn of(standing: &Standing) -> Result<Self, LearnerError> {
        let plan = &standing.study.plan;
        let posterior = posterior(&plan.search_space, &standing.log(), &plan.learner)?;
        let dimensions = 0..plan.search_space.dimensions().len();
        let marginals = dimensions.map(|d| posterior.marginal(d)).collect::<Result<_, _>>()?;
        let mut comparisons = Vec::new();
        for row in standing.feedback.iter().filter(|row| row.retraction.is_none()) {
            let Some((winner, loser)) = preferred(standing, row) else { continue };
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

/// Winner and loser as actions, of a preference between two trials that tried different ones.
fn preferred(standing: &Standing, row: &FeedbackRow) -> Option<(ActionIndex, ActionIndex)> {
    let action = |id| standing.trial(id).map(|trial| trial.action_index);
    match row.said {
        Said::Preference { winner, loser } => {
            Some((action(winner)?, action(loser)?)).filter(|(winner, loser)| winner != loser)
        }
        _ => None,
    }
}

/// The beliefs that were computed last.
#[derive(Debug, Default)]
pub struct Beliefs {
    kept: Mutex<VecDeque<(StudyId, LogVersion, Arc<Belief>)>>,
}

impl Beliefs {
    /// The belief of a study, computed where the log has changed since: CPU work.
    ///
    /// # Errors
    /// When the learner refuses the log.
    pub fn of(&self, standing: &Standing) -> Result<Arc<Belief>, LearnerError> {
        let (study, version) = (standing.study.id, standing.version);
        // The list is whole between any two statements that hold the lock.
        let kept = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, _, belief)) = kept().iter().find(|(id, at, _)| (*id, *at) == (study, version)) {
            return Ok(Arc::clone(belief));
        }
        let belief = Arc::new(Belief::of(standing)?);
        let mut kept = kept();
        kept.retain(|(id, ..)| *id != study);
        kept.push_back((study, version, Arc::clone(&belief)));
        if kept.len() > KEPT {
            kept.pop_front();
        }
        Ok(belief)
    }
}
