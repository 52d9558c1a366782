//! The study that both benchmarks measure.

use std::hint::black_box;

use gait_learner::{ActionIndex, Dimension, Feedback, FeedbackLog, Posterior, SearchSpace};

/// The grid of Table I: 11,664 actions.
pub fn space() -> SearchSpace {
    let dimensions = [2, 3, 3, 3, 4, 6, 3, 3]
        .iter()
        .enumerate()
        .map(|(d, &n)| Dimension {
            name: format!("a{}", d + 1),
            values: (0..n).map(f64::from).collect(),
            lengthscale: 1.0,
        })
        .collect();
    SearchSpace::new(dimensions).expect("valid")
}

/// The log of a study whose actions approach an optimum, each compared with the best so far.
pub fn study(space: &SearchSpace, comparisons: usize) -> FeedbackLog {
    let mut state = 12345_u64;
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state
    };
    let optimum = [1, 2, 0, 1, 2, 3, 1, 0];
    let utility = |action: ActionIndex| -> f64 {
        space.levels(action).iter().zip(optimum).map(|(&l, o)| -((l as f64 - f64::from(o)).powi(2))).sum()
    };
    let mut log = FeedbackLog::default();
    let mut best = None;
    while log.visited.len() <= comparisons {
        let mut action = ActionIndex(random() % space.len());
        for _ in 0..log.visited.len().min(40) / 10 {
            let other = ActionIndex(random() % space.len());
            if utility(other) > utility(action) && !log.visited.contains(&other) {
                action = other;
            }
        }
        if log.visited.contains(&action) {
            continue;
        }
        let category = usize::from(utility(action) > -16.0);
        log.feedback.push(Feedback::Label { action, category });
        if let Some(incumbent) = best {
            let better = utility(action) > utility(incumbent);
            let (winner, loser) = if better { (action, incumbent) } else { (incumbent, action) };
            log.feedback.push(Feedback::Preference { winner, loser });
            best = Some(winner);
        } else {
            best = Some(action);
        }
        log.visited.push(action);
    }
    log
}

/// The log without its last action.
pub fn earlier(log: &FeedbackLog) -> FeedbackLog {
    FeedbackLog {
        visited: log.visited[..log.visited.len() - 1].to_vec(),
        feedback: log.feedback[..log.feedback.len() - 2].to_vec(),
    }
}

/// The computations of a study page: marginals, a slice, the probabilities of convergence and preference of each
/// visited action, and the agreement with the feedback.
pub fn page(posterior: &Posterior) {
    let best = posterior.best().expect("tried");
    for dimension in 0..posterior.space().dimensions().len() {
        black_box(posterior.marginal(dimension).expect("exists"));
    }
    black_box(posterior.slice(4, 5, best).expect("exists"));
    for &action in posterior.visited() {
        black_box(posterior.probability_of_converging(action).expect("exists"));
        black_box(posterior.preference_probability(action, best).expect("exists"));
    }
    black_box(posterior.agreement());
}
