//! All settings and search spaces within the valid ranges give a finite posterior and a proposal, without numerical
//! errors.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, missing_docs)]

use gait_learner::{
    ActionIndex, Dimension, Feedback, FeedbackLog, Inference, Labels, LearnerError, LearnerSettings, Link, Method,
    SearchSpace, Start, posterior, propose, propose_batch, proposed_comparison,
};
use proptest::prelude::*;
use proptest::sample::select;

/// A log-uniform number; the ends of the range have positive probability.
fn decades(low: f64, high: f64) -> impl Strategy<Value = f64> {
    let (from, to) = (low.log10(), high.log10());
    prop_oneof![
        1 => Just(low),
        1 => Just(high),
        4 => (from..to).prop_map(move |exponent| 10_f64.powf(exponent).clamp(low, high)),
    ]
}

fn any_dimension() -> impl Strategy<Value = Dimension> {
    (1_usize..5, decades(1e-9, 1e9), -1e3..1e3_f64, 0.0..1.0_f64, any::<bool>()).prop_map(
        |(levels, step, offset, reach, ends)| {
            let values: Vec<f64> = (0..levels).map(|level| step * (offset + level as f64)).collect();
            let range = values[levels - 1] - values[0];
            let nearest = values.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
            let (low, high) = if levels > 1 { (1e-2 * nearest, 1e4 * range) } else { (1e-15, 1e15) };
            let reach = if ends { reach.round() } else { reach };
            let lengthscale = (low * (high / low).powf(reach)).clamp(low, high);
            Dimension { name: String::new(), values, lengthscale }
        },
    )
}

fn any_space() -> impl Strategy<Value = SearchSpace> {
    prop::collection::vec(any_dimension(), 1..4).prop_map(|mut dimensions| {
        for (d, dimension) in dimensions.iter_mut().enumerate() {
            dimension.name = format!("x{d}");
        }
        SearchSpace::new(dimensions).unwrap()
    })
}

/// Settings with every number somewhere in its range.
fn any_settings() -> impl Strategy<Value = LearnerSettings> {
    let methods =
        select(vec![Method::LineCoSpar, Method::Eubo, Method::Thompson, Method::InformationGain, Method::Random]);
    let inference = select(vec![
        (Inference::Laplace, Link::Logistic),
        (Inference::Laplace, Link::Probit),
        (Inference::ExpectationPropagation, Link::Probit),
    ]);
    let shapes = (methods, inference, any::<[bool; 4]>(), decades(1e-6, 1e6));
    let shares = (decades(1e-10, 1.0), prop::collection::vec(-10.0..10.0_f64, 0..4), -1e3..1e3_f64);
    let noises = prop::array::uniform5(decades(1e-3, 1e3));
    (shapes, decades(1e-2, 1e2), shares, noises).prop_map(|(shapes, lengthscale_factor, shares, noises)| {
        let (method, (inference, link), flags, signal_variance) = shapes;
        let [separate, centre, repeats, avoid] = flags;
        let (nugget, mut ordinal_thresholds, avoidance) = shares;
        let sd = signal_variance.sqrt();
        let [preference_noise, ordinal_noise, coactive_noise, no_difference_noise, no_difference_width] =
            noises.map(|noise| noise * sd);
        ordinal_thresholds.sort_by(f64::total_cmp);
        ordinal_thresholds.dedup_by(|b, a| *b - *a < 2e-3);
        for threshold in &mut ordinal_thresholds {
            *threshold *= sd;
        }
        let within = |value: f64, low: f64, high: f64| value.clamp(low * sd, high * sd);
        LearnerSettings {
            inference,
            link,
            signal_variance,
            nugget: (nugget * signal_variance).clamp(1e-10 * signal_variance, signal_variance),
            lengthscale_factor,
            labels: if separate { Labels::Separate } else { Labels::InUtility },
            start: if centre { Start::Centre } else { Start::Random },
            preference_noise: within(preference_noise, 1e-3, 1e3),
            ordinal_noise: within(ordinal_noise, 1e-3, 1e3),
            ordinal_thresholds,
            coactive_noise: within(coactive_noise, 1e-3, 1e3),
            no_difference_noise: within(no_difference_noise, 1e-3, 1e3),
            no_difference_width: within(no_difference_width, 1e-3, 1e3),
            avoidance: avoid.then_some(avoidance),
            repeats,
            ..LearnerSettings::of(method)
        }
    })
}

/// The draws from which [`feedback`] makes a piece of feedback.
fn any_feedback() -> impl Strategy<Value = (u8, u64, u64, usize)> {
    (0_u8..5, any::<u64>(), any::<u64>(), 0_usize..4)
}

fn feedback(space: &SearchSpace, settings: &LearnerSettings, draw: (u8, u64, u64, usize)) -> Option<Feedback> {
    let (kind, first, second, category) = draw;
    let (a, b) = (ActionIndex(first % space.len()), ActionIndex(second % space.len()));
    match kind {
        0 | 1 => Some(Feedback::Label { action: a, category: category % settings.categories() }),
        _ if a == b => None,
        2 => Some(Feedback::NoDifference { a, b }),
        3 => Some(Feedback::Suggestion { suggested: a, over: b }),
        _ => Some(Feedback::Preference { winner: a, loser: b }),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn valid_input_never_ends_in_a_numerical_error(
        space in any_space(),
        settings in any_settings(),
        answers in prop::collection::vec(any_feedback(), 0..40),
        visited in prop::collection::vec(any::<u64>(), 0..12),
    ) {
        settings.validate().unwrap();
        let log = FeedbackLog {
            visited: visited.into_iter().map(|action| ActionIndex(action % space.len())).collect(),
            feedback: answers.into_iter().filter_map(|draw| feedback(&space, &settings, draw)).collect(),
        };
        let posterior = match posterior(&space, &log, &settings) {
            Ok(posterior) => posterior,
            Err(error) => panic!("{error} {settings:?}"),
        };
        for action in (0..space.len()).step_by(7).map(ActionIndex) {
            let prediction = posterior.predict(action).unwrap();
            prop_assert!(prediction.mean.is_finite() && prediction.standard_deviation.is_finite());
            let categories = posterior.category_probabilities(action).unwrap();
            prop_assert!(categories.iter().all(|p| (0.0..=1.0).contains(p)), "{:?}", categories);
        }
        for result in [
            propose(&space, &log, &[], &settings, 1).map(drop),
            propose_batch(&space, &log, &[], &settings, 1).map(drop),
            proposed_comparison(&space, &log, &settings).map(drop),
        ] {
            match result {
                Ok(()) | Err(LearnerError::Exhausted { .. }) => {}
                Err(error) => panic!("{error} {settings:?}"),
            }
        }
    }
}
