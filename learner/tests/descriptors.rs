//! Spaces whose actions have descriptors.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, missing_docs)]

use gait_learner::{
    ActionDescriptors, ActionIndex, Dimension, ExcludedActions, Feedback, FeedbackLog, Learner, LearnerError,
    LearnerSettings, Method, SearchSpace, posterior, propose, propose_outside,
};
use proptest::prelude::*;
use std::collections::HashSet;

const METHODS: [Method; 5] =
    [Method::LineCoSpar, Method::Eubo, Method::Thompson, Method::InformationGain, Method::Random];

fn grid() -> SearchSpace {
    let dimensions = [(3, 1.0), (4, 1.7), (3, 0.8)].iter().enumerate().map(|(d, &(count, lengthscale))| Dimension {
        name: d.to_string(),
        values: (0..count).map(f64::from).collect(),
        lengthscale,
    });
    SearchSpace::new(dimensions.collect()).unwrap()
}

/// The grid with descriptors that give each pair of actions the correlation of the grid.
fn grid_described_by_its_values() -> SearchSpace {
    let space = grid();
    let lengthscales: Vec<f64> = space.dimensions().iter().map(|dimension| dimension.lengthscale).collect();
    let point = |action| space.values(ActionIndex(action)).iter().zip(&lengthscales).map(|(x, l)| x / l).collect();
    let points: Vec<Vec<f64>> = (0..space.len()).map(point).collect();
    let count = points.len() as f64;
    let mean = |c: usize| points.iter().map(|point| point[c]).sum::<f64>() / count;
    let means = [mean(0), mean(1), mean(2)];
    let squares = points.iter().flat_map(|point| point.iter().zip(means).map(|(x, mean)| (x - mean).powi(2)));
    let spread = (squares.sum::<f64>() / count).sqrt();
    let of_action = (0..points.len()).map(Some).collect();
    let described = ActionDescriptors::new(of_action, &points, 1.0 / spread).unwrap();
    space.described_by(described).unwrap()
}

/// The grid with ten descriptors, each of several actions, and some actions without one.
fn grid_with_equal_actions() -> (SearchSpace, Vec<Option<usize>>) {
    let of_action: Vec<Option<usize>> =
        (0..36).map(|action| Some((action * 7) % 12).filter(|descriptor| *descriptor < 10)).collect();
    let points: Vec<Vec<f64>> = (0..10).map(|i| vec![f64::from(i), f64::from(i * i % 7)]).collect();
    let described = ActionDescriptors::new(of_action.clone(), &points, 0.5).unwrap();
    (grid().described_by(described).unwrap(), of_action)
}

fn place(action: ActionIndex) -> usize {
    usize::try_from(action.0).unwrap()
}

/// Distinct visited actions; each is compared with the one before it and has a label.
fn log(visited: &[u64], answers: &[bool]) -> FeedbackLog {
    let mut seen = HashSet::new();
    let visited: Vec<ActionIndex> =
        visited.iter().copied().filter(|action| seen.insert(*action)).map(ActionIndex).collect();
    let mut feedback: Vec<Feedback> = Vec::new();
    for (pair, &first) in visited.windows(2).zip(answers) {
        let (winner, loser) = if first { (pair[0], pair[1]) } else { (pair[1], pair[0]) };
        feedback.push(Feedback::Preference { winner, loser });
        feedback.push(Feedback::Label { action: pair[1], category: usize::from(first || pair[1].0 % 3 > 0) });
    }
    FeedbackLog { visited, feedback }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn descriptors_that_are_the_values_give_the_posterior_of_the_grid(
        visited in prop::collection::vec(0_u64..36, 2..14),
        answers in prop::collection::vec(any::<bool>(), 14),
        seed in 0_u64..1000,
    ) {
        let (grid, described) = (grid(), grid_described_by_its_values());
        let log = log(&visited, &answers);
        for method in [Method::LineCoSpar, Method::Eubo] {
            let settings = LearnerSettings { preference_noise: 0.3, ..LearnerSettings::of(method) };
            let [of_grid, of_described] = [&grid, &described].map(|space| posterior(space, &log, &settings).unwrap());
            // Rounding, times the condition number of the prior covariance.
            let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
            for action in (0..36).map(ActionIndex) {
                let [a, b] = [&of_grid, &of_described].map(|posterior| posterior.predict(action).unwrap());
                prop_assert!(close(a.mean, b.mean) && close(a.standard_deviation.powi(2), b.standard_deviation.powi(2)), "{a:?} {b:?}");
            }
            for dimension in 0..3 {
                let [a, b] = [&of_grid, &of_described].map(|posterior| posterior.marginal(dimension).unwrap());
                for (a, b) in a.iter().zip(&b) {
                    prop_assert!(close(a.average.mean, b.average.mean), "{a:?} {b:?}");
                    prop_assert!(close(a.average.standard_deviation.powi(2), b.average.standard_deviation.powi(2)));
                }
            }
            prop_assert_eq!(of_grid.best(), of_described.best());
            // EUBO may choose another one of two actions of equal value.
            if method == Method::LineCoSpar {
                let [a, b] = [&grid, &described].map(|space| propose(space, &log, &[], &settings, seed).unwrap());
                prop_assert_eq!(a, b);
            }
        }
    }

    #[test]
    fn equal_actions_have_one_prediction(
        visited in prop::collection::vec(0_u64..36, 2..8),
        answers in prop::collection::vec(any::<bool>(), 8),
    ) {
        let (space, of_action) = grid_with_equal_actions();
        let log = log(&visited, &answers);
        let posterior = posterior(&space, &log, &LearnerSettings::of(Method::Eubo)).unwrap();
        let unvisited = || (0..36).map(ActionIndex).filter(|action| !log.visited.contains(action));
        for a in unvisited() {
            for b in unvisited().filter(|b| of_action[place(*b)].is_some() && of_action[place(*b)] == of_action[place(a)]) {
                prop_assert_eq!(posterior.predict(a).unwrap(), posterior.predict(b).unwrap());
            }
        }
    }
}

