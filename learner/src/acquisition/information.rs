//! Information gain: the action whose answers tell most about the utility.
//!
//! The mutual information between the utility and the next answers, a preference of the action against its partner
//! and its label: `H(answers) - E_f H(answers | f)`. The expectations are means over joint draws of the two
//! utilities, the same standard normals for every action.

use crate::likelihood::Interval;
use crate::math;
use crate::random::Random;
use crate::settings::LearnerSettings;

/// Number of draws of the pair of utilities.
const DRAWS: usize = 256;

/// Shared standard normals.
pub(crate) struct InformationGain<'a> {
    settings: &'a LearnerSettings,
    labels: Vec<Interval>,
    normals: Vec<[f64; 2]>,
}

fn entropy(p: f64) -> f64 {
    if p > 0.0 { -p * math::ln(p) } else { 0.0 }
}

impl<'a> InformationGain<'a> {
    pub(crate) fn new(settings: &'a LearnerSettings, random: &mut Random) -> Self {
        let labels = (0..settings.categories()).map(|category| settings.label_interval(category)).collect();
        Self { settings, labels, normals: (0..DRAWS).map(|_| [random.normal(), random.normal()]).collect() }
    }

    /// Information, in nats, of comparing and labelling an action, given means, variances and covariance of its
    /// utility and its partner's.
    pub(crate) fn of(&self, mean: [f64; 2], variance: [f64; 2], covariance: f64) -> f64 {
        let sd = variance[0].max(1e-18).sqrt();
        let slope = covariance / sd;
        let rest = (variance[1] - slope * slope).max(0.0).sqrt();
        let settings = self.settings;
        let better = Interval { low: 0.0, high: f64::INFINITY, noise: settings.preference_noise };
        let categories = settings.categories();
        let mut marginal = vec![0.0; 2 * categories];
        let mut conditional = 0.0;
        for [z, w] in &self.normals {
            let f = mean[0] + sd * z;
            let partner = mean[1] + slope * z + rest * w;
            let preferred = better.probability(settings.link, f - partner);
            // Given the utilities the two answers are independent: their uncertainties add up.
            conditional += (entropy(preferred) + entropy(1.0 - preferred)) / DRAWS as f64;
            for category in 0..categories {
                let label = self.labels[category].probability(settings.link, f);
                conditional += entropy(label) / DRAWS as f64;
                marginal[2 * category] += preferred * label / DRAWS as f64;
                marginal[2 * category + 1] += (1.0 - preferred) * label / DRAWS as f64;
            }
        }
        marginal.into_iter().map(entropy).sum::<f64>() - conditional
    }
}
