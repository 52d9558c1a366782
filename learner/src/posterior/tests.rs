//! Tests of the questions that a posterior answers.

use crate::action::ActionIndex;
use crate::error::LearnerError;
use crate::feedback::{Feedback, FeedbackLog};
use crate::linalg::dot;
use crate::random::Random;
use crate::search_space::{Dimension, SearchSpace};
use crate::settings::{Labels, LearnerSettings, Method};
use crate::utility_inference::posterior;

fn space() -> SearchSpace {
    let dimensions = [2, 3, 4]
        .iter()
        .enumerate()
        .map(|(d, &n)| Dimension { name: d.to_string(), values: (0..n).map(f64::from).collect(), lengthscale: 1.5 })
        .collect();
    SearchSpace::new(dimensions).unwrap()
}

fn log() -> FeedbackLog {
    let [a, b, c] = [0, 7, 20].map(ActionIndex);
    FeedbackLog {
        visited: vec![a, b, c],
        feedback: vec![
            Feedback::Label { action: a, category: 1 },
            Feedback::Preference { winner: a, loser: b },
            Feedback::NoDifference { a: b, b: ActionIndex(9) },
            Feedback::Label { action: c, category: 0 },
            Feedback::Suggestion { suggested: ActionIndex(2), over: b },
        ],
    }
}

#[test]
fn marginals_are_averages_of_the_means_over_other_dimensions() {
    let estimate = posterior(&space(), &log(), &LearnerSettings::of(Method::Eubo)).unwrap();
    for dimension in 0..3 {
        for (level, marginal) in estimate.marginal(dimension).unwrap().iter().enumerate() {
            // Without the nugget, which the mean of a point contains.
            let mut total = 0.0;
            let mut count = 0.0;
            for action in (0..24).map(ActionIndex) {
                let levels = estimate.space().levels(action);
                if levels[dimension] == level {
                    let column = estimate.utility.kernel.column(&levels, &estimate.utility.observed().levels);
                    total += dot(&column, &estimate.utility.approximation().weights);
                    count += 1.0;
                }
            }
            assert!((marginal.average.mean - total / count).abs() < 1e-10);
            assert!(marginal.average.standard_deviation > 0.0 && marginal.average.standard_deviation < 1.0);
        }
    }
}

#[test]
fn main_effect_is_the_difference_of_two_averages_over_the_grid() {
    let estimate = posterior(&space(), &log(), &LearnerSettings::of(Method::Eubo)).unwrap();
    for dimension in 0..3 {
        let marginals = estimate.marginal(dimension).unwrap();
        let effect = estimate.main_effect(dimension).unwrap();
        let at = |value: f64| marginals.iter().position(|m| m.value == value).unwrap();
        let (best, worst) = (at(effect.best), at(effect.worst));
        assert!(marginals.iter().all(|m| m.average.mean <= marginals[best].average.mean));
        assert!(marginals.iter().all(|m| m.average.mean >= marginals[worst].average.mean));
        // Over every pair of actions, without the nugget.
        let process = &estimate.utility;
        let of = |level| (0..24).map(ActionIndex).filter(move |a| space().levels(*a)[dimension] == level);
        let unseen = |a: ActionIndex| {
            let mut view = process.view(a, estimate.space().levels(a));
            if process.observed().slot(a).is_some() {
                view = process.view(ActionIndex(u64::MAX), estimate.space().levels(a));
            }
            view
        };
        let covariance = |a: usize, b: usize| {
            let (a, b): (Vec<_>, Vec<_>) = (of(a).map(unseen).collect(), of(b).map(unseen).collect());
            let sum: f64 = a.iter().flat_map(|x| b.iter().map(|y| process.covariance(x, y))).sum();
            sum / (a.len() * b.len()) as f64
        };
        let variance = covariance(best, best) + covariance(worst, worst) - 2.0 * covariance(best, worst);
        let mean = marginals[best].average.mean - marginals[worst].average.mean;
        assert!((effect.difference.mean - mean).abs() < 1e-12);
        assert!((effect.difference.standard_deviation.powi(2) - variance).abs() < 1e-9);
    }
}

