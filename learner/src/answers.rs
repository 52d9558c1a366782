//! What the belief says, in the forms people ask for.

use std::collections::HashMap;

use serde::{Deserialize, Serialize};

use crate::acquisition::thompson;
use crate::belief::Belief;
use crate::error::{LearnerError, Result};
use crate::feedback::Feedback;
use crate::grid::Grid;
use crate::likelihood::Interval;
use crate::linalg::dot;
use crate::math;
use crate::posterior::{Posterior, Prediction};
use crate::random::Random;
use crate::settings::Link;
use crate::space::ActionIndex;

/// The utility of one level of a dimension, averaged over all levels of the others.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Marginal {
    /// The level's value.
    pub value: f64,
    /// Mean and standard deviation of the average utility.
    #[serde(flatten)]
    pub average: Prediction,
}

/// A table of predictions over the levels of two dimensions, the others held.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Slice {
    /// The dimension that runs along the rows.
    pub row_dimension: usize,
    /// The dimension that runs along the columns.
    pub column_dimension: usize,
    /// For each level of the row dimension, the prediction at each level of the column dimension.
    pub predictions: Vec<Vec<Prediction>>,
}

/// How likely an action is to be the best.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BestProbability {
    /// The action.
    pub action: ActionIndex,
    /// Share of joint draws in which it is the highest.
    pub probability: f64,
}

/// How well the model accounts for the answers it was given.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Agreement {
    /// Preferences and suggestions given.
    pub comparisons: usize,
    /// Of these, the ones that the posterior means order the same way, or, where labels are separate and say that one
    /// of the two converges and the other does not, that prefer the one that does.
    pub comparisons_agreeing: usize,
    /// Labels given.
    pub labels: usize,
    /// Of these, the ones in whose category the posterior mean lies (of the lowest category and the grades above it,
    /// where labels are separate).
    pub labels_agreeing: usize,
    /// Ties given.
    pub ties: usize,
    /// Of these, the ones whose posterior means are closer than the tie width, and that separate labels do not decide.
    pub ties_agreeing: usize,
}

impl Posterior {
    /// Probability that an answer falls into an interval, the utility being uncertain.
    fn probability(&self, mut interval: Interval, mean: f64, variance: f64) -> f64 {
        // The logistic distribution function is the normal one of 1.702 times its scale, to 0.0095.
        let noise = match self.settings().link {
            Link::Probit => interval.noise,
            Link::Logistic => 1.702 * interval.noise,
        };
        interval.noise = (noise * noise + variance).sqrt();
        math::exp(interval.log_likelihood(Link::Probit, mean).value).min(1.0)
    }

    /// Probability of each category of label for an action, the lowest first.
    ///
    /// # Errors
    /// When the action is not in the space.
    pub fn category_probabilities(&self, action: ActionIndex) -> Result<Vec<f64>> {
        self.space().check(action)?;
        let settings = self.settings();
        let moments = |belief: &Belief| {
            let view = belief.view(action, self.space().levels(action));
            (view.mean, belief.variance(&view))
        };
        let (mean, variance) = moments(&self.utility);
        let Some(feasibility) = &self.feasibility else {
            let of = |category| self.probability(settings.label_interval(category), mean, variance);
            return Ok((0..settings.categories()).map(of).collect());
        };
        let (feasibility_mean, feasibility_variance) = moments(feasibility);
        let of = |category| {
            let interval = settings.feasibility_interval(category);
            let grade = settings.grade_interval(category);
            self.probability(interval, feasibility_mean, feasibility_variance)
                * grade.map_or(1.0, |interval| self.probability(interval, mean, variance))
        };
        Ok((0..settings.categories()).map(of).collect())
    }

    /// Probability that an action's label is not the lowest category: that it converges.
    ///
    /// # Errors
    /// When the action is not in the space.
    pub fn probability_of_converging(&self, action: ActionIndex) -> Result<f64> {
        let lowest = self.category_probabilities(action)?.first().copied().unwrap_or(0.0);
        Ok(if self.settings().categories() > 1 { 1.0 - lowest } else { 1.0 })
    }

