//! Information gain (ROIAL, Li et al. 2021): the mutual information between the utility and the next feedback.
//!
//! The feedback is a preference between the action and its partner, and the label of the action. Its mutual information
//! is `H(feedback) - E_f H(feedback | f)`. Expectations are means over joint samples of the two utilities, with the
//! same standard normals for every action.
//!
//! With separate labels, category 0 informs feasibility only. The grade and the preference inform the utility, and are
//! given only for a feasible action. The two processes are independent, so the information is that of feasibility plus
//! that of the others times the probability that the action is feasible.

use crate::acquisition::avoidance::Avoidance;
use crate::action::ActionIndex;
use crate::excluded::ForbiddenActions;
use crate::interval_likelihood::Interval;
use crate::posterior::Posterior;
use crate::random::Random;
use crate::settings::{Labels, LearnerSettings, Partner};
use crate::special_functions;

/// Number of random candidates, as in ROIAL.
const CANDIDATES: usize = 500;

/// Number of samples of the two utilities.
const SAMPLES: usize = 256;

/// Mutual information with common random numbers.
struct InformationGain<'a> {
    settings: &'a LearnerSettings,
    /// Intervals of utilities that a label can name.
    grades: Vec<Interval>,
    normals: Vec<[f64; 2]>,
}

/// Joint moments of the utilities of an action and its partner.
struct JointMoments {
    mean: [f64; 2],
    variance: [f64; 2],
    covariance: f64,
    /// Whether the two will be compared if the action is feasible.
    compared: bool,
}

/// `-p ln p`.
fn entropy(p: f64) -> f64 {
    if p > 0.0 { -p * special_functions::ln(p) } else { 0.0 }
}

/// Entropy of a binary variable, in nats.
fn binary_entropy(p: f64) -> f64 {
    entropy(p) + entropy(1.0 - p)
}

impl<'a> InformationGain<'a> {
    fn new(settings: &'a LearnerSettings, random: &mut Random) -> Self {
        let categories = 0..settings.categories();
        let mut grades: Vec<Interval> = match settings.labels {
            Labels::InUtility => categories.map(|category| settings.label_interval(category)).collect(),
            Labels::Separate => categories.filter_map(|category| settings.grade_interval(category)).collect(),
        };
        if grades.is_empty() {
            grades.push(Interval { low: f64::NEG_INFINITY, high: f64::INFINITY, noise: settings.ordinal_noise });
        }
        Self { settings, grades, normals: (0..SAMPLES).map(|_| [random.normal(), random.normal()]).collect() }
    }

    /// Information of the label and the comparison of an action, in nats. With separate labels, `feasibility` is the
    /// mean and variance of its feasibility.
    fn of(&self, utility: &JointMoments, feasibility: Option<(f64, f64)>) -> f64 {
        let about_utility = self.about_utility(utility);
        let Some((mean, variance)) = feasibility else { return about_utility };
        let lowest = self.settings.feasibility_interval(0);
        let (mut fails, mut given_function) = (0.0, 0.0);
        for [z, _] in &self.normals {
            let p = lowest.probability(self.settings.link, mean + variance.max(0.0).sqrt() * z);
            fails += p / SAMPLES as f64;
            given_function += binary_entropy(p) / SAMPLES as f64;
        }
        binary_entropy(fails) - given_function + (1.0 - fails) * about_utility
    }

    /// Information of the preference and the grade, in nats.
    fn about_utility(&self, JointMoments { mean, variance, covariance, compared }: &JointMoments) -> f64 {
        let sd = variance[0].max(1e-18).sqrt();
        let slope = covariance / sd;
        let rest = (variance[1] - slope * slope).max(0.0).sqrt();
        let link = self.settings.link;
        let better = Interval { low: 0.0, high: f64::INFINITY, noise: self.settings.preference_noise };
        let mut marginal = vec![[0.0; 2]; self.grades.len()];
        let mut conditional = 0.0;
        for [z, w] in &self.normals {
            let f = mean[0] + sd * z;
            let partner = mean[1] + slope * z + rest * w;
            let preferred = if *compared { better.probability(link, f - partner) } else { 1.0 };
            // Given the utilities, preference and label are independent, so their entropies add.
            conditional += binary_entropy(preferred) / SAMPLES as f64;
            for (grade, marginal) in self.grades.iter().zip(&mut marginal) {
                let label = grade.probability(link, f);
                conditional += entropy(label) / SAMPLES as f64;
                marginal[0] += preferred * label / SAMPLES as f64;
                marginal[1] += (1.0 - preferred) * label / SAMPLES as f64;
            }
        }
        marginal.into_iter().flatten().map(entropy).sum::<f64>() - conditional
    }
}