#[test]
fn difference_has_the_probability_of_a_noiseless_preference() {
    let settings = LearnerSettings { preference_noise: 1e-3, ..LearnerSettings::published(Method::Eubo) };
    let estimate = posterior(&space(), &log(), &settings).unwrap();
    for (a, b) in [(0, 7), (7, 0), (2, 23)] {
        let difference = estimate.difference(ActionIndex(a), ActionIndex(b)).unwrap();
        let preferred = estimate.preference_probability(ActionIndex(a), ActionIndex(b)).unwrap();
        assert!((difference.probability_above_zero() - preferred).abs() < 2e-3, "{difference:?} {preferred}");
    }
    let nothing = estimate.difference(ActionIndex(0), ActionIndex(0)).unwrap();
    assert!(nothing.mean == 0.0 && (nothing.probability_above_zero() - 0.5).abs() < 1e-12);
    assert!(estimate.difference(ActionIndex(0), ActionIndex(24)).is_err());
}

#[test]
fn joint_samples_have_the_probability_of_a_noiseless_preference() {
    for nugget in [1e-5, 0.1, 1.0] {
        let (winner, loser) = (ActionIndex(0), ActionIndex(20));
        let log =
            FeedbackLog { visited: vec![winner, loser], feedback: vec![Feedback::Preference { winner, loser }; 3] };
        let settings = LearnerSettings { nugget, preference_noise: 1e-3, ..LearnerSettings::published(Method::Eubo) };
        let estimate = posterior(&space(), &log, &settings).unwrap();
        let preferred = estimate.preference_probability(winner, loser).unwrap();
        let sampler = estimate.sampler(&[winner, loser]).unwrap();
        let mut random = Random::new(1, 0);
        let wins =
            (0..4000).map(|_| sampler.sample(&mut random)).filter(|utilities| utilities[0] > utilities[1]).count();
        let share = wins as f64 / 4000.0;
        assert!((share - preferred).abs() < 0.012, "{nugget}: {share} {preferred}");
    }
}

#[test]
fn probabilities_means_and_agreement_are_consistent() {
    for method in [Method::LineCoSpar, Method::Eubo] {
        for labels in [Labels::InUtility, Labels::Separate] {
            let settings = LearnerSettings { labels, ..LearnerSettings::of(method) };
            let estimate = posterior(&space(), &log(), &settings).unwrap();
            let (a, b, c) = (ActionIndex(0), ActionIndex(7), ActionIndex(20));
            let (ab, ba) =
                (estimate.preference_probability(a, b).unwrap(), estimate.preference_probability(b, a).unwrap());
            assert!(ab > 0.6 && (ab + ba - 1.0).abs() < 1e-9, "{ab} {ba}");
            assert!(estimate.probability_of_converging(a).unwrap() > estimate.probability_of_converging(c).unwrap());
            let categories = estimate.category_probabilities(b).unwrap();
            assert!((categories.iter().sum::<f64>() - 1.0).abs() < 1e-9);
            let agreement = estimate.agreement();
            assert_eq!((agreement.comparisons, agreement.comparisons_agreeing), (2, 2));
            assert_eq!((agreement.labels, agreement.labels_agreeing, agreement.no_difference), (2, 2, 1));
            let slice = estimate.slice(2, 0, a).unwrap();
            assert_eq!((slice.predictions.len(), slice.predictions[0].len()), (4, 2));
            assert_eq!(slice.predictions[0][0], estimate.predict(a).unwrap());
            assert!(estimate.slice(1, 1, a).is_err());
            for dimension in [3, usize::MAX] {
                let unknown = Err(LearnerError::UnknownDimension { dimension, dimensions: 3 });
                assert_eq!(estimate.marginal(dimension), unknown);
                assert!(estimate.slice(0, dimension, a).is_err());
            }
        }
    }
}

