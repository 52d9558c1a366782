//! Site-by-site updates of an approximation by rank-one changes of its covariance.
//!
//! A new factor of one site changes the `n x n` covariance by a matrix of rank one. An update costs `O(n^2)`; detecting
//! that a site needs none costs `O(1)`. The new factor follows from the cavity of the site: the distribution of its
//! functional under all other factors.

use super::approximation::{Approximation, SiteFactor, covariance, whitened_precision};
use crate::error::Result;
use crate::linalg::{Cholesky, Square, add_scaled};
use crate::observations::Site;

/// Normal distribution of a site's functional without the factor of the site.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cavity {
    pub(super) mean: f64,
    pub(super) precision: f64,
}

/// The new factor of a site, given its cavity. `None` keeps the present factor.
pub(super) type Rule<'a> = dyn Fn(&Site, Cavity) -> Option<SiteFactor> + 'a;

/// Smallest precision of a usable cavity, as a share of the precision of the marginal.
const MIN_CAVITY: f64 = 1e-10;

/// Number of rank-one changes that one pass over the covariance applies.
const DELAYED: usize = 16;

/// An approximation during updates.
pub(super) struct WorkingApproximation {
    /// The covariance without the delayed changes.
    covariance: Square,
    /// Delayed changes `a x x'`, which every read of the covariance adds. Applying several at once saves memory
    /// traffic.
    delayed: Vec<(f64, Vec<f64>)>,
    pub(super) mean: Vec<f64>,
    pub(super) factors: Vec<SiteFactor>,
}

impl WorkingApproximation {
    /// The approximation of these factors.
    pub(super) fn of(prior: &Cholesky, sites: &[Site], factors: Vec<SiteFactor>) -> Result<Self> {
        let mut working =
            Self { covariance: Square::zeros(prior.order()), delayed: Vec::new(), mean: Vec::new(), factors };
        working.refresh(prior, sites)?;
        Ok(working)
    }

    /// Posterior variance of a site's functional.
    fn variance(&self, site: &Site) -> f64 {
        let c = &self.covariance;
        let at = c.at(site.plus, site.plus);
        let applied = site.minus.map_or(at, |m| at + c.at(m, m) - 2.0 * c.at(site.plus, m));
        self.delayed.iter().fold(applied, |sum, (a, x)| {
            let along = site.of(x);
            sum + a * along * along
        })
    }

    /// Posterior covariances of a site's functional with the points.
    fn column(&self, site: &Site) -> Vec<f64> {
        let mut column = self.covariance.row(site.plus).to_vec();
        if let Some(minus) = site.minus {
            add_scaled(&mut column, -1.0, self.covariance.row(minus));
        }
        for (a, x) in &self.delayed {
            add_scaled(&mut column, a * site.of(x), x);
        }
        column
    }

    fn apply_delayed(&mut self) {
        self.covariance.add_rank_ones(&self.delayed);
        self.delayed.clear();
    }

    /// The cavity of a site with this factor. `None` if it is improper.
    fn cavity(&self, site: &Site, factor: SiteFactor) -> Option<Cavity> {
        let variance = self.variance(site);
        if variance.is_nan() || variance < 1e-14 {
            return None;
        }
        let precision = 1.0 / variance - factor.precision;
        (precision >= MIN_CAVITY / variance)
            .then(|| Cavity { mean: (site.of(&self.mean) / variance - factor.shift) / precision, precision })
    }

    /// Moves one factor by a share of the way to its new value, if the mean moves by more than `tolerance` standard
    /// deviations or the variance by more than that share. Returns whether it did.
    fn replace(&mut self, index: usize, site: &Site, rule: &Rule<'_>, tolerance: f64, share: f64) -> bool {
        let old = self.factors[index];
        let (mean, spread) = (site.of(&self.mean), self.variance(site));
        let Some(new) = self.cavity(site, old).and_then(|cavity| rule(site, cavity)) else { return false };
        let (more_precision, more_shift) = (new.precision - old.precision, new.shift - old.shift);
        let change = |share: f64| {
            let gain = 1.0 / (share * more_precision * spread + 1.0);
            (share * (more_shift - more_precision * mean) * gain, share * more_precision * gain)
        };
        let (move_by, narrow_by) = change(1.0);
        if (move_by * spread.sqrt()).abs() < tolerance && (narrow_by * spread).abs() < tolerance {
            return false;
        }
        let (move_by, narrow_by) = change(share);
        let column = self.column(site);
        add_scaled(&mut self.mean, move_by, &column);
        self.delayed.push((-narrow_by, column));
        if self.delayed.len() == DELAYED {
            self.apply_delayed();
        }
        self.factors[index] =
            SiteFactor { precision: old.precision + share * more_precision, shift: old.shift + share * more_shift };
        true
    }

    /// Updates each site in turn. Returns whether none needed an update.
    pub(super) fn sweep(&mut self, sites: &[Site], rule: &Rule<'_>, tolerance: f64, share: f64) -> bool {
        let mut settled = true;
        for (index, site) in sites.iter().enumerate() {
            settled &= !self.replace(index, site, rule, tolerance, share);
        }
        self.apply_delayed();
        settled
    }

    /// Recomputes covariance and mean from the factors.
    pub(super) fn refresh(&mut self, prior: &Cholesky, sites: &[Site]) -> Result<()> {
        let precision = whitened_precision(prior, sites, self.factors.iter().map(|factor| factor.precision))?;
        self.covariance = covariance(prior, &precision);
        self.delayed.clear();
        self.mean = self.covariance.multiply(&shifts(prior.order(), sites, &self.factors));
        Ok(())
    }

    /// Whether means are finite and variances non-negative.
    pub(super) fn is_sound(&self) -> bool {
        let n = self.mean.len();
        self.mean.iter().all(|m| m.is_finite()) && (0..n).all(|i| self.covariance.at(i, i) >= 0.0)
    }

    /// The approximation after the updates.
    pub(super) fn finish(self, prior: &Cholesky) -> Approximation {
        let mut weights = self.mean.clone();
        prior.solve(&mut weights);
        Approximation { mean: self.mean, weights, covariance: self.covariance }
    }
}

/// `sum_s shift_s a_s`, `a_s` the coefficients of site `s`.
fn shifts(n: usize, sites: &[Site], factors: &[SiteFactor]) -> Vec<f64> {
    let mut h = vec![0.0; n];
    for (site, factor) in sites.iter().zip(factors) {
        h[site.plus] += factor.shift;
        if let Some(minus) = site.minus {
            h[minus] -= factor.shift;
        }
    }
    h
}
