//! Moments of the difference between every action and the incumbent, and the probability that an action is feasible.

use crate::acquisition::eubo_bounds::ProbabilityBound;
use crate::action::ActionIndex;
use crate::action_moments::{ActionMoments, ActionSet};
use crate::gaussian_process::GaussianProcess;
use crate::search_space::SearchSpace;
use crate::special_functions;

/// Moments of the difference between every action and the incumbent.
pub(super) struct Duel<'a> {
    pub(super) moments: ActionMoments<'a>,
    incumbent_mean: f64,
    incumbent_variance: f64,
    pub(super) means: Vec<f64>,
    /// Posterior covariances with the incumbent.
    covariances: Vec<f64>,
    /// Prior covariances with the incumbent.
    prior: Vec<f64>,
    /// Reduction of the incumbent's variance by its observations.
    spent: f64,
    /// For each pending action, a vector over the actions whose squares its observation would subtract from the variances.
    pending: Vec<Vec<f64>>,
}

impl<'a> Duel<'a> {
    /// `set` must have the incumbent and the pending actions.
    pub(super) fn new(
        space: &SearchSpace,
        process: &'a GaussianProcess,
        set: &ActionSet,
        best: ActionIndex,
        pending: &[ActionIndex],
    ) -> Self {
        let moments = ActionMoments::new(space, process, set);
        let view = process.view(best, space.levels(best));
        let incumbent_variance = process.variance(&view);
        let prior = moments.prior_with(space, best);
        let means = moments.form(&process.approximation().weights);
        let mut covariances = moments.form(&process.covariance_weights(&view));
        for (covariance, prior) in covariances.iter_mut().zip(&prior) {
            *covariance += prior;
        }
        let spent = (process.kernel.variance + process.kernel.nugget - incumbent_variance).max(1e-12);
        let mut duel = Self {
            moments,
            incumbent_mean: view.mean,
            incumbent_variance,
            means,
            covariances,
            prior,
            spent,
            pending: Vec::new(),
        };
        for &action in pending {
            duel.suppose_known(space, process, set, action, best);
        }
        duel
    }

    /// Conditions variances and covariances on the utility of a pending action. Means stay as they are.
    fn suppose_known(
        &mut self,
        space: &SearchSpace,
        process: &GaussianProcess,
        set: &ActionSet,
        action: ActionIndex,
        best: ActionIndex,
    ) {
        let (Some(at), Some(incumbent)) = (set.position(action), set.position(best)) else { return };
        let view = process.view(action, space.levels(action));
        let weights = process.covariance_weights(&view);
        let mut column = self.moments.form(&weights);
        for (value, prior) in column.iter_mut().zip(self.moments.prior_with(space, action)) {
            *value += prior;
        }
        let mut variance = process.variance(&view) + process.kernel.nugget;
        for earlier in &self.pending {
            let own = earlier[at];
            variance -= own * own;
            for (value, r) in column.iter_mut().zip(earlier) {
                *value -= own * r;
            }
        }
        let sd = variance.max(process.kernel.nugget).sqrt();
        for value in &mut column {
            *value /= sd;
        }
        let with_best = column[incumbent];
        self.incumbent_variance = (self.incumbent_variance - with_best * with_best).max(0.0);
        for (covariance, r) in self.covariances.iter_mut().zip(&column) {
            *covariance -= r * with_best;
        }
        self.pending.push(column);
    }

    /// Reduction of an action's variance by the pending actions.
    fn pending_reduction(&self, x: usize) -> f64 {
        self.pending.iter().map(|r| r[x] * r[x]).sum()
    }

    /// Mean of the difference.
    pub(super) fn lead(&self, x: usize) -> f64 {
        self.means[x] - self.incumbent_mean
    }

    /// Variance of the difference, given the action's own variance.
    pub(super) fn variance(&self, x: usize, own: f64) -> f64 {
        (own - self.pending_reduction(x) + self.incumbent_variance - 2.0 * self.covariances[x]).max(0.0)
    }

    /// Upper bound of the action's own variance. The Cauchy-Schwarz inequality bounds the reduction from below.
    pub(super) fn variance_bound(&self, x: usize, total: f64) -> f64 {
        if !self.pending.is_empty() {
            return total;
        }
        total - (self.prior[x] - self.covariances[x]).powi(2) / self.spent
    }
}

/// Probability that an action is feasible.
pub(super) struct Chance<'a> {
    moments: ActionMoments<'a>,
    pub(super) means: Vec<f64>,
    threshold: f64,
    prior_sd: f64,
    bounds: ProbabilityBound,
}

impl<'a> Chance<'a> {
    pub(super) fn new(space: &SearchSpace, process: &'a GaussianProcess, set: &ActionSet, threshold: f64) -> Self {
        let moments = ActionMoments::new(space, process, set);
        let means = moments.form(&process.approximation().weights);
        Self { moments, means, threshold, prior_sd: process.kernel.variance.sqrt(), bounds: ProbabilityBound::new() }
    }

    pub(super) fn bound(&self, x: usize) -> f64 {
        self.bounds.of((self.means[x] - self.threshold) / self.prior_sd)
    }

    pub(super) fn of(&self, actions: &[usize]) -> Vec<f64> {
        let variances = self.moments.variances(actions);
        let chance = |(&x, v): (&usize, f64)| {
            special_functions::normal_cdf((self.means[x] - self.threshold) / v.max(1e-12).sqrt())
        };
        actions.iter().zip(variances).map(chance).collect()
    }
}
