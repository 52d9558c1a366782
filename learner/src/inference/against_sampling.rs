//! Comparison of both approximations with elliptical slice sampling of the exact posterior (Murray, Adams and MacKay
//! 2010).
//!
//! `cargo test --release -p gait-learner sampling -- --nocapture` prints the table of docs/benchmarks/learner.md.

use super::{Approximate, ExpectationPropagation, Laplace};
use crate::action::ActionIndex;
use crate::fit::{Fit, ProcessModel};
use crate::interval_likelihood::{Interval, Link};
use crate::observations::Observation;
use crate::observations::ObservedPoints;
use crate::random::Random;
use crate::search_space::{Dimension, SearchSpace};
use crate::settings::LearnerSettings;

/// Sampled means and standard deviations of the points under the exact posterior.
fn sampled(observed: &ObservedPoints, draws: usize) -> (Vec<f64>, Vec<f64>) {
    let n = observed.points.len();
    let mut random = Random::new(2024, 0);
    let likelihood = |f: &[f64]| -> f64 {
        observed.sites.iter().map(|s| s.interval.log_likelihood(Link::Probit, s.of(f)).value).sum()
    };
    let mut f = vec![0.0; n];
    let mut current = likelihood(&f);
    let (mut first, mut second) = (vec![0.0; n], vec![0.0; n]);
    let warm_up = draws / 5;
    for step in 0..warm_up + draws {
        let noise: Vec<f64> = (0..n).map(|_| random.normal()).collect();
        let v = observed.prior.multiply(&noise);
        let height = current + crate::special_functions::ln(random.uniform().max(1e-300));
        let mut angle = random.uniform() * std::f64::consts::TAU;
        let (mut low, mut high) = (angle - std::f64::consts::TAU, angle);
        loop {
            let next: Vec<f64> = f.iter().zip(&v).map(|(f, v)| f * angle.cos() + v * angle.sin()).collect();
            let value = likelihood(&next);
            if value > height {
                (f, current) = (next, value);
                break;
            }
            if angle < 0.0 {
                low = angle;
            } else {
                high = angle;
            }
            angle = low + random.uniform() * (high - low);
        }
        if step >= warm_up {
            for i in 0..n {
                first[i] += f[i] / draws as f64;
                second[i] += f[i] * f[i] / draws as f64;
            }
        }
    }
    let sd = first.iter().zip(&second).map(|(m, s)| (s - m * m).max(0.0).sqrt()).collect();
    (first, sd)
}

fn observations(noise: f64, no_difference: bool, seed: u64, space: &SearchSpace) -> Vec<Observation> {
    let mut random = Random::new(seed, 1);
    let mut observations = Vec::new();
    let mut last: Option<ActionIndex> = None;
    let utility = |a: ActionIndex| space.levels(a).iter().map(|&l| -(l as f64 - 1.2).powi(2)).sum::<f64>() + 1.5;
    while observations.len() < 24 {
        let action = ActionIndex(random.below(space.len()));
        let (low, high) = if utility(action) > 0.0 { (0.0, f64::INFINITY) } else { (f64::NEG_INFINITY, 0.0) };
        observations.push(Observation { plus: action, minus: None, interval: Interval { low, high, noise: 0.1 } });
        if let Some(last) = last.filter(|&last| last != action) {
            let (winner, loser) = if utility(action) >= utility(last) { (action, last) } else { (last, action) };
            let high = if no_difference && random.uniform() < 0.3 { 0.1 } else { f64::INFINITY };
            let low = if high.is_finite() { -0.1 } else { 0.0 };
            observations.push(Observation {
                plus: winner,
                minus: Some(loser),
                interval: Interval { low, high, noise },
            });
        }
        last = Some(action);
    }
    observations
}

#[test]
fn approximations_agree_with_long_sampling() {
    let dimensions =
        (0..3).map(|d| Dimension { name: d.to_string(), values: vec![0.0, 1.0, 2.0], lengthscale: 1.0 }).collect();
    let space = SearchSpace::new(dimensions).unwrap();
    let kernel = crate::utility_inference::kernel(&space, &LearnerSettings::default());
    println!("data                        error of mean (EP, Laplace)   sd (sampled, EP, Laplace)");
    // Laplace's approximation gets wider bounds, because its error is larger (docs/benchmarks/learner.md).
    for (name, noise, no_difference, bounds) in [
        ("preferences, noise 0.02", 0.02, false, [0.04, 0.5]),
        ("preferences, noise 0.3", 0.3, false, [0.04, 0.4]),
        ("no difference, noise 0.1", 0.1, true, [0.04, 0.45]),
    ] {
        let observations = observations(noise, no_difference, 5, &space);
        let run = |method: &dyn Approximate| {
            let model = ProcessModel { space: &space, kernel: &kernel, link: Link::Probit, method };
            Fit::of(&model, &observations).unwrap()
        };
        let fits = [run(&ExpectationPropagation::default()), run(&Laplace)];
        let (mean, sd) = sampled(&fits[0].observed, 40_000);
        let n = mean.len() as f64;
        let errors = fits
            .each_ref()
            .map(|fit| fit.approximation.mean.iter().zip(&mean).map(|(a, b)| (a - b).abs()).sum::<f64>() / n);
        let spreads = fits
            .each_ref()
            .map(|fit| (0..mean.len()).map(|i| fit.approximation.covariance.at(i, i).sqrt()).sum::<f64>() / n);
        let exact = sd.iter().sum::<f64>() / n;
        println!(
            "{name:<27} {:.3}, {:.3}                  {exact:.3}, {:.3}, {:.3}",
            errors[0], errors[1], spreads[0], spreads[1]
        );
        assert!(errors[0] < bounds[0] && errors[1] < bounds[1], "{name}: {errors:?}");
        assert!((spreads[0] - exact).abs() < 0.05, "{name}: {spreads:?} {exact}");
        assert!((spreads[1] - exact).abs() < 0.17, "{name}: {spreads:?} {exact}");
        assert!(errors[0] < errors[1], "{name}: {errors:?}");
    }
}
