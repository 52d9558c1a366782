//! The prior covariance of the utility, from one table of correlations between levels for each dimension.
//!
//! The kernel is `k = s2 (p prod_d k_d + a mean_d b_d + q mean_{d<e} b_d b_e)`, `p + a + q = 1`, with squared
//! exponentials `k_d` and `b_d` in dimension `d`. The first part is the kernel of the literature. The second is a sum
//! of functions of one dimension, the third a sum of functions of two; both have broad lengthscales. All parts are
//! polynomials in the tables, so that the covariances of a grid split into the two halves of its dimensions
//! (`whole_grid.rs`).

use crate::linalg::Square;
use crate::search_space::SearchSpace;

/// Shares and lengthscales of the parts of a kernel.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct KernelShape {
    pub(crate) variance: f64,
    pub(crate) nugget: f64,
    /// Share `p` of the product.
    pub(crate) product: f64,
    /// Share `a` of functions of one dimension.
    pub(crate) additive: f64,
    /// Share `q` of functions of two dimensions.
    pub(crate) pairwise: f64,
    /// Lengthscale of the product in each dimension, in the unit of its values.
    pub(crate) lengthscales: Vec<f64>,
    /// Lengthscale of the additive and pairwise parts in each dimension.
    pub(crate) broad_lengthscales: Vec<f64>,
}

/// A kernel on the grid of a search space of `D` dimensions.
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
    /// Tables of `k_d`.
    factors: Vec<Square>,
    /// Tables of `b_d`.
    broad: Vec<Square>,
}

/// Elementary symmetric functions over some of the dimensions, from which the kernel follows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Symmetric {
    /// `prod k_d`.
    product: f64,
    /// `sum b_d`.
    first: f64,
    /// `sum_{d<e} b_d b_e`.
    second: f64,
}

impl Kernel {
    pub(crate) fn new(space: &SearchSpace, shape: &KernelShape) -> Self {
        let tables = |lengthscales: &[f64]| {
            space
                .dimensions()
                .iter()
                .zip(lengthscales)
                .map(|(dimension, lengthscale)| {
                    Square::from_fn(dimension.values.len(), |i, j| {
                        let r = (dimension.values[i] - dimension.values[j]) / lengthscale;
                        crate::special_functions::exp(-0.5 * r * r)
                    })
                })
                .collect::<Vec<_>>()
        };
        let count = space.dimensions().len() as f64;
        let pairs = 0.5 * (count * count - count);
        // One dimension has no pair: its share is additive.
        let pairwise = if pairs > 0.0 { shape.variance * shape.pairwise / pairs } else { 0.0 };
        let additive_share = if pairwise > 0.0 { shape.additive } else { shape.additive + shape.pairwise };
        Self {
            variance: shape.variance,
            nugget: shape.nugget,
            product: shape.variance * shape.product,
            additive: shape.variance * additive_share / count,
            pairwise,
            factors: tables(&shape.lengthscales),
            broad: tables(&shape.broad_lengthscales),
        }
    }

    /// Whether the kernel has the product part only.
    pub(crate) fn is_product(&self) -> bool {
        self.additive == 0.0 && self.pairwise == 0.0
    }

    /// Table of `k_d`: correlations between the levels of a dimension in the product part.
    pub(crate) fn factor(&self, dimension: usize) -> &Square {
        &self.factors[dimension]
    }

    /// Table of `b_d`: correlations between the levels of a dimension in the additive and pairwise parts.
    pub(crate) fn broad(&self, dimension: usize) -> &Square {
        &self.broad[dimension]
    }

    /// Weights of `prod k_d`, `sum b_d` and `sum_{d<e} b_d b_e`.
    pub(crate) fn weights(&self) -> [f64; 3] {
        [self.product, self.additive, self.pairwise]
    }

    /// The symmetric functions of two lists of levels of some of the dimensions, starting with dimension `from`.
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

    /// [`Self::symmetric`] of every combination of levels with `b`; the last dimension varies fastest.
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

    /// The product term of [`Self::split`] of all [`Self::combinations`], without the others.
    pub(crate) fn products(&self, from: usize, b: &[usize], left: bool, into: &mut Vec<f64>) {
        into.clear();
        into.push(if left { self.product } else { 1.0 });
        // From the last dimension to the first, so that the combinations computed so far stay contiguous.
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

    /// Covariance from the symmetric functions of two complementary sets of dimensions.
    pub(crate) fn join(&self, y: Symmetric, z: Symmetric) -> f64 {
        let product = self.product * y.product * z.product;
        if self.is_product() {
            return product;
        }
        product + self.additive * (y.first + z.first) + self.pairwise * (y.second + y.first * z.first + z.second)
    }

    /// Prior covariance of two actions, given by their levels.
    pub(crate) fn covariance(&self, a: &[usize], b: &[usize]) -> f64 {
        self.join(self.symmetric(0, a, b), Symmetric { product: 1.0, first: 0.0, second: 0.0 })
    }

    /// Covariance from `(k_d, b_d)` of every dimension.
    fn combine(&self, factors: impl Iterator<Item = (f64, f64)>) -> f64 {
        let mut s = Symmetric { product: 1.0, first: 0.0, second: 0.0 };
        for (product, broad) in factors {
            s.product *= product;
            s.second += s.first * broad;
            s.first += broad;
        }
        self.join(s, Symmetric { product: 1.0, first: 0.0, second: 0.0 })
    }

    /// Prior covariance of an action with the average over all levels of the dimensions that are `None` in `profile`.
    pub(crate) fn average_with(&self, profile: &[Option<usize>], point: &[usize]) -> f64 {
        let mean = |table: &Square, j: usize| table.row(j).iter().sum::<f64>() / table.order() as f64;
        self.combine(profile.iter().zip(point).zip(self.factors.iter().zip(&self.broad)).map(
            |((level, &j), (factor, broad))| match *level {
                Some(i) => (factor.at(i, j), broad.at(i, j)),
                None => (mean(factor, j), mean(broad, j)),
            },
        ))
    }

    /// Prior covariance of two averages, each over all levels of the dimensions that are `None` in its profile. Both
    /// average over the same dimensions.
    pub(crate) fn average_covariance(&self, one: &[Option<usize>], other: &[Option<usize>]) -> f64 {
        let mean = |table: &Square| {
            let n = table.order();
            (0..n).map(|i| table.row(i).iter().sum::<f64>()).sum::<f64>() / (n * n) as f64
        };
        self.combine(one.iter().zip(other).zip(self.factors.iter().zip(&self.broad)).map(
            |(levels, (factor, broad))| match levels {
                (Some(i), Some(j)) => (factor.at(*i, *j), broad.at(*i, *j)),
                _ => (mean(factor), mean(broad)),
            },
        ))
    }

    /// Prior covariances of one action with many, all given by their levels.
    pub(crate) fn column(&self, a: &[usize], points: &[Vec<usize>]) -> Vec<f64> {
        points.iter().map(|b| self.covariance(a, b)).collect()
    }

    /// The terms of [`Self::join`]: `(coupled, separate)` such that
    /// `k = y.coupled . z.coupled + y.separate + z.separate` for a left part `y` and a right part `z`.
    pub(crate) fn split(&self, s: Symmetric, left: bool) -> ([f64; 2], f64) {
        let (p, q) = if left { (self.product, self.pairwise) } else { (1.0, 1.0) };
        ([p * s.product, q * s.first], self.additive * s.first + self.pairwise * s.second)
    }
}
