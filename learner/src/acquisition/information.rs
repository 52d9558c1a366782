//! Information gain: the action whose answers tell most about the utility.
//!
//! The mutual information between the utility and the next answers, a preference of the action against its partner
//! and its label: `H(answers) - E_f H(answers | f)`. The expectations are means over joint draws of the two
//! utilities, the same standard normals for every action.
//!
//! Separate labels first say whether the action is in the lowest category, which tells of feasibility alone; only when
//! it is not do the grade and the preference tell of the utility. The two functions are independent, so the information
//! is a sum: that of the first answer, and that of the others times the chance that they are given.

use crate::likelihood::Interval;
use crate::math;
use crate::random::Random;
use crate::settings::{Labels, LearnerSettings};

/// Number of draws of the pair of utilities.
const DRAWS: usize = 256;

/// Shared standard normals.
pub(crate) struct InformationGain<'a> {
    settings: &'a LearnerSettings,
    /// What a label may say of the utility.
    grades: Vec<Interval>,
    normals: Vec<[f64; 2]>,
}

/// The utilities of an action and its partner.
pub(crate) struct Pair {
    pub(crate) mean: [f64; 2],
    pub(crate) variance: [f64; 2],
    pub(crate) covariance: f64,
    /// Whether the two will be compared, if the action is not in the lowest category.
    pub(crate) compared: bool,
}

fn entropy(p: f64) -> f64 {
    if p > 0.0 { -p * math::ln(p) } else { 0.0 }
}

/// Entropy of an answer of two values.
fn binary_entropy(p: f64) -> f64 {
    entropy(p) + entropy(1.0 - p)
}

impl<'a> InformationGain<'a> {
    pub(crate) fn new(settings: &'a LearnerSettings, random: &mut Random) -> Self {
        let categories = 0..settings.categories();
        let mut grades: Vec<Interval> = match settings.labels {
            Labels::InUtility => categories.map(|category| settings.label_interval(category)).collect(),
            Labels::Separate => categories.filter_map(|category| settings.grade_interval(category)).collect(),
        };
        if grades.is_empty() {
            grades.push(Interval { low: f64::NEG_INFINITY, high: f64::INFINITY, noise: settings.ordinal_noise });
        }
        Self { settings, grades, normals: (0..DRAWS).map(|_| [random.normal(), random.normal()]).collect() }
    }

    /// Information, in nats, of comparing and labelling an action. `feasibility` is the mean and variance of the function
    /// that labels are about, where they are separate.
    pub(crate) fn of(&self, utility: &Pair, feasibility: Option<(f64, f64)>) -> f64 {
        let about_utility = self.about_utility(utility);
        let Some((mean, variance)) = feasibility else { return about_utility };
        let lowest = self.settings.feasibility_interval(0);
        let (mut fails, mut given_function) = (0.0, 0.0);
        for [z, _] in &self.normals {
            let p = lowest.probability(self.settings.link, mean + variance.max(0.0).sqrt() * z);
            fails += p / DRAWS as f64;
            given_function += binary_entropy(p) / DRAWS as f64;
        }
        binary_entropy(fails) - given_function + (1.0 - fails) * about_utility
    }

    /// Information of the preference and the grade.
    fn about_utility(&self, Pair { mean, variance, covariance, compared }: &Pair) -> f64 {
        let sd = variance[0].max(1e-18).sqrt();
        let slope = covariance / sd;
        let rest = (variance[1] - slope * slope).max(0.0).sqrt();
        let settings = self.settings;
        let better = Interval { low: 0.0, high: f64::INFINITY, noise: settings.preference_noise };
        let mut marginal = vec![[0.0; 2]; self.grades.len()];
        let mut conditional = 0.0;
        for [z, w] in &self.normals {
            let f = mean[0] + sd * z;
            let partner = mean[1] + slope * z + rest * w;
            let preferred = if *compared { better.probability(settings.link, f - partner) } else { 1.0 };
            // Given the utilities the two answers are independent: their uncertainties add up.
            conditional += binary_entropy(preferred) / DRAWS as f64;
            for (grade, marginal) in self.grades.iter().zip(&mut marginal) {
                let label = grade.probability(settings.link, f);
                conditional += entropy(label) / DRAWS as f64;
                marginal[0] += preferred * label / DRAWS as f64;
                marginal[1] += (1.0 - preferred) * label / DRAWS as f64;
            }
        }
        marginal.into_iter().flatten().map(entropy).sum::<f64>() - conditional
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Method;

    /// Mutual information of all answers with both functions at once, from its definition and many draws.
    fn by_definition(settings: &LearnerSettings, utility: &Pair, feasibility: (f64, f64)) -> f64 {
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
    fn separate_labels_inform_of_feasibility_and_only_feasible_actions_of_the_utility() {
        let utility = |compared| Pair { mean: [0.3, 0.0], variance: [0.8, 0.5], covariance: 0.2, compared };
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
            // What surely fails tells nothing, of whatever utility.
            assert!(gain.of(&utility(true), Some((-9.0, 0.1))) < 1e-6);
        }
    }
}