    /// Probability that `a` is preferred to `b` when asked.
    ///
    /// Where labels are separate and any was given, an action that converges is preferred to one that does not, neither
    /// of two that do not, and the utility speaks of two that do; whether one converges is taken as independent of
    /// whether the other does.
    ///
    /// # Errors
    /// When an action is not in the space.
    pub fn preference_probability(&self, a: ActionIndex, b: ActionIndex) -> Result<f64> {
        self.space().check(a)?;
        self.space().check(b)?;
        if a == b {
            return Ok(0.5);
        }
        let view = |action| self.utility.view(action, self.space().levels(action));
        let (mean, variance) = self.utility.difference(&view(a), &view(b));
        let better = Interval { low: 0.0, high: f64::INFINITY, noise: self.preference_noise };
        let by_utility = self.probability(better, mean, variance);
        let labelled = self.feasibility.as_ref().is_some_and(|belief| !belief.model().sites.is_empty());
        if !labelled {
            return Ok(by_utility);
        }
        let (of_a, of_b) = (self.probability_of_converging(a)?, self.probability_of_converging(b)?);
        Ok(of_a * (1.0 - of_b) + of_a * of_b * by_utility + 0.5 * (1.0 - of_a) * (1.0 - of_b))
    }

    /// For every action tried, the share of joint draws in which it is the best of them, the most likely first.
    ///
    /// # Errors
    /// When the covariance cannot be factored.
    pub fn best_of_visited(&self, draws: usize, seed: u64) -> Result<Vec<BestProbability>> {
        let mut actions: Vec<ActionIndex> = Vec::new();
        for &action in self.visited() {
            if !actions.contains(&action) {
                actions.push(action);
            }
        }
        if self.feasibility.is_some() && actions.iter().any(|a| !self.infeasible.contains(a)) {
            actions.retain(|a| !self.infeasible.contains(a));
        }
        if actions.is_empty() {
            return Ok(Vec::new());
        }
        let sampler = self.sampler(&actions)?;
        let mut random = Random::new(seed, u64::MAX);
        let mut wins = vec![0_usize; actions.len()];
        for _ in 0..draws.max(1) {
            let draw = sampler.draw(&mut random);
            wins[argmax(&draw)] += 1;
        }
        Ok(ranked(actions.into_iter().zip(wins), draws.max(1)))
    }

    /// The actions of the whole grid that are the highest of at least one joint draw, the most likely first.
    ///
    /// # Errors
    /// When the grid is too large for joint draws or the covariance cannot be factored.
    pub fn best_of_grid(&self, draws: usize, seed: u64) -> Result<Vec<BestProbability>> {
        self.space().enumerable()?;
        let grid = Grid::new(self.space(), &self.utility);
        let mut random = Random::new(seed, u64::MAX - 1);
        let mut wins: HashMap<ActionIndex, usize> = HashMap::new();
        for _ in 0..draws.max(1) {
            let draw = thompson::draw(self.space(), &self.utility, &grid, &mut random)?;
            *wins.entry(ActionIndex(argmax(&draw) as u64)).or_default() += 1;
        }
        Ok(ranked(wins.into_iter(), draws.max(1)))
    }

    /// The average utility of each level of a dimension, over all levels of the other dimensions.
    ///
    /// # Errors
    /// When there is no such dimension.
    pub fn marginal(&self, dimension: usize) -> Result<Vec<Marginal>> {
        let chosen = self.dimension(dimension)?;
        let belief = &self.utility;
        let model = belief.model();
        (0..chosen.values.len())
            .map(|level| {
                let profile: Vec<Option<usize>> =
                    (0..self.space().dimensions().len()).map(|d| (d == dimension).then_some(level)).collect();
                let mut column: Vec<f64> =
                    model.levels.iter().map(|point| belief.kernel.average_with(&profile, point)).collect();
                let mean = dot(&column, &belief.approximation().weights);
                model.prior.solve_lower(&mut column);
                let (left, right) = belief.approximation().project(&model.prior, &column);
                let variance = belief.kernel.average_variance(&profile) - dot(&column, &column) + dot(&left, &right);
                Ok(Marginal {
                    value: chosen.values[level],
                    average: Prediction { mean, standard_deviation: variance.max(0.0).sqrt() },
                })
            })
            .collect()
    }

