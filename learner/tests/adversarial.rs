//! Adversarial logs: contradictory, repeated and degenerate feedback. For every log the posterior is finite, and the
//! proposal is valid and reproducible.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, missing_docs)]

use gait_learner::{
    ActionIndex, Dimension, Feedback, FeedbackLog, Inference, Labels, Learner, LearnerError, LearnerSettings, Link,
    Method, SearchSpace, posterior, propose, propose_batch, proposed_comparison, proposed_comparisons,
};
use proptest::prelude::*;
use std::collections::HashSet;

fn space(shape: &[usize]) -> SearchSpace {
    let dimensions = shape
        .iter()
        .enumerate()
        .map(|(d, &n)| Dimension {
            name: format!("x{d}"),
            values: (0..n).map(|level| level as f64).collect(),
            lengthscale: 1.0,
        })
        .collect();
    SearchSpace::new(dimensions).unwrap()
}

/// Every method with every approximation.
fn methods_and_inferences() -> Vec<LearnerSettings> {
    let approximations = [(Inference::Laplace, Link::Logistic), (Inference::ExpectationPropagation, Link::Probit)];
    [Method::LineCoSpar, Method::Eubo, Method::Thompson, Method::InformationGain, Method::Random]
        .into_iter()
        .flat_map(|method| {
            approximations.map(|(inference, link)| LearnerSettings { inference, link, ..LearnerSettings::of(method) })
        })
        .collect()
}

fn all_settings() -> Vec<LearnerSettings> {
    let mut settings = methods_and_inferences();
    settings.push(LearnerSettings::for_uncertain_answers());
    settings.push(LearnerSettings::published(Method::LineCoSpar));
    settings.push(LearnerSettings::published(Method::Eubo));
    settings.push(LearnerSettings { labels: Labels::Separate, ..LearnerSettings::default() });
    settings.push(LearnerSettings { labels: Labels::Separate, ..LearnerSettings::of(Method::InformationGain) });
    for method in [Method::Eubo, Method::Thompson, Method::InformationGain] {
        settings.push(LearnerSettings { avoidance: Some(-0.45), ..LearnerSettings::of(method) });
    }
    settings.push(LearnerSettings {
        inference: Inference::ExpectationPropagation,
        link: Link::Probit,
        avoidance: Some(-0.45),
        ..LearnerSettings::default()
    });
    settings
}

/// Calls what a study calls, and checks that the results are valid.
fn exercise(space: &SearchSpace, log: &FeedbackLog, settings: &LearnerSettings) {
    let posterior = posterior(space, log, settings).unwrap();
    for &action in log.visited.iter().take(5).chain([&ActionIndex(0), &ActionIndex(space.len() - 1)]) {
        let prediction = posterior.predict(action).unwrap();
        assert!(prediction.mean.is_finite() && prediction.standard_deviation.is_finite(), "{settings:?}");
        assert!(prediction.standard_deviation < 1.1 * settings.signal_variance.sqrt());
        let chance = posterior.probability_of_converging(action).unwrap();
        assert!((0.0..=1.0).contains(&chance), "{chance}");
    }
    assert_eq!(posterior.best().is_some(), !log.visited.is_empty());
    assert!(posterior.best().is_none_or(|best| log.visited.contains(&best)));
    proposed_comparison(space, log, settings).unwrap();
    let tried: std::collections::HashSet<_> = log.visited.iter().collect();
    match propose(space, log, &[], settings, 3) {
        Ok(proposal) => {
            assert!(space.contains(proposal.action));
            assert!(settings.repeats || !tried.contains(&proposal.action), "{settings:?}");
            assert_eq!(propose(space, log, &[], settings, 3).unwrap(), proposal);
        }
        Err(LearnerError::Exhausted { .. }) => {
            assert_eq!(tried.len() as u64, space.len());
            assert!(!(settings.repeats && settings.method == Method::LineCoSpar), "a repetition was possible");
        }
        Err(error) => panic!("{error} {settings:?}"),
    }
}

