//! An exact joint draw of the utility of every action of the grid.
//!
//! The prior is drawn through its structure: the product part by applying the triangular factor of each dimension's
//! table to an array of normals, the additive and pairwise parts as sums of draws over one and two dimensions. The
//! draw is then conditioned pathwise (Matheron's rule): `f + k(x, V) K_VV^-1 (f_V - f(V) - e)`, `f_V` a draw of the
//! posterior at the points `V` and `e` a draw of their nugget.

use crate::belief::Belief;
use crate::error::Result;
use crate::grid::Grid;
use crate::linalg::Cholesky;
use crate::random::Random;
use crate::space::SearchSpace;

/// Applies the factor of a dimension to an array, along that dimension.
fn along(array: &mut [f64], count: usize, stride: usize, factor: &Cholesky) {
    let mut line = vec![0.0; count];
    for block in array.chunks_exact_mut(count * stride) {
        for offset in 0..stride {
            for (i, value) in line.iter_mut().enumerate() {
                *value = block[offset + i * stride];
            }
            for i in (0..count).rev() {
                let row = factor.row(i);
                block[offset + i * stride] = row.iter().zip(&line).map(|(l, z)| l * z).sum();
            }
        }
    }
}

fn normals(count: usize, scale: f64, random: &mut Random) -> Vec<f64> {
    (0..count).map(|_| scale * random.normal()).collect()
}

/// One draw of the prior over the whole grid.
fn prior(space: &SearchSpace, belief: &Belief, random: &mut Random) -> Result<Vec<f64>> {
    let shape = space.shape();
    let size: usize = shape.iter().product();
    let kernel = &belief.kernel;
    let [product, additive, pairwise] = kernel.weights();
    let strides: Vec<usize> = (0..shape.len()).map(|d| shape[d + 1..].iter().product()).collect();
    let mut draw = vec![0.0; size];
    if product > 0.0 {
        draw = normals(size, product.sqrt(), random);
        for (d, &count) in shape.iter().enumerate() {
            along(&mut draw, count, strides[d], &Cholesky::new(&kernel.factor(d).ridged(1e-10))?);
        }
    }
    if additive > 0.0 || pairwise > 0.0 {
        let broad: Vec<Cholesky> =
            (0..shape.len()).map(|d| Cholesky::new(&kernel.broad(d).ridged(1e-10))).collect::<Result<_>>()?;
        for (d, &count) in shape.iter().enumerate() {
            let main = broad[d].multiply(&normals(count, additive.sqrt(), random));
            for (x, value) in draw.iter_mut().enumerate() {
                *value += main[x / strides[d] % count];
            }
            for (e, &other) in shape.iter().enumerate().skip(d + 1) {
                let mut pair = normals(count * other, pairwise.sqrt(), random);
                along(&mut pair, count, other, &broad[d]);
                along(&mut pair, other, 1, &broad[e]);
                for (x, value) in draw.iter_mut().enumerate() {
                    *value += pair[x / strides[d] % count * other + x / strides[e] % other];
                }
            }
        }
    }
    Ok(draw)
}

/// One draw of the posterior over the whole grid.
pub(crate) fn draw(space: &SearchSpace, belief: &Belief, grid: &Grid<'_>, random: &mut Random) -> Result<Vec<f64>> {
    let mut sample = prior(space, belief, random)?;
    let model = belief.model();
    if model.points.is_empty() {
        return Ok(sample);
    }
    let at = |x: u64| usize::try_from(x).unwrap_or(usize::MAX);
    let (targets, _) = belief.draw(&[], random)?;
    let nugget = belief.kernel.nugget.sqrt();
    let mut residual: Vec<f64> = model
        .points
        .iter()
        .zip(&targets)
        .map(|(action, target)| target - sample[at(action.0)] - nugget * random.normal())
        .collect();
    model.prior.solve(&mut residual);
    for (value, change) in sample.iter_mut().zip(grid.form(&residual)) {
        *value += change;
    }
    for (action, target) in model.points.iter().zip(targets) {
        sample[at(action.0)] = target;
    }
    Ok(sample)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::feedback::{Feedback, FeedbackLog};
    use crate::posterior::posterior;
    use crate::settings::{LearnerSettings, Method};
    use crate::space::{ActionIndex, Dimension};

    #[test]
    fn draws_have_the_posterior_moments() {
        let dimensions = [2, 3, 4]
            .iter()
            .enumerate()
            .map(|(d, &n)| Dimension { name: d.to_string(), values: (0..n).map(f64::from).collect(), lengthscale: 1.5 })
            .collect();
        let space = SearchSpace::new(dimensions).unwrap();
        for (additive_share, pairwise_share) in [(0.0, 0.0), (0.3, 0.3)] {
            for method in [Method::LineCoSpar, Method::Eubo] {
                let settings = LearnerSettings {
                    additive_share,
                    pairwise_share,
                    preference_noise: 0.3,
                    ..LearnerSettings::of(method)
                };
                let [a, b, c] = [0, 7, 20].map(ActionIndex);
                let log = FeedbackLog {
                    visited: vec![a, b, c],
                    feedback: vec![
                        Feedback::Preference { winner: a, loser: b },
                        Feedback::Preference { winner: a, loser: c },
                        Feedback::Label { action: b, category: 1 },
                    ],
                };
                let belief = posterior(&space, &log, &settings).unwrap();
                let grid = Grid::new(&space, &belief.utility);
                let mut random = Random::new(11, 0);
                let count = 3_000;
                let (mut first, mut second) = (vec![0.0; 24], vec![0.0; 24]);
                for _ in 0..count {
                    let draw = draw(&space, &belief.utility, &grid, &mut random).unwrap();
                    for (x, value) in draw.into_iter().enumerate() {
                        first[x] += value / f64::from(count);
                        second[x] += value * value / f64::from(count);
                    }
                }
                for x in 0..24 {
                    let expected = belief.predict(ActionIndex(x as u64)).unwrap();
                    let sd = (second[x] - first[x] * first[x]).sqrt();
                    assert!((first[x] - expected.mean).abs() < 0.07, "{x}: {} {expected:?}", first[x]);
                    assert!((sd - expected.standard_deviation).abs() < 0.07, "{x}: {sd} {expected:?}");
                }
            }
        }
    }
}
