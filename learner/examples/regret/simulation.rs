//! Simulated studies: a person with a known utility, and the regret of the recommended action.

use gait_learner::{
    ActionIndex, ExcludedActions, Feedback, FeedbackLog, Learner, LearnerError, LearnerSettings, propose_outside,
};

use crate::problems::{Knowledge, Problem, SplitMix64};

/// A simulated person who answers comparisons by a known utility with noise.
pub struct Person<'a> {
    problem: &'a Problem,
    /// Scale of the logistic noise on the utility; 0 answers exactly.
    noise: f64,
    seed: u64,
    random: SplitMix64,
}

impl<'a> Person<'a> {
    pub fn new(problem: &'a Problem, noise: f64, seed: u64) -> Self {
        Self { problem, noise, seed, random: SplitMix64(seed ^ 0x005E_ED0F_A17E) }
    }

    /// The answer to a comparison. `None` if neither action converges or their utilities are equal.
    fn compare(&mut self, a: ActionIndex, b: ActionIndex) -> Option<Feedback> {
        let ((ua, ca), (ub, cb)) = (self.problem.of(a), self.problem.of(b));
        let first = match (ca, cb) {
            (false, false) => return None,
            (true, false) => true,
            (false, true) => false,
            (true, true) if self.noise > 0.0 => self.random.unit() < 1.0 / (1.0 + (-(ua - ub) / self.noise).exp()),
            (true, true) if ua == ub => return None,
            (true, true) => ua > ub,
        };
        let (winner, loser) = if first { (a, b) } else { (b, a) };
        Some(Feedback::Preference { winner, loser })
    }
}

/// Regret after 0, 1, ... comparisons, with `batch` actions proposed at a time.
pub fn run(
    mut person: Person<'_>,
    settings: &LearnerSettings,
    comparisons: usize,
    batch: usize,
    knowledge: Knowledge,
) -> Result<Vec<f64>, LearnerError> {
    let problem = person.problem;
    let labelled = problem.converged.iter().any(|c| !c);
    let mut learner = Learner::default();
    let mut log = FeedbackLog::default();
    let mut regrets = Vec::new();
    while regrets.len() <= comparisons {
        let mut proposed: Vec<ActionIndex> = Vec::new();
        let space = problem.space_after(&log.visited, knowledge)?;
        while proposed.len() < batch {
            let seed = person.seed;
            let gaits = knowledge.gaits.then(|| problem.actions_with_gaits_of(&log.visited)).flatten();
            proposed.push(match gaits {
                Some(known) => {
                    let known = ExcludedActions::new(&space, known)?;
                    propose_outside(&space, &log, &proposed, &known, settings, seed)?.action
                }
                None => learner.propose(&space, &log, &proposed, settings, seed)?.action,
            });
        }
        for action in proposed {
            let space = problem.space_after(&log.visited, knowledge)?;
            let comparisons = learner.proposed_comparisons(&space, &log, action, settings)?;
            if labelled {
                log.feedback.push(Feedback::Label { action, category: usize::from(problem.of(action).1) });
            }
            log.feedback.extend(comparisons.iter().filter_map(|comparison| person.compare(action, comparison.against)));
            log.visited.push(action);
            let space = problem.space_after(&log.visited, knowledge)?;
            let best = learner.posterior(&space, &log, settings)?.best();
            // An action has been visited, so there is a best one.
            regrets.push(best.map_or(1.0, |best| 1.0 - problem.of(best).0));
        }
    }
    regrets.truncate(comparisons + 1);
    Ok(regrets)
}

/// Random search: each action is compared with the best so far.
pub fn champion(mut person: Person<'_>, comparisons: usize) -> Vec<f64> {
    let problem = person.problem;
    let mut random = SplitMix64(person.seed.wrapping_mul(31).wrapping_add(7));
    let mut draw = || ActionIndex(random.below(problem.utility.len()) as u64);
    let mut champion = draw();
    let mut regrets = vec![1.0 - problem.of(champion).0];
    for _ in 0..comparisons {
        let challenger = draw();
        match person.compare(challenger, champion) {
            Some(Feedback::Preference { winner, .. }) => champion = winner,
            _ if !problem.of(champion).1 => champion = challenger,
            _ => {}
        }
        regrets.push(1.0 - problem.of(champion).0);
    }
    regrets
}
