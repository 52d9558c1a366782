//! The prior covariance over the grid, from small tables over pairs of levels.
//!
//! The literature's kernel is the product over dimensions of squared exponentials `k_d`. Beside it stand the mean of
//! the `k_d` (a sum of functions of one quantity each) and the mean of their pairwise products (functions of two
//! quantities): `k = s2 (p prod_d k_d + a mean_d k_d + q mean_{d<e} k_d k_e)`, `p + a + q = 1`. All three are
//! polynomials in the tables, so the covariances of a whole grid split into two halves of its dimensions.

use crate::linalg::Square;
use crate::space::SearchSpace;

/// Shares and reach of the parts of a kernel.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct KernelShape {
    pub(crate) variance: f64,
    pub(crate) nugget: f64,
    /// Share of the pure product.
    pub(crate) product: f64,
    /// Share of functions of one quantity.
    pub(crate) additive: f64,
    /// Share of functions of two quantities.
    pub(crate) pairwise: f64,
    /// Lengthscales of the product, one per dimension, in the unit of the values.
    pub(crate) lengthscales: Vec<f64>,
    /// Lengthscales of the additive and pairwise parts.
    pub(crate) broad_lengthscales: Vec<f64>,
    /// Weight of every dimension in the additive and pairwise parts; mean 1.
    pub(crate) relevance: Vec<f64>,
}

/// Tables of the factors of the covariance.
#[derive(Debug, Clone)]
pub(crate) struct Kernel {
    pub(crate) variance: f64,
    pub(crate) nugget: f64,
    /// `s2 p`.
    product: f64,
    /// `s2 a / D`.
    additive: f64,
    /// `s2 q 2 / (D (D - 1))`.
    pairwise: f64,
    factors: Vec<Square>,
    broad: Vec<Square>,
}

/// The symmetric functions of the factors over some of the dimensions.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Symmetric {
    product: f64,
    first: f64,
    second: f64,
}

impl Kernel {
    pub(crate) fn new(space: &SearchSpace, shape: &KernelShape) -> Self {
        let tables = |lengthscales: &[f64], weights: Option<&[f64]>| {
            space
                .dimensions()
                .iter()
                .zip(lengthscales)
                .enumerate()
                .map(|(d, (dimension, lengthscale))| {
                    let weight = weights.map_or(1.0, |w| w[d]);
                    Square::from_fn(dimension.values.len(), |i, j| {
                        let r = (dimension.values[i] - dimension.values[j]) / lengthscale;
                        weight * crate::math::exp(-0.5 * r * r)
                    })
                })
                .collect::<Vec<_>>()
        };
        let count = space.dimensions().len() as f64;
        // e_2 of the weights, so that the pairwise part has its share of the variance
        let total: f64 = shape.relevance.iter().sum();
        let squares: f64 = shape.relevance.iter().map(|w| w * w).sum();
        let pairs = 0.5 * (total * total - squares);
        let pairwise = if pairs > 1e-9 * count { shape.variance * shape.pairwise / pairs } else { 0.0 };
        let additive_share = if pairwise > 0.0 { shape.additive } else { shape.additive + shape.pairwise };
        Self {
            variance: shape.variance,
            nugget: shape.nugget,
            product: shape.variance * shape.product,
            additive: shape.variance * additive_share / total,
            pairwise,
            factors: tables(&shape.lengthscales, None),
            broad: tables(&shape.broad_lengthscales, Some(&shape.relevance)),
        }
    }

    /// Whether the kernel is the pure product of its tables.
    pub(crate) fn is_product(&self) -> bool {
        self.additive == 0.0 && self.pairwise == 0.0
    }

    /// The table of correlations of the levels of a dimension in the product part.
    pub(crate) fn factor(&self, dimension: usize) -> &Square {
        &self.factors[dimension]
    }

    /// The table of a dimension in the additive and pairwise parts.
    pub(crate) fn broad(&self, dimension: usize) -> &Square {
        &self.broad[dimension]
    }

    /// Weights of the product, the sum of tables and the sum of products of two tables.
    pub(crate) fn weights(&self) -> [f64; 3] {
        [self.product, self.additive, self.pairwise]
    }

    pub(crate) fn symmetric(&self, from: usize, a: &[usize], b: &[usize]) -> Symmetric {
        let mut s = Symmetric { product: 1.0, first: 0.0, second: 0.0 };
        for (d, (&i, &j)) in a.iter().zip(b).enumerate() {
            s.product *= self.factors[from + d].at(i, j);
        }
        if !self.is_product() {
            for (d, (&i, &j)) in a.iter().zip(b).enumerate() {
                let k = self.broad[from + d].at(i, j);
                s.second += s.first * k;
                s.first += k;
            }
        }
        s
    }