#[test]
fn contradictory_feedback_keeps_probabilities_moderate() {
    let space = space(&[3, 4, 3]);
    let (a, b) = (ActionIndex(1), ActionIndex(20));
    let mut log = FeedbackLog { visited: vec![a, b], feedback: Vec::new() };
    for i in 0..500 {
        log.feedback.push(Feedback::Preference { winner: a, loser: b });
        log.feedback.push(Feedback::Preference { winner: b, loser: a });
        log.feedback.push(Feedback::Label { action: if i % 2 == 0 { a } else { b }, category: i % 2 });
        if i % 10 == 0 {
            log.feedback.push(Feedback::NoDifference { a, b });
        }
    }
    for settings in all_settings() {
        exercise(&space, &log, &settings);
        let posterior = posterior(&space, &log, &settings).unwrap();
        let p = posterior.preference_probability(a, b).unwrap();
        // The labels say that `a` fails and `b` converges. Separate labels decide the comparison.
        match settings.labels {
            Labels::InUtility => assert!((p - 0.5).abs() < 0.2, "{p} {settings:?}"),
            Labels::Separate => assert!(p < 0.2, "{p} {settings:?}"),
        }
    }
}

#[test]
fn cyclic_preferences_give_a_finite_posterior() {
    // No utility agrees with a cycle of preferences.
    let space = space(&[4, 4, 4]);
    let ring: Vec<ActionIndex> = (0..40).map(ActionIndex).collect();
    let feedback =
        (0..1000).map(|i| Feedback::Preference { winner: ring[i % 40], loser: ring[(i + 1) % 40] }).collect();
    let log = FeedbackLog { visited: ring, feedback };
    for settings in methods_and_inferences() {
        exercise(&space, &log, &settings);
    }
}

#[test]
fn studies_without_convergence_get_proposals() {
    let space = space(&[3, 3, 3, 3]);
    let visited: Vec<ActionIndex> = (0..60).map(ActionIndex).collect();
    let feedback = visited.iter().map(|&action| Feedback::Label { action, category: 0 }).collect();
    let log = FeedbackLog { visited, feedback };
    for settings in all_settings() {
        exercise(&space, &log, &settings);
    }
}

#[test]
fn tiny_spaces_and_empty_logs_are_valid() {
    for shape in [vec![1], vec![1, 1, 1], vec![2], vec![5]] {
        let space = space(&shape);
        for settings in all_settings() {
            let mut log = FeedbackLog::default();
            exercise(&space, &log, &settings);
            log.visited.push(ActionIndex(0));
            exercise(&space, &log, &settings);
            log.feedback = vec![Feedback::Label { action: ActionIndex(0), category: 1 }; 50];
            exercise(&space, &log, &settings);
        }
    }
}

#[test]
fn studies_without_convergence_get_proposals_on_table_one() {
    let space = space(&[2, 3, 3, 3, 4, 6, 3, 3]);
    let visited: Vec<ActionIndex> = (0..300).map(|i| ActionIndex(i * 37 % space.len())).collect();
    let feedback = visited.iter().map(|&action| Feedback::Label { action, category: 0 }).collect();
    let log = FeedbackLog { visited, feedback };
    for settings in [
        LearnerSettings::default(),
        LearnerSettings::of(Method::Eubo),
        LearnerSettings { avoidance: Some(-0.45), ..LearnerSettings::of(Method::Eubo) },
        LearnerSettings { avoidance: Some(-0.45), ..LearnerSettings::default() },
    ] {
        exercise(&space, &log, &settings);
    }
}

#[test]
fn thousand_repetitions_of_one_action_are_valid() {
    // A thousand trials of one action or of two, with consistent or mixed labels.
    let space = space(&[3, 4, 3]);
    let (a, b) = (ActionIndex(17), ActionIndex(18));
    for (pair, mixed) in [(false, false), (false, true), (true, false), (true, true)] {
        let mut log = FeedbackLog::default();
        for i in 0..1000 {
            log.visited.push(if pair && i % 2 == 1 { b } else { a });
            log.feedback.push(Feedback::Label { action: a, category: usize::from(!mixed || i % 3 > 0) });
            if pair {
                log.feedback.push(Feedback::Preference { winner: a, loser: b });
            }
        }
        for settings in all_settings() {
            exercise(&space, &log, &settings);
            let posterior = posterior(&space, &log, &settings).unwrap();
            // With separate labels, a last label of 0 for `a` alone decides the comparison.
            if pair && !(mixed && settings.labels == Labels::Separate) {
                // Laplace's mode stays near the boundary, so its probabilities are moderate for any amount of feedback.
                let least = if settings.inference == Inference::Laplace { 0.7 } else { 0.9 };
                let p = posterior.preference_probability(a, b).unwrap();
                assert!(p > least, "{p} {settings:?}");
            }
            if !mixed {
                assert!(posterior.probability_of_converging(a).unwrap() > 0.9, "{settings:?}");
            }
        }
    }
}