    /// Predictions over the levels of two different dimensions, the others as in `through`.
    ///
    /// # Errors
    /// When a dimension does not exist, both are the same, or the action is not in the space.
    pub fn slice(&self, row_dimension: usize, column_dimension: usize, through: ActionIndex) -> Result<Slice> {
        self.space().check(through)?;
        let rows = self.dimension(row_dimension)?.values.len();
        let columns = self.dimension(column_dimension)?.values.len();
        if row_dimension == column_dimension {
            return Err(LearnerError::InvalidDimension {
                dimension: self.dimension(row_dimension)?.name.clone(),
                reason: "a slice needs two different dimensions".into(),
            });
        }
        let mut levels = self.space().levels(through);
        let mut predictions = Vec::with_capacity(rows);
        for row in 0..rows {
            levels[row_dimension] = row;
            let mut line = Vec::with_capacity(columns);
            for column in 0..columns {
                levels[column_dimension] = column;
                line.push(self.predict(self.space().index_of_levels(&levels)?)?);
            }
            predictions.push(line);
        }
        Ok(Slice { row_dimension, column_dimension, predictions })
    }

    /// How many of the log's answers the posterior means agree with.
    pub fn agreement(&self) -> Agreement {
        let mean = |action: ActionIndex| self.utility.mean(action, &self.space().levels(action));
        let mut agreement = Agreement::default();
        for &feedback in self.feedback() {
            match feedback {
                Feedback::Preference { winner, loser } | Feedback::Suggestion { suggested: winner, over: loser } => {
                    agreement.comparisons += 1;
                    let agrees = match self.decided_by_labels(winner, loser) {
                        Some(converges) => converges == winner,
                        None => mean(winner) > mean(loser),
                    };
                    agreement.comparisons_agreeing += usize::from(agrees);
                }
                Feedback::Tie { a, b } => {
                    agreement.ties += 1;
                    let alike = (mean(a) - mean(b)).abs() <= self.settings().tie_width;
                    agreement.ties_agreeing += usize::from(alike && self.decided_by_labels(a, b).is_none());
                }
                Feedback::Label { action, category } => {
                    let settings = self.settings();
                    let within = |at: f64, interval: Interval| at >= interval.low && at <= interval.high;
                    let agrees = match &self.feasibility {
                        None => within(mean(action), settings.label_interval(category)),
                        Some(belief) => {
                            let at = belief.mean(action, &self.space().levels(action));
                            let grade = settings.grade_interval(category);
                            within(at, settings.feasibility_interval(category))
                                && grade.is_none_or(|interval| within(mean(action), interval))
                        }
                    };
                    agreement.labels += 1;
                    agreement.labels_agreeing += usize::from(agrees);
                }
            }
        }
        agreement
    }
}

fn argmax(values: &[f64]) -> usize {
    let mut best = 0;
    for (i, value) in values.iter().enumerate() {
        if *value > values[best] {
            best = i;
        }
    }
    best
}