#[test]
fn each_descriptor_is_proposed_once_and_actions_without_one_never() {
    let (space, of_action) = grid_with_equal_actions();
    for method in METHODS {
        let settings = LearnerSettings::of(method);
        let (mut log, mut learner) = (FeedbackLog::default(), Learner::default());
        let mut seen = HashSet::new();
        for trial in 0..10 {
            let proposal = learner.propose(&space, &log, &[], &settings, 4).unwrap();
            assert_eq!(proposal, propose(&space, &log, &[], &settings, 4).unwrap());
            let descriptor = of_action[place(proposal.action)];
            assert!(descriptor.is_some() && seen.insert(descriptor), "{method:?} {trial}: {proposal:?}");
            if let Some(best) = proposal.best {
                log.feedback.push(Feedback::Preference { winner: proposal.action, loser: best });
            }
            log.visited.push(proposal.action);
        }
        let exhausted = propose(&space, &log, &[], &settings, 4);
        assert!(matches!(exhausted, Err(LearnerError::Exhausted { .. })), "{method:?} {exhausted:?}");
    }
}

#[test]
fn excluded_actions_with_descriptors_are_never_proposed() {
    let (space, of_action) = grid_with_equal_actions();
    // Descriptors of which an action is left.
    let excluded = ExcludedActions::new(&space, vec![vec![0..3, 0..2, 0..3]]).unwrap();
    let outside = |action: &ActionIndex| !excluded.contains(&space.levels(*action));
    let left: HashSet<usize> =
        (0..36).map(ActionIndex).filter(outside).filter_map(|action| of_action[place(action)]).collect();
    for method in METHODS {
        let settings = LearnerSettings::of(method);
        let mut log = FeedbackLog::default();
        for _ in 0..left.len() {
            let action = propose_outside(&space, &log, &[], &excluded, &settings, 2).unwrap().action;
            assert!(outside(&action), "{method:?} {action}");
            log.visited.push(action);
        }
        assert!(propose_outside(&space, &log, &[], &excluded, &settings, 2).is_err(), "{method:?}");
    }
}

#[test]
fn nothing_follows_from_an_action_without_a_descriptor() {
    let (space, of_action) = grid_with_equal_actions();
    let alone = (0..36).map(ActionIndex).find(|action| of_action[place(*action)].is_none()).unwrap();
    let feedback = vec![Feedback::Label { action: alone, category: 0 }];
    let log = FeedbackLog { visited: vec![alone], feedback };
    let posterior = posterior(&space, &log, &LearnerSettings::of(Method::LineCoSpar)).unwrap();
    for action in (0..36).map(ActionIndex) {
        assert_eq!(posterior.mean(action).unwrap() == 0.0, action != alone, "{action}");
    }
}

#[test]
fn descriptors_of_another_number_of_actions_are_refused() {
    let described = ActionDescriptors::new(vec![Some(0); 35], &[vec![1.0]], 1.0).unwrap();
    let refusal = grid().described_by(described).unwrap_err();
    assert_eq!(refusal.to_string(), "the number of described actions is 35; it must be 36, the number of actions");
}