#[test]
fn hundred_answers_in_thirty_dimensions_are_valid() {
    let space = space(&[2; 30]);
    let mut log = FeedbackLog::default();
    for i in 0_u64..50 {
        let action = ActionIndex(i.wrapping_mul(0x9E37_79B9_7F4A_7C15) % space.len());
        log.feedback.push(Feedback::Label { action, category: usize::from(i % 4 > 0) });
        if let Some(&last) = log.visited.last() {
            log.feedback.push(Feedback::Preference { winner: last, loser: action });
        }
        log.visited.push(action);
    }
    for settings in all_settings() {
        exercise(&space, &log, &settings);
    }
}

#[test]
fn grids_too_large_to_enumerate_get_proposals() {
    let space = space(&[2; 30]);
    let [a, b, c] = [0, 1 << 29, 77].map(ActionIndex);
    let log = FeedbackLog {
        visited: vec![a, b, c],
        feedback: vec![
            Feedback::Preference { winner: b, loser: a },
            Feedback::Label { action: c, category: 0 },
            Feedback::Preference { winner: b, loser: c },
        ],
    };
    for settings in all_settings() {
        exercise(&space, &log, &settings);
    }
}

#[test]
fn invalid_input_is_rejected_with_its_error() {
    let space = space(&[2, 2]);
    let settings = LearnerSettings::default();
    let refused = |feedback| {
        posterior(&space, &FeedbackLog { visited: vec![ActionIndex(0)], feedback: vec![feedback] }, &settings)
            .expect_err("invalid feedback")
    };
    let (inside, outside) = (ActionIndex(1), ActionIndex(4));
    assert!(matches!(
        refused(Feedback::Preference { winner: inside, loser: inside }),
        LearnerError::SelfComparison { entry: 0, .. }
    ));
    assert!(matches!(refused(Feedback::NoDifference { a: inside, b: outside }), LearnerError::UnknownAction { .. }));
    assert!(matches!(refused(Feedback::Label { action: inside, category: 2 }), LearnerError::UnknownCategory { .. }));
    assert!(propose(&space, &FeedbackLog::default(), &[outside], &settings, 0).is_err());
    for settings in [
        LearnerSettings { preference_noise: f64::NAN, ..LearnerSettings::default() },
        LearnerSettings { signal_variance: -1.0, ..LearnerSettings::default() },
        LearnerSettings { ordinal_thresholds: vec![1.0, 0.0], ..LearnerSettings::default() },
        LearnerSettings { inference: Inference::ExpectationPropagation, ..LearnerSettings::default() },
        LearnerSettings { samples_per_iteration: 0, ..LearnerSettings::default() },
    ] {
        assert!(matches!(
            propose(&space, &FeedbackLog::default(), &[], &settings, 0),
            Err(LearnerError::InvalidSetting { .. })
        ));
    }
}

fn any_feedback(actions: u64, categories: usize) -> impl Strategy<Value = Feedback> {
    let pair = (0..actions, 1..actions).prop_map(move |(a, gap)| (ActionIndex(a), ActionIndex((a + gap) % actions)));
    prop_oneof![
        3 => pair.clone().prop_map(|(winner, loser)| Feedback::Preference { winner, loser }),
        1 => pair.clone().prop_map(|(a, b)| Feedback::NoDifference { a, b }),
        1 => pair.prop_map(|(suggested, over)| Feedback::Suggestion { suggested, over }),
        2 => (0..actions, 0..categories).prop_map(|(a, category)| Feedback::Label { action: ActionIndex(a), category }),
    ]
}

/// The same feedback, with categories that exist under these settings.
fn with_categories_of(settings: &LearnerSettings, mut feedback: Vec<Feedback>) -> Vec<Feedback> {
    for feedback in &mut feedback {
        if let Feedback::Label { category, .. } = feedback {
            *category %= settings.categories();
        }
    }
    feedback
}

