//! Time of one whole iteration of a study on Table I's grid of 11,664 actions: the newest answers are taken in and the
//! next action is proposed.
//!
//! `cargo bench -p gait-learner`. One comparison and one label per action tried; the log before the newest answers is
//! in the cache, as in a running study (`warm`), or nothing is (`cold`: a program just started).

#![allow(clippy::expect_used, missing_docs)]

use divan::{Bencher, black_box};
use gait_learner::{ActionIndex, Dimension, Feedback, FeedbackLog, Learner, LearnerSettings, Method, SearchSpace};

fn main() {
    divan::main();
}

fn space() -> SearchSpace {
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

/// A study in which the actions tried approach an optimum, as they do, each compared with the best so far.
fn study(space: &SearchSpace, comparisons: usize) -> FeedbackLog {
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

/// The log before the last action.
fn earlier(log: &FeedbackLog) -> FeedbackLog {
    FeedbackLog {
        visited: log.visited[..log.visited.len() - 1].to_vec(),
        feedback: log.feedback[..log.feedback.len() - 2].to_vec(),
    }
}

fn warm(bencher: Bencher, settings: &LearnerSettings, comparisons: usize) {
    let space = space();
    let log = study(&space, comparisons);
    let mut learner = Learner::default();
    learner.posterior(&space, &earlier(&log), settings).expect("valid");
    bencher
        .with_inputs(|| learner.clone())
        .bench_local_refs(|learner| black_box(learner.propose(&space, &log, &[], settings, 7).expect("valid").action));
}

#[divan::bench(args = [50, 100, 200, 1000], max_time = 2)]
fn linecospar_warm(bencher: Bencher, comparisons: usize) {
    warm(bencher, &LearnerSettings::of(Method::LineCoSpar), comparisons);
}

#[divan::bench(args = [50, 100, 200], max_time = 2)]
fn eubo_published_warm(bencher: Bencher, comparisons: usize) {
    warm(bencher, &LearnerSettings::published(Method::Eubo), comparisons);
}

#[divan::bench(args = [50, 100, 200, 1000], max_time = 2)]
fn eubo_warm(bencher: Bencher, comparisons: usize) {
    warm(bencher, &LearnerSettings::of(Method::Eubo), comparisons);
}

#[divan::bench(args = [50, 200], max_time = 2)]
fn thompson_warm(bencher: Bencher, comparisons: usize) {
    warm(bencher, &LearnerSettings::of(Method::Thompson), comparisons);
}

#[divan::bench(args = [50, 200], max_time = 2)]
fn eubo_cold(bencher: Bencher, comparisons: usize) {
    let space = space();
    let log = study(&space, comparisons);
    let settings = LearnerSettings::of(Method::Eubo);
    bencher.bench_local(|| black_box(gait_learner::propose(&space, &log, &[], &settings, 7).expect("valid").action));
}

#[divan::bench(args = [50, 200], max_time = 2)]
fn page_of_answers(bencher: Bencher, comparisons: usize) {
    let space = space();
    let log = study(&space, comparisons);
    let belief = gait_learner::posterior(&space, &log, &LearnerSettings::default()).expect("valid");
    let best = belief.best().expect("tried");
    bencher.bench_local(|| {
        for dimension in 0..8 {
            black_box(belief.marginal(dimension).expect("exists"));
        }
        black_box(belief.slice(4, 5, best).expect("exists"));
        black_box(belief.best_of_visited(1000, 1).expect("factors"));
        black_box(belief.agreement());
    });
}
