//! Site-by-site updates of an approximation by rank-one changes of its covariance.
//!
//! A new factor of one site changes the `n x n` covariance by a matrix of rank one. An update costs `O(n^2)`; detecting
//! that a site needs none costs `O(1)`. The method chooses the new factor from the cavity of the site: the distribution
//! of its functional under all other factors.

use super::approximation::{Approximation, Factor, whitened_precision};
use crate::error::Result;
use crate::linalg::{Cholesky, Square, add_scaled, dot};
use crate::observations::{ObservedPoints, Site};

/// Normal distribution of a site's functional without the factor of the site.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cavity {
    pub(super) mean: f64,
    pub(super) precision: f64,
}

/// Rule by which a method chooses factors.
pub(super) trait FactorRule {
    /// The factor of a site, given its cavity. `None` keeps the present factor.
    fn factor(&self, site: &Site, cavity: Cavity) -> Option<Factor>;

    /// A cheap sufficient test that the present factor needs no update, at the present moments of the functional.
    fn settled(&self, _site: &Site, _present: Factor, _mean: f64, _variance: f64) -> bool {
        false
    }
}

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
    pub(super) factors: Vec<Factor>,
}

impl WorkingApproximation {
    /// Continues from an approximation of the same points and sites.
    pub(super) fn of(approximation: &Approximation) -> Self {
        Self {
            covariance: approximation.covariance.clone(),
            delayed: Vec::new(),
            mean: approximation.mean.clone(),
            factors: approximation.factors.clone(),
        }
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

    /// Extends the previous approximation. New points get their conditional prior, new sites the factor 1.
    pub(super) fn extend(observed: &ObservedPoints, previous: Option<&Approximation>) -> Self {
        let n = observed.prior.order();
        let mut working = match previous {
            Some(Approximation { mean, factors, covariance, .. }) => Self {
                covariance: covariance.grown(n - mean.len()),
                delayed: Vec::new(),
                mean: mean.clone(),
                factors: factors.clone(),
            },
            None => Self { covariance: Square::zeros(n), delayed: Vec::new(), mean: Vec::new(), factors: Vec::new() },
        };
        let old = working.mean.len();
        working.mean.resize(n, 0.0);
        working.factors.resize(observed.sites.len(), Factor::default());
        for i in old..n {
            // Row i of L holds the whitened covariances with the earlier points and the conditional standard deviation.
            let row = observed.prior.row(i);
            let mut gain = row[..i].to_vec();
            observed.prior.solve_upper(&mut gain);
            let with_others: Vec<f64> = (0..i).map(|j| dot(&working.covariance.row(j)[..i], &gain)).collect();
            working.mean[i] = dot(&working.mean[..i], &gain);
            for (j, &c) in with_others.iter().enumerate() {
                working.covariance.row_mut(j)[i] = c;
            }
            let last = working.covariance.row_mut(i);
            last[..i].copy_from_slice(&with_others);
            last[i] = row[i] * row[i] + dot(&with_others, &gain);
        }
        working
    }

    /// The cavity of a site with this factor. `None` if it is improper.
    pub(super) fn cavity(&self, site: &Site, factor: Factor) -> Option<Cavity> {
        let variance = self.variance(site);
        if variance.is_nan() || variance < 1e-14 {
            return None;
        }
        let precision = 1.0 / variance - factor.precision;
        (precision >= MIN_CAVITY / variance)
            .then(|| Cavity { mean: (site.of(&self.mean) / variance - factor.shift) / precision, precision })
    }

    /// Updates one factor if the mean moves by more than `tolerance` standard deviations or the variance by more than
    /// that share. Returns whether it did.
    fn replace(&mut self, index: usize, site: &Site, rule: &dyn FactorRule, tolerance: f64) -> bool {
        let old = self.factors[index];
        let (mean, spread) = (site.of(&self.mean), self.variance(site));
        if tolerance > 0.0 && rule.settled(site, old, mean, spread) {
            return false;
        }
        let Some(new) = self.cavity(site, old).and_then(|cavity| rule.factor(site, cavity)) else { return false };
        let (more_precision, more_shift) = (new.precision - old.precision, new.shift - old.shift);
        let gain = 1.0 / (more_precision * spread + 1.0);
        let move_by = (more_shift - more_precision * mean) * gain;
        if (move_by * spread.sqrt()).abs() < tolerance && (more_precision * spread * gain).abs() < tolerance {
            return false;
        }
        let column = self.column(site);
        add_scaled(&mut self.mean, move_by, &column);
        self.delayed.push((-more_precision * gain, column));
        if self.delayed.len() == DELAYED {
            self.apply_delayed();
        }
        self.factors[index] = new;
        true
    }

    /// Updates the new sites, then sweeps over all sites until none needs an update. Returns whether that happened
    /// within `sweeps` sweeps.
    pub(super) fn sweep(
        &mut self,
        sites: &[Site],
        first_new: usize,
        rule: &dyn FactorRule,
        tolerance: f64,
        sweeps: usize,
    ) -> bool {
        for (index, site) in sites.iter().enumerate().skip(first_new) {
            self.replace(index, site, rule, 0.0);
        }
        let mut settled = false;
        for _ in 0..sweeps {
            settled = true;
            for (index, site) in sites.iter().enumerate() {
                settled &= !self.replace(index, site, rule, tolerance);
            }
            if settled {
                break;
            }
        }
        self.apply_delayed();
        settled
    }

    /// Recomputes covariance and mean from the factors.
    pub(super) fn refresh(&mut self, prior: &Cholesky, sites: &[Site]) -> Result<()> {
        let precision = whitened_precision(prior, sites, &self.factors)?;
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
        let mut whitened = self.mean.clone();
        prior.solve_lower(&mut whitened);
        let mut weights = whitened.clone();
        prior.solve_upper(&mut weights);
        Approximation { mean: self.mean, weights, whitened, factors: self.factors, covariance: self.covariance }
    }
}

/// Posterior covariance `L B^-1 L'`; `precision` is the Cholesky factor of `B`.
pub(super) fn covariance(prior: &Cholesky, precision: &Cholesky) -> Square {
    let n = prior.order();
    let mut columns = Square::zeros(n);
    for i in 0..n {
        let row = columns.row_mut(i);
        row[..=i].copy_from_slice(prior.row(i));
        precision.solve_lower(row);
    }
    columns.outer_product()
}

/// `sum_s shift_s a_s`, `a_s` the coefficients of site `s`.
pub(super) fn shifts(n: usize, sites: &[Site], factors: &[Factor]) -> Vec<f64> {
    let mut h = vec![0.0; n];
    for (site, factor) in sites.iter().zip(factors) {
        h[site.plus] += factor.shift;
        if let Some(minus) = site.minus {
            h[minus] -= factor.shift;
        }
    }
    h
}