/// The most informative of some random actions outside `forbidden`, and outside the region of avoidance if possible. `None`
/// if every action is forbidden.
pub(crate) fn over_candidates(
    posterior: &Posterior,
    best: ActionIndex,
    forbidden: &ForbiddenActions<'_>,
    random: &mut Random,
) -> Option<ActionIndex> {
    let space = posterior.space();
    let gain = InformationGain::new(posterior.settings(), random);
    let avoidance = Avoidance::of(posterior);
    let partner = match posterior.settings().partner {
        Partner::Previous => posterior.visited().last().copied().unwrap_or(best),
        Partner::Incumbent | Partner::Every => best,
    };
    let utility = &posterior.utility;
    let other = utility.view(partner, space.levels(partner));
    let other_variance = utility.variance(&other);
    // A comparison with an infeasible partner does not inform the utility.
    let compared = posterior.feasibility.is_none() || !posterior.infeasible.contains(&partner);
    let mut top: Option<((bool, f64), ActionIndex)> = None;
    for _ in 0..CANDIDATES {
        let action = forbidden.random_other(random)?;
        let view = utility.view(action, space.levels(action));
        let pair = JointMoments {
            mean: [view.mean, other.mean],
            variance: [utility.variance(&view), other_variance],
            covariance: utility.covariance(&view, &other),
            compared,
        };
        let feasibility = posterior.feasibility.as_ref().map(|process| {
            let view = process.view(action, space.levels(action));
            (view.mean, process.variance(&view))
        });
        let rank = (avoidance.as_ref().is_none_or(|avoidance| avoidance.allows(action)), gain.of(&pair, feasibility));
        if top.is_none_or(|(highest, _)| rank > highest) {
            top = Some((rank, action));
        }
    }
    top.map(|(_, action)| action)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    use crate::excluded::ExcludedActions;
    use crate::feedback::{Feedback, FeedbackLog};
    use crate::search_space::{Dimension, SearchSpace};
    use crate::settings::Method;
    use crate::utility_inference::posterior;

    /// Mutual information of all feedback with both processes, by its definition and plain Monte Carlo.
    fn by_definition(settings: &LearnerSettings, utility: &JointMoments, feasibility: (f64, f64)) -> f64 {
        let mut random = Random::new(5, 0);
        let better = Interval { low: 0.0, high: f64::INFINITY, noise: settings.preference_noise };
        let count = 40_000;
        let mut marginal = vec![[0.0; 2]; settings.categories()];
        let mut conditional = 0.0;
        for _ in 0..count {
            let f = utility.mean[0] + utility.variance[0].sqrt() * random.normal();
            let slope = utility.covariance / utility.variance[0];
            let rest = (utility.variance[1] - slope * utility.covariance).sqrt();
            let partner = utility.mean[1] + slope * (f - utility.mean[0]) + rest * random.normal();
            let g = feasibility.0 + feasibility.1.sqrt() * random.normal();
            for (category, marginal) in marginal.iter_mut().enumerate() {
                let label = settings.feasibility_interval(category.min(1)).probability(settings.link, g)
                    * settings.grade_interval(category).map_or(1.0, |grade| grade.probability(settings.link, f));
                let asked = utility.compared && category > 0;
                let preferred = if asked { better.probability(settings.link, f - partner) } else { 1.0 };
                for (joint, marginal) in [label * preferred, label * (1.0 - preferred)].into_iter().zip(marginal) {
                    *marginal += joint / f64::from(count);
                    conditional += entropy(joint) / f64::from(count);
                }
            }
        }
        marginal.into_iter().flatten().map(entropy).sum::<f64>() - conditional
    }

    #[test]
    fn information_with_separate_labels_matches_its_definition() {
        let utility = |compared| JointMoments { mean: [0.3, 0.0], variance: [0.8, 0.5], covariance: 0.2, compared };
        for ordinal_thresholds in [vec![0.0], vec![-0.2, 0.3, 0.9]] {
            let settings = LearnerSettings {
                ordinal_thresholds,
                labels: Labels::Separate,
                preference_noise: 0.2,
                ..LearnerSettings::of(Method::InformationGain)
            };
            let gain = InformationGain::new(&settings, &mut Random::new(1, 0));
            for compared in [true, false] {
                for feasibility in [(-1.0, 0.3), (0.1, 0.7), (2.0, 0.2)] {
                    let exact = by_definition(&settings, &utility(compared), feasibility);
                    let got = gain.of(&utility(compared), Some(feasibility));
                    assert!((got - exact).abs() < 0.06, "{got} {exact} {feasibility:?} {compared}");
                }
            }
            // An action that is certainly infeasible gives no information.
            assert!(gain.of(&utility(true), Some((-9.0, 0.1))) < 1e-6);
        }
    }

    #[test]
    fn proposal_depends_on_the_preference_noise() {
        let dimension = Dimension { name: "x".into(), values: (0..200).map(f64::from).collect(), lengthscale: 4.0 };
        let space = SearchSpace::new(vec![dimension]).unwrap();
        let settings = LearnerSettings::of(Method::InformationGain);
        let mut log = FeedbackLog::default();
        for step in 0..30 {
            let (a, b) = (ActionIndex(step * 6), ActionIndex(step * 6 + 3));
            log.visited.extend([a, b]);
            log.feedback.push(Feedback::Preference { winner: a, loser: b });
        }
        let mut posterior = posterior(&space, &log, &settings).unwrap();
        let best = posterior.best().unwrap();
        let excluded = ExcludedActions::default();
        let forbidden = ForbiddenActions::new(&space, log.visited.iter().copied(), &excluded);
        let mut proposals = HashSet::new();
        for preference_noise in [0.02, 1.0, 20.0] {
            posterior.settings.preference_noise = preference_noise;
            proposals.insert(over_candidates(&posterior, best, &forbidden, &mut Random::new(3, 0)).unwrap());
        }
        assert!(proposals.len() > 1, "{proposals:?}");
    }
}