fn any_settings() -> impl Strategy<Value = LearnerSettings> {
    let all = all_settings();
    ((0..all.len()), 1e-3..2.0_f64, 1e-3..2.0_f64, 0.3..4.0_f64, any::<bool>(), 1_usize..4).prop_map(
        move |(which, preference, ordinal, factor, many, n)| LearnerSettings {
            preference_noise: preference,
            ordinal_noise: ordinal,
            lengthscale_factor: factor,
            ordinal_thresholds: if many { vec![-0.5, -0.1, 0.3, 0.7] } else { vec![0.0] },
            samples_per_iteration: n,
            ..all[which].clone()
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_log_gives_a_finite_posterior_and_a_proposal(
        settings in any_settings(),
        feedback in prop::collection::vec(any_feedback(36, 5), 0..60),
        visited in prop::collection::vec(0_u64..36, 0..40),
    ) {
        let space = space(&[3, 4, 3]);
        let feedback = with_categories_of(&settings, feedback);
        let log = FeedbackLog { visited: visited.into_iter().map(ActionIndex).collect(), feedback };
        exercise(&space, &log, &settings);
        match propose_batch(&space, &log, &[], &settings, 1) {
            Ok(batch) => {
                let distinct: std::collections::HashSet<_> = batch.iter().map(|p| p.action).collect();
                prop_assert_eq!(distinct.len(), batch.len());
                prop_assert!(!batch.is_empty());
            }
            Err(LearnerError::Exhausted { .. }) => prop_assert!(!settings.repeats || log.visited.len() >= 36),
            Err(error) => panic!("{error} {settings:?}"),
        }
    }

    #[test]
    fn spaces_of_any_shape_are_valid(
        settings in any_settings(),
        shape in prop::collection::vec(1_usize..4, 1..6),
        feedback in prop::collection::vec(any_feedback(1 << 20, 5), 0..20),
        visited in prop::collection::vec(any::<u64>(), 0..12),
    ) {
        let space = space(&shape);
        let within = |action: ActionIndex| ActionIndex(action.0 % space.len());
        let feedback = with_categories_of(&settings, feedback)
            .into_iter()
            .map(|feedback| match feedback {
                Feedback::Preference { winner, loser } => {
                    Feedback::Preference { winner: within(winner), loser: within(loser) }
                }
                Feedback::NoDifference { a, b } => Feedback::NoDifference { a: within(a), b: within(b) },
                Feedback::Suggestion { suggested, over } => {
                    Feedback::Suggestion { suggested: within(suggested), over: within(over) }
                }
                Feedback::Label { action, category } => Feedback::Label { action: within(action), category },
            })
            .filter(|feedback| match *feedback {
                Feedback::Preference { winner: a, loser: b }
                | Feedback::NoDifference { a, b }
                | Feedback::Suggestion { suggested: a, over: b } => a != b,
                Feedback::Label { .. } => true,
            })
            .collect();
        let visited = visited.into_iter().map(|action| within(ActionIndex(action))).collect();
        exercise(&space, &FeedbackLog { visited, feedback }, &settings);
    }

    #[test]
    fn cache_never_changes_a_bit(
        settings in any_settings(),
        feedback in prop::collection::vec(any_feedback(36, 5), 1..40),
        stops in prop::collection::vec(0_usize..40, 1..6),
    ) {
        let space = space(&[3, 4, 3]);
        let feedback = with_categories_of(&settings, feedback);
        let log_to = |end: usize| {
            let feedback = feedback[..end.min(feedback.len())].to_vec();
            let visited = (0..feedback.len() as u64).map(|i| ActionIndex(i * 7 % 36)).collect();
            FeedbackLog { visited, feedback }
        };
        // The cache has seen prefixes in any order, and corrected logs.
        let mut learner = Learner::default();
        for stop in stops {
            learner.posterior(&space, &log_to(stop), &settings).unwrap();
            let mut corrected = log_to(stop);
            corrected.feedback.reverse();
            learner.posterior(&space, &corrected, &settings).unwrap();
            learner.posterior(&space, &log_to(stop), &settings).unwrap();
        }
        agrees_with_a_new_one(&mut learner, &space, &log_to(feedback.len()), &settings);
    }

    #[test]
    fn posterior_does_not_depend_on_the_order_of_answers(
        settings in any_settings(),
        feedback in prop::collection::vec(any_feedback(36, 5), 1..40),
        order in prop::collection::vec(any::<u32>(), 40),
    ) {
        let space = space(&[3, 4, 3]);
        // The last label of an action counts, so each action gets one.
        let mut labelled = HashSet::new();
        let mut feedback = with_categories_of(&settings, feedback);
        feedback.retain(|feedback| match feedback {
            Feedback::Label { action, .. } => labelled.insert(*action),
            _ => true,
        });
        let mut places: Vec<usize> = (0..feedback.len()).collect();
        places.sort_by_key(|&place| order[place]);
        let shuffled = places.iter().map(|&place| feedback[place]).collect();
        let visited: Vec<ActionIndex> = (0..feedback.len() as u64).map(|i| ActionIndex(i * 7 % 36)).collect();
        let of = |feedback| posterior(&space, &FeedbackLog { visited: visited.clone(), feedback }, &settings).unwrap();
        let (given, shuffled) = (of(feedback), of(shuffled));
        for action in (0..space.len()).map(ActionIndex) {
            let (a, b) = (given.predict(action).unwrap(), shuffled.predict(action).unwrap());
            assert_eq!(a.mean.to_bits(), b.mean.to_bits());
            assert_eq!(a.standard_deviation.to_bits(), b.standard_deviation.to_bits());
        }
    }

    #[test]
    fn cache_of_any_history_gives_the_bits_of_a_new_learner(
        settings in any_settings(),
        steps in prop::collection::vec((0_usize..4, any_feedback(36, 5), any::<prop::sample::Index>()), 1..40),
        other in any_settings(),
    ) {
        // The calls of a service: proposals, results, answers, retractions, and a look at other settings.
        let space = space(&[3, 4, 3]);
        let mut learner = Learner::default();
        let mut log = FeedbackLog::default();
        for (step, feedback, at) in steps {
            match step {
                0 => {
                    if let Ok(proposal) = learner.propose(&space, &log, &[ActionIndex(4)], &settings, 7) {
                        learner.proposed_comparisons(&space, &log, proposal.action, &settings).unwrap();
                        log.visited.push(proposal.action);
                        log.feedback.push(Feedback::Label { action: proposal.action, category: 1 });
                    }
                }
                1 if !log.feedback.is_empty() => {
                    log.feedback.remove(at.index(log.feedback.len()));
                }
                2 => {
                    let feedback = with_categories_of(&other, log.feedback.clone());
                    learner.posterior(&space, &FeedbackLog { feedback, ..log.clone() }, &other).unwrap();
                }
                _ => log.feedback.extend(with_categories_of(&settings, vec![feedback])),
            }
        }
        agrees_with_a_new_one(&mut learner, &space, &log, &settings);
    }
}

/// The proposal, or `None` if no action is left. Any other error fails the test.
fn proposed_or_exhausted<T>(proposed: Result<T, LearnerError>) -> Option<T> {
    match proposed {
        Ok(proposal) => Some(proposal),
        Err(LearnerError::Exhausted { .. }) => None,
        Err(error) => panic!("{error}"),
    }
}

/// Checks that a learner with a cache gives the same bits as one without.
fn agrees_with_a_new_one(learner: &mut Learner, space: &SearchSpace, log: &FeedbackLog, settings: &LearnerSettings) {
    let fresh = posterior(space, log, settings).unwrap();
    let cached = learner.posterior(space, log, settings).unwrap();
    for action in (0..space.len()).map(ActionIndex) {
        let (a, b) = (fresh.predict(action).unwrap(), cached.predict(action).unwrap());
        assert_eq!(a.mean.to_bits(), b.mean.to_bits());
        assert_eq!(a.standard_deviation.to_bits(), b.standard_deviation.to_bits());
    }
    let proposed = proposed_or_exhausted(propose(space, log, &[], settings, 5));
    assert_eq!(proposed, proposed_or_exhausted(learner.propose(space, log, &[], settings, 5)));
    assert_eq!(
        propose_batch(space, log, &[ActionIndex(2)], settings, 5).ok(),
        learner.propose_batch(space, log, &[ActionIndex(2)], settings, 5).ok()
    );
    assert_eq!(
        proposed_comparison(space, log, settings).unwrap(),
        learner.proposed_comparison(space, log, settings).unwrap()
    );
    for action in [0, 7, 14].map(ActionIndex) {
        assert_eq!(
            proposed_comparisons(space, log, action, settings).unwrap(),
            learner.proposed_comparisons(space, log, action, settings).unwrap()
        );
    }
}