fn ranked(wins: impl Iterator<Item = (ActionIndex, usize)>, draws: usize) -> Vec<BestProbability> {
    let mut ranked: Vec<(usize, ActionIndex)> = wins.map(|(action, wins)| (wins, action)).collect();
    ranked.sort_unstable_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
    ranked
        .into_iter()
        .map(|(wins, action)| BestProbability { action, probability: wins as f64 / draws as f64 })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::feedback::FeedbackLog;
    use crate::posterior::posterior;
    use crate::settings::{Labels, LearnerSettings, Method};
    use crate::space::{Dimension, SearchSpace};

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
                Feedback::Tie { a: b, b: ActionIndex(9) },
                Feedback::Label { action: c, category: 0 },
                Feedback::Suggestion { suggested: ActionIndex(2), over: b },
            ],
        }
    }

    #[test]
    fn marginals_are_averages_of_the_means() {
        for (additive_share, pairwise_share) in [(0.0, 0.0), (0.3, 0.4)] {
            let settings = LearnerSettings { additive_share, pairwise_share, ..LearnerSettings::of(Method::Eubo) };
            let belief = posterior(&space(), &log(), &settings).unwrap();
            for dimension in 0..3 {
                for (level, marginal) in belief.marginal(dimension).unwrap().iter().enumerate() {
                    // of the function without the nugget, which a point's own mean contains
                    let mut total = 0.0;
                    let mut count = 0.0;
                    for action in (0..24).map(ActionIndex) {
                        let levels = belief.space().levels(action);
                        if levels[dimension] == level {
                            let column = belief.utility.kernel.column(&levels, &belief.utility.model().levels);
                            total += dot(&column, &belief.utility.approximation().weights);
                            count += 1.0;
                        }
                    }
                    assert!((marginal.average.mean - total / count).abs() < 1e-10);
                    assert!(marginal.average.standard_deviation > 0.0 && marginal.average.standard_deviation < 1.0);
                }
            }
        }
    }

    /// Of two actions, being the best of those tried is being preferred without noise, however large the nugget.
    #[test]
    fn the_best_of_two_is_the_preferred_one_with_any_nugget() {
        for nugget in [1e-5, 0.1, 1.0] {
            let (winner, loser) = (ActionIndex(0), ActionIndex(20));
            let log =
                FeedbackLog { visited: vec![winner, loser], feedback: vec![Feedback::Preference { winner, loser }; 3] };
            let settings =
                LearnerSettings { nugget, preference_noise: 1e-3, ..LearnerSettings::published(Method::Eubo) };
            let belief = posterior(&space(), &log, &settings).unwrap();
            let preferred = belief.preference_probability(winner, loser).unwrap();
            let best = belief.best_of_visited(4000, 1).unwrap();
            assert_eq!(best[0].action, winner);
            assert!((best[0].probability - preferred).abs() < 0.012, "{nugget}: {} {preferred}", best[0].probability);
        }
    }

    #[test]
    fn answers_are_coherent() {
        for method in [Method::LineCoSpar, Method::Eubo] {
            for labels in [Labels::InUtility, Labels::Separate] {
                let settings = LearnerSettings { labels, ..LearnerSettings::of(method) };
                let belief = posterior(&space(), &log(), &settings).unwrap();
                let (a, b, c) = (ActionIndex(0), ActionIndex(7), ActionIndex(20));
                let (ab, ba) =
                    (belief.preference_probability(a, b).unwrap(), belief.preference_probability(b, a).unwrap());
                assert!(ab > 0.6 && (ab + ba - 1.0).abs() < 1e-9, "{ab} {ba}");
                assert!(belief.probability_of_converging(a).unwrap() > belief.probability_of_converging(c).unwrap());
                let categories = belief.category_probabilities(b).unwrap();
                assert!((categories.iter().sum::<f64>() - 1.0).abs() < 1e-9);
                let best = belief.best_of_visited(500, 1).unwrap();
                assert_eq!(best[0].action, a);
                assert!((best.iter().map(|b| b.probability).sum::<f64>() - 1.0).abs() < 1e-9);
                assert!(!belief.best_of_grid(50, 1).unwrap().is_empty());
                let agreement = belief.agreement();
                assert_eq!((agreement.comparisons, agreement.comparisons_agreeing), (2, 2));
                assert_eq!((agreement.labels, agreement.labels_agreeing, agreement.ties), (2, 2, 1));
                let slice = belief.slice(2, 0, a).unwrap();
                assert_eq!((slice.predictions.len(), slice.predictions[0].len()), (4, 2));
                assert_eq!(slice.predictions[0][0], belief.predict(a).unwrap());
                assert!(belief.slice(1, 1, a).is_err());
                for dimension in [3, usize::MAX] {
                    let unknown = Err(LearnerError::UnknownDimension { dimension, dimensions: 3 });
                    assert_eq!(belief.marginal(dimension), unknown);
                    assert!(belief.slice(0, dimension, a).is_err());
                }
            }
        }
    }

    #[test]
    fn separate_labels_speak_where_they_decide_a_comparison() {
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
        let belief = posterior(&space, &log, &settings).unwrap();
        assert!(belief.preference_probability(converges, fails).unwrap() > 0.7);
        assert_eq!((belief.agreement().comparisons, belief.agreement().comparisons_agreeing), (1, 1));
        // Answers against the labels, and two that both fail.
        log.feedback.extend([
            Feedback::Preference { winner: fails, loser: converges },
            Feedback::Tie { a: fails, b: converges },
            Feedback::Label { action: far, category: 0 },
        ]);
        for _ in 0..5 {
            for action in [fails, far] {
                log.feedback.push(Feedback::Label { action, category: 0 });
            }
        }
        let belief = posterior(&space, &log, &settings).unwrap();
        let agreement = belief.agreement();
        assert_eq!((agreement.comparisons, agreement.comparisons_agreeing, agreement.ties_agreeing), (2, 1, 0));
        let p = belief.preference_probability(fails, far).unwrap();
        assert!((p - 0.5).abs() < 0.1, "{p}");
        // Without a label, and where both converge, the utility alone speaks.
        let compared = FeedbackLog {
            visited: vec![other, converges],
            feedback: vec![Feedback::Preference { winner: other, loser: converges }; 3],
        };
        let belief = posterior(&space, &compared, &settings).unwrap();
        let labels = [other, converges].map(|action| Feedback::Label { action, category: 1 });
        let in_utility = LearnerSettings { labels: Labels::InUtility, ..settings.clone() };
        let unlabelled = posterior(&space, &compared, &in_utility).unwrap();
        let p = belief.preference_probability(other, converges).unwrap();
        assert_eq!(p.to_bits(), unlabelled.preference_probability(other, converges).unwrap().to_bits());
        let both = FeedbackLog { feedback: [&compared.feedback[..], &labels].concat(), ..compared };
        assert!(posterior(&space, &both, &settings).unwrap().preference_probability(other, converges).unwrap() > 0.7);
    }

    #[test]
    fn grades_above_the_lowest_category_reach_the_utility() {
        let dimension = Dimension { name: "x".into(), values: (0..9).map(f64::from).collect(), lengthscale: 1.0 };
        let space = SearchSpace::new(vec![dimension]).unwrap();
        let actions = [0, 2, 4, 6, 8].map(ActionIndex);
        let feedback = actions
            .iter()
            .zip([1, 2, 3, 4, 2])
            .map(|(&action, category)| Feedback::Label { action, category })
            .collect();
        let log = FeedbackLog { visited: actions.to_vec(), feedback };
        for labels in [Labels::InUtility, Labels::Separate] {
            for method in [Method::LineCoSpar, Method::Eubo] {
                let ordinal_thresholds = vec![-0.5, -0.1, 0.3, 0.7];
                let settings = LearnerSettings { labels, ordinal_thresholds, ..LearnerSettings::of(method) };
                let belief = posterior(&space, &log, &settings).unwrap();
                assert_eq!(belief.best(), Some(ActionIndex(6)), "{settings:?}");
                let agreement = belief.agreement();
                assert_eq!((agreement.labels, agreement.labels_agreeing), (5, 5), "{settings:?}");
                let categories = belief.category_probabilities(ActionIndex(6)).unwrap();
                assert!((categories.iter().sum::<f64>() - 1.0).abs() < 1e-9);
                assert_eq!(argmax(&categories), 4, "{categories:?}");
                let p = belief.preference_probability(ActionIndex(6), ActionIndex(0)).unwrap();
                // Laplace is cautious about whether either converges.
                assert!(p > 0.7, "{p} {settings:?}");
            }
        }
    }
}
