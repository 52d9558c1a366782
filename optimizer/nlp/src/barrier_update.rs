//! Updates of the barrier parameter: monotone (Fiacco-McCormick) or adaptive (LOQO rule).

use crate::barrier;
use crate::formulation::Objective;
use crate::iterate::Iterate;
use crate::optimality::OptimalityError;
use crate::settings::{BarrierStrategy, NlpSettings};

impl Iterate<'_> {
    /// Sets mu and resets the filter; in the restoration phase the proximal weight follows mu.
    fn set_mu(&mut self, mu: f64) {
        self.mu = mu;
        self.filter.clear();
        self.search.end_watch();
        if let Objective::Restoration { zeta, .. } = &mut self.form.objective {
            *zeta = mu.sqrt();
            self.objective = self.form.objective(&self.point.w);
            self.form.gradient(&self.point.w, &mut self.gradient);
            self.update_lagrangian();
        }
    }

    /// Updates mu: reduces it while the barrier problem is solved accurately enough (`force`: at least once), or
    /// follows the LOQO rule.
    pub(crate) fn update_mu(&mut self, settings: &NlpSettings, now: &OptimalityError, mut force: bool) {
        let smallest = barrier::smallest_mu(settings, self.form.objective_scale);
        if settings.barrier_strategy == BarrierStrategy::Adaptive {
            let error = now.error();
            let recent = &mut self.free_mu.recent;
            let progress = recent.len() < 4 || recent.iter().any(|e| error <= 0.9999 * e);
            recent.push(error);
            if recent.len() > 4 {
                recent.remove(0);
            }
            if progress && !force {
                if let Some(mu) = barrier::loqo_mu(&self.point, &self.at) {
                    self.free_mu.free = true;
                    self.set_mu(mu.clamp(smallest, 1e5));
                    return;
                }
            } else if self.free_mu.free {
                self.free_mu.free = false;
                let average = barrier::average_complementarity(&self.point, &self.at).unwrap_or(self.mu);
                self.set_mu((0.8 * average).clamp(smallest, 1e5));
            }
        }
        while self.mu > smallest
            && (force || self.optimality(self.mu).error() <= settings.constants.kappa_epsilon * self.mu)
        {
            self.set_mu(barrier::reduced_mu(settings, self.mu, smallest));
            force = false;
        }
    }
}