#[test]
fn separate_labels_decide_comparisons_with_infeasible_actions() {
    let dimension = Dimension { name: "x".into(), values: (0..9).map(f64::from).collect(), lengthscale: 1.0 };
    let space = SearchSpace::new(vec![dimension]).unwrap();
    let [fails, far, other, converges] = [0, 1, 4, 8].map(ActionIndex);
    let mut log = FeedbackLog {
        visited: vec![fails, converges],
        feedback: vec![
            Feedback::Label { action: fails, category: 0 },
            Feedback::Label { action: converges, category: 1 },
            Feedback::Preference { winner: converges, loser: fails },
        ],
    };
    let settings = LearnerSettings::of(Method::Eubo);
    let estimate = posterior(&space, &log, &settings).unwrap();
    assert!(estimate.preference_probability(converges, fails).unwrap() > 0.7);
    assert_eq!((estimate.agreement().comparisons, estimate.agreement().comparisons_agreeing), (1, 1));
    // A preference and an answer of no difference that contradict the labels, and a second infeasible action.
    log.feedback.extend([
        Feedback::Preference { winner: fails, loser: converges },
        Feedback::NoDifference { a: fails, b: converges },
        Feedback::Label { action: far, category: 0 },
    ]);
    for _ in 0..5 {
        for action in [fails, far] {
            log.feedback.push(Feedback::Label { action, category: 0 });
        }
    }
    let estimate = posterior(&space, &log, &settings).unwrap();
    let agreement = estimate.agreement();
    assert_eq!((agreement.comparisons, agreement.comparisons_agreeing, agreement.no_difference_agreeing), (2, 1, 0));
    let p = estimate.preference_probability(fails, far).unwrap();
    assert!((p - 0.5).abs() < 0.1, "{p}");
    // Without labels, or if both actions converge, the utility decides.
    let compared = FeedbackLog {
        visited: vec![other, converges],
        feedback: vec![Feedback::Preference { winner: other, loser: converges }; 3],
    };
    let estimate = posterior(&space, &compared, &settings).unwrap();
    let labels = [other, converges].map(|action| Feedback::Label { action, category: 1 });
    let in_utility = LearnerSettings { labels: Labels::InUtility, ..settings.clone() };
    let unlabelled = posterior(&space, &compared, &in_utility).unwrap();
    let p = estimate.preference_probability(other, converges).unwrap();
    assert_eq!(p.to_bits(), unlabelled.preference_probability(other, converges).unwrap().to_bits());
    let both = FeedbackLog { feedback: [&compared.feedback[..], &labels].concat(), ..compared };
    assert!(posterior(&space, &both, &settings).unwrap().preference_probability(other, converges).unwrap() > 0.7);
}

#[test]
fn grades_above_the_lowest_category_inform_the_utility() {
    let dimension = Dimension { name: "x".into(), values: (0..9).map(f64::from).collect(), lengthscale: 1.0 };
    let space = SearchSpace::new(vec![dimension]).unwrap();
    let actions = [0, 2, 4, 6, 8].map(ActionIndex);
    let feedback =
        actions.iter().zip([1, 2, 3, 4, 2]).map(|(&action, category)| Feedback::Label { action, category }).collect();
    let log = FeedbackLog { visited: actions.to_vec(), feedback };
    for labels in [Labels::InUtility, Labels::Separate] {
        for method in [Method::LineCoSpar, Method::Eubo] {
            let ordinal_thresholds = vec![-0.5, -0.1, 0.3, 0.7];
            let settings = LearnerSettings { labels, ordinal_thresholds, ..LearnerSettings::of(method) };
            let estimate = posterior(&space, &log, &settings).unwrap();
            assert_eq!(estimate.best(), Some(ActionIndex(6)), "{settings:?}");
            let agreement = estimate.agreement();
            assert_eq!((agreement.labels, agreement.labels_agreeing), (5, 5), "{settings:?}");
            let categories = estimate.category_probabilities(ActionIndex(6)).unwrap();
            assert!((categories.iter().sum::<f64>() - 1.0).abs() < 1e-9);
            assert!(categories[..4].iter().all(|&p| p < categories[4]), "{categories:?}");
            let p = estimate.preference_probability(ActionIndex(6), ActionIndex(0)).unwrap();
            // Laplace's approximation underestimates the probability that either converges.
            assert!(p > 0.7, "{p} {settings:?}");
        }
    }
}
