//! Exact joint samples of the utility of all actions.
//!
//! A sample of the prior is an array of normals times the Cholesky factor of each dimension's table (a Kronecker
//! product), or of the descriptors' table. Matheron's rule then conditions the sample pathwise (Wilson et al. 2020): `f + k(x, V) K_VV^-1 (f_V -
//! f(V) - e)`, with `f_V` a posterior sample at the points `V` and `e` a sample of the nugget.

use crate::error::Result;
use crate::gaussian_process::GaussianProcess;
use crate::kernel::Correlations;
use crate::linalg::Cholesky;
use crate::random::Random;
use crate::search_space::SearchSpace;
use crate::whole_grid::WholeGrid;

/// Multiplies an array by a Cholesky factor along one dimension of `count` levels.
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

/// A sample of the prior: one utility for each action.
fn prior_sample(space: &SearchSpace, process: &GaussianProcess, random: &mut Random) -> Result<Vec<f64>> {
    let shape = space.shape();
    let kernel = &process.kernel;
    let scale = kernel.variance.sqrt();
    let tables = match kernel.correlations() {
        Correlations::Levels(tables) => tables,
        Correlations::Descriptors(described) => {
            return Ok(described.sample(random)?.into_iter().map(|value| scale * value).collect());
        }
    };
    let mut sample: Vec<f64> = (0..shape.iter().product()).map(|_| scale * random.normal()).collect();
    for (d, (&count, table)) in shape.iter().zip(tables).enumerate() {
        let stride = shape[d + 1..].iter().product();
        along(&mut sample, count, stride, &Cholesky::new(&table.ridged(1e-10))?);
    }
    Ok(sample)
}

/// A sample of the posterior: one utility for each action.
pub(crate) fn posterior_sample(
    space: &SearchSpace,
    process: &GaussianProcess,
    grid: &WholeGrid<'_>,
    random: &mut Random,
) -> Result<Vec<f64>> {
    let mut sample = prior_sample(space, process, random)?;
    let observed = process.observed();
    if observed.points.is_empty() {
        return Ok(sample);
    }
    let at = |x: u64| usize::try_from(x).unwrap_or(usize::MAX);
    let (targets, _) = process.sample(&[], random)?;
    let nugget = process.kernel.nugget.sqrt();
    let mut residual: Vec<f64> = observed
        .points
        .iter()
        .zip(&targets)
        .map(|(action, target)| target - sample[at(action.0)] - nugget * random.normal())
        .collect();
    observed.prior.solve(&mut residual);
    for (value, change) in sample.iter_mut().zip(grid.form(&residual)) {
        *value += change;
    }
    for (action, target) in observed.points.iter().zip(targets) {
        sample[at(action.0)] = target;
    }
    Ok(sample)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::action::ActionIndex;
    use crate::feedback::{Feedback, FeedbackLog};
    use crate::search_space::Dimension;
    use crate::settings::{LearnerSettings, Method};
    use crate::utility_inference::posterior;

    #[test]
    fn samples_have_the_posterior_moments() {
        let dimensions = [2, 3, 4]
            .iter()
            .enumerate()
            .map(|(d, &n)| Dimension { name: d.to_string(), values: (0..n).map(f64::from).collect(), lengthscale: 1.5 })
            .collect();
        let space = SearchSpace::new(dimensions).unwrap();
        for method in [Method::LineCoSpar, Method::Eubo] {
            let settings = LearnerSettings { preference_noise: 0.3, ..LearnerSettings::of(method) };
            let [a, b, c] = [0, 7, 20].map(ActionIndex);
            let log = FeedbackLog {
                visited: vec![a, b, c],
                feedback: vec![
                    Feedback::Preference { winner: a, loser: b },
                    Feedback::Preference { winner: a, loser: c },
                    Feedback::Label { action: b, category: 1 },
                ],
            };
            let posterior = posterior(&space, &log, &settings).unwrap();
            let grid = WholeGrid::new(&space, &posterior.utility);
            let mut random = Random::new(11, 0);
            let count = 3_000;
            let (mut first, mut second) = (vec![0.0; 24], vec![0.0; 24]);
            for _ in 0..count {
                let sample = posterior_sample(&space, &posterior.utility, &grid, &mut random).unwrap();
                for (x, value) in sample.into_iter().enumerate() {
                    first[x] += value / f64::from(count);
                    second[x] += value * value / f64::from(count);
                }
            }
            for x in 0..24 {
                let expected = posterior.predict(ActionIndex(x as u64)).unwrap();
                let sd = (second[x] - first[x] * first[x]).sqrt();
                assert!((first[x] - expected.mean).abs() < 0.07, "{x}: {} {expected:?}", first[x]);
                assert!((sd - expected.standard_deviation).abs() < 0.07, "{x}: {sd} {expected:?}");
            }
        }
    }
}
