//! A normal distribution of the points improved answer by answer.
//!
//! The covariance of the points is kept whole. Replacing the normal factor of one answer changes it by a matrix of
//! rank one: `O(n^2)` for a replacement, `O(1)` for finding that none is needed. What the new factor is, given the
//! distribution of the answer's functional under all other answers (its cavity), is the method's affair.

use super::{Approximation, Factor, whitened_precision};
use crate::error::Result;
use crate::linalg::{Cholesky, Square, add_scaled, dot};
use crate::model::{Model, Site};

/// Distribution of an answer's functional when the answer is left out.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cavity {
    pub(super) mean: f64,
    pub(super) precision: f64,
}

/// Chooses factors.
pub(super) trait Match {
    /// The factor of an answer, given its cavity.
    fn factor(&self, site: &Site, cavity: Cavity) -> Option<Factor>;

    /// Whether the present factor surely need not be replaced, at the present mean of the functional.
    fn settled(&self, _site: &Site, _present: Factor, _mean: f64, _variance: f64) -> bool {
        false
    }
}

/// Cavities with less than this share of the marginal's precision are left alone.
const MIN_CAVITY: f64 = 1e-10;

/// Changes of the covariance that are applied in one pass over it.
const DELAYED: usize = 16;

/// The normal distribution being improved.
pub(super) struct Working {
    /// The covariance, less the changes not applied yet.
    covariance: Square,
    /// Changes `a x x'` not applied yet: while they are few, adding them to what is read costs less.
    delayed: Vec<(f64, Vec<f64>)>,
    pub(super) mean: Vec<f64>,
    pub(super) factors: Vec<Factor>,
}

impl Working {
    /// The distribution of an approximation.
    pub(super) fn of(approximation: &Approximation) -> Self {
        Self {
            covariance: approximation.covariance.clone(),
            delayed: Vec::new(),
            mean: approximation.mean.clone(),
            factors: approximation.factors.clone(),
        }
    }

    fn variance(&self, site: &Site) -> f64 {
        let c = &self.covariance;
        let at = c.at(site.plus, site.plus);
        let applied = site.minus.map_or(at, |m| at + c.at(m, m) - 2.0 * c.at(site.plus, m));
        self.delayed.iter().fold(applied, |sum, (a, x)| {
            let along = site.of(x);
            sum + a * along * along
        })
    }

    /// Covariances of a site's functional with the points.
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

    /// The previous distribution with the new points added, each given the others; new answers have no factor yet.
    pub(super) fn extend(model: &Model, previous: Option<&Approximation>) -> Self {
        let n = model.prior.order();
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
        working.factors.resize(model.sites.len(), Factor::default());
        for i in old..n {
            // Row i of the prior factor holds the whitened covariances with the earlier points and what remains.
            let row = model.prior.row(i);
            let mut gain = row[..i].to_vec();
            model.prior.solve_upper(&mut gain);
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

    pub(super) fn cavity(&self, site: &Site, factor: Factor) -> Option<Cavity> {
        let variance = self.variance(site);
        if variance.is_nan() || variance < 1e-14 {
            return None;
        }
        let precision = 1.0 / variance - factor.precision;
        (precision >= MIN_CAVITY / variance)
            .then(|| Cavity { mean: (site.of(&self.mean) / variance - factor.shift) / precision, precision })
    }

    /// Replaces one factor if the change is worth it: in posterior standard deviations and relative variance.
    fn replace(&mut self, index: usize, site: &Site, method: &dyn Match, tolerance: f64) -> bool {
        let old = self.factors[index];
        let (mean, spread) = (site.of(&self.mean), self.variance(site));
        if tolerance > 0.0 && method.settled(site, old, mean, spread) {
            return false;
        }
        let Some(new) = self.cavity(site, old).and_then(|cavity| method.factor(site, cavity)) else { return false };
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

    /// Replaces factors, the new answers' first, until none is worth it; whether that was reached.
    pub(super) fn sweep(
        &mut self,
        sites: &[Site],
        first_new: usize,
        method: &dyn Match,
        tolerance: f64,
        sweeps: usize,
    ) -> bool {
        for (index, site) in sites.iter().enumerate().skip(first_new) {
            self.replace(index, site, method, 0.0);
        }
        let mut settled = false;
        for _ in 0..sweeps {
            settled = true;
            for (index, site) in sites.iter().enumerate() {
                settled &= !self.replace(index, site, method, tolerance);
            }
            if settled {
                break;
            }
        }
        self.apply_delayed();
        settled
    }

    /// Computes covariance and mean from the factors.
    pub(super) fn refresh(&mut self, prior: &Cholesky, sites: &[Site]) -> Result<()> {
        let precision = whitened_precision(prior, sites, &self.factors)?;
        self.covariance = covariance(prior, &precision);
        self.delayed.clear();
        self.mean = self.covariance.multiply(&shifts(prior.order(), sites, &self.factors));
        Ok(())
    }

    pub(super) fn is_sound(&self) -> bool {
        let n = self.mean.len();
        self.mean.iter().all(|m| m.is_finite()) && (0..n).all(|i| self.covariance.at(i, i) >= 0.0)
    }

    pub(super) fn finish(self, prior: &Cholesky) -> Approximation {
        let mut whitened = self.mean.clone();
        prior.solve_lower(&mut whitened);
        let mut weights = whitened.clone();
        prior.solve_upper(&mut weights);
        Approximation { mean: self.mean, weights, whitened, factors: self.factors, covariance: self.covariance }
    }
}

/// `L B^-1 L'`.
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

/// `sum_s shift_s a_s`.
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