    /// [`Self::symmetric`] of every combination of levels of some of the dimensions with one, the last dimension
    /// running fastest.
    pub(crate) fn combinations(&self, from: usize, b: &[usize]) -> Vec<Symmetric> {
        let pure = self.is_product();
        let mut all = vec![Symmetric { product: 1.0, first: 0.0, second: 0.0 }];
        for (d, &j) in b.iter().enumerate() {
            // The tables are symmetric.
            let (factors, broad) = (self.factors[from + d].row(j), self.broad[from + d].row(j));
            let mut longer = Vec::with_capacity(all.len() * factors.len());
            for s in &all {
                for (factor, k) in factors.iter().zip(broad) {
                    let (first, second) = if pure { (0.0, 0.0) } else { (s.first + k, s.second + s.first * k) };
                    longer.push(Symmetric { product: s.product * factor, first, second });
                }
            }
            all = longer;
        }
        all
    }

    /// The first term of [`Self::split`] of [`Self::combinations`].
    pub(crate) fn products(&self, from: usize, b: &[usize], left: bool, into: &mut Vec<f64>) {
        into.clear();
        into.push(if left { self.product } else { 1.0 });
        // The last dimension first, from behind: the combinations of the dimensions done so far stay together.
        for (d, &j) in b.iter().enumerate().rev() {
            let done = into.len();
            let factors = self.factors[from + d].row(j);
            for factor in &factors[1..] {
                into.extend_from_within(..done);
                let start = into.len() - done;
                into[start..].iter_mut().for_each(|value| *value *= factor);
            }
            into[..done].iter_mut().for_each(|value| *value *= factors[0]);
        }
    }

    /// Covariance from the symmetric functions of two complementary parts of the dimensions.
    pub(crate) fn join(&self, y: Symmetric, z: Symmetric) -> f64 {
        let product = self.product * y.product * z.product;
        if self.is_product() {
            return product;
        }
        product + self.additive * (y.first + z.first) + self.pairwise * (y.second + y.first * z.first + z.second)
    }

    /// Covariance of the utilities of two actions given by their levels.
    pub(crate) fn covariance(&self, a: &[usize], b: &[usize]) -> f64 {
        self.join(self.symmetric(0, a, b), Symmetric { product: 1.0, first: 0.0, second: 0.0 })
    }

    /// Covariance from the factors of every dimension.
    fn combine(&self, factors: impl Iterator<Item = (f64, f64)>) -> f64 {
        let mut s = Symmetric { product: 1.0, first: 0.0, second: 0.0 };
        for (product, broad) in factors {
            s.product *= product;
            s.second += s.first * broad;
            s.first += broad;
        }
        self.join(s, Symmetric { product: 1.0, first: 0.0, second: 0.0 })
    }

    /// Covariance of one action with the average over all levels of the dimensions that a profile leaves open.
    pub(crate) fn average_with(&self, profile: &[Option<usize>], point: &[usize]) -> f64 {
        let mean = |table: &Square, j: usize| table.row(j).iter().sum::<f64>() / table.order() as f64;
        self.combine(profile.iter().zip(point).zip(self.factors.iter().zip(&self.broad)).map(
            |((level, &j), (factor, broad))| match *level {
                Some(i) => (factor.at(i, j), broad.at(i, j)),
                None => (mean(factor, j), mean(broad, j)),
            },
        ))
    }

    /// Prior variance of the average over all levels of the dimensions that a profile leaves open.
    pub(crate) fn average_variance(&self, profile: &[Option<usize>]) -> f64 {
        let mean = |table: &Square| {
            let n = table.order();
            (0..n).map(|i| table.row(i).iter().sum::<f64>()).sum::<f64>() / (n * n) as f64
        };
        self.combine(profile.iter().zip(self.factors.iter().zip(&self.broad)).map(|(level, (factor, broad))| {
            match *level {
                Some(i) => (factor.at(i, i), broad.at(i, i)),
                None => (mean(factor), mean(broad)),
            }
        }))
    }

    /// Covariances of one action with many.
    pub(crate) fn column(&self, a: &[usize], points: &[Vec<usize>]) -> Vec<f64> {
        points.iter().map(|b| self.covariance(a, b)).collect()
    }

    /// The terms of [`Self::join`]: `(coupled, separate)` with `k = y.coupled . z.coupled + y.separate + z.separate`.
    pub(crate) fn split(&self, s: Symmetric, left: bool) -> ([f64; 2], f64) {
        let (p, q) = if left { (self.product, self.pairwise) } else { (1.0, 1.0) };
        ([p * s.product, q * s.first], self.additive * s.first + self.pairwise * s.second)
    }
}
