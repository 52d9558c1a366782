//! Parametric sensitivities against closed forms and against solves of changed problems.

#![allow(clippy::unwrap_used)]

use interior_point::{
    NlpResult, NlpSettings, NlpStatus, NonlinearProgram, ParameterDerivative, SensitivityError, SparsityPattern,
    StartPoint, sensitivities, solve,
};

/// Problem 71 of Hock and Schittkowski with these lower bounds of x and bounds of its two rows.
struct Hs071 {
    lower: [f64; 4],
    least_product: f64,
    squares: f64,
    jacobian: SparsityPattern,
    hessian: SparsityPattern,
}

impl Hs071 {
    fn new(lower: [f64; 4], least_product: f64, squares: f64) -> Self {
        let dense: Vec<_> = (0..4).flat_map(|j| (0..2).map(move |i| (i, j))).collect();
        let lower_triangle: Vec<_> = (0..4).flat_map(|j| (j..4).map(move |i| (i, j))).collect();
        Self {
            lower,
            least_product,
            squares,
            jacobian: SparsityPattern::from_entries(2, 4, &dense).0,
            hessian: SparsityPattern::from_entries(4, 4, &lower_triangle).0,
        }
    }
}

impl NonlinearProgram for Hs071 {
    fn variables(&self) -> usize {
        4
    }
    fn rows(&self) -> usize {
        2
    }
    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&self.lower);
        upper.fill(5.0);
    }
    fn row_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&[self.least_product, self.squares]);
        upper.copy_from_slice(&[f64::INFINITY, self.squares]);
    }
    fn jacobian_pattern(&self) -> &SparsityPattern {
        &self.jacobian
    }
    fn hessian_pattern(&self) -> &SparsityPattern {
        &self.hessian
    }
    fn objective(&self, x: &[f64]) -> f64 {
        x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2]
    }
    fn gradient(&self, x: &[f64], gradient: &mut [f64]) {
        gradient[0] = x[3] * (2.0 * x[0] + x[1] + x[2]);
        gradient[1] = x[0] * x[3];
        gradient[2] = x[0] * x[3] + 1.0;
        gradient[3] = x[0] * (x[0] + x[1] + x[2]);
    }
    fn constraints(&self, x: &[f64], values: &mut [f64]) {
        values[0] = x.iter().product();
        values[1] = x.iter().map(|v| v * v).sum();
    }
    fn jacobian(&self, x: &[f64], values: &mut [f64]) {
        let product: f64 = x.iter().product();
        for (column, v) in values.chunks_exact_mut(2).zip(x) {
            column.copy_from_slice(&[product / v, 2.0 * v]);
        }
    }
    fn hessian(&self, x: &[f64], sigma: f64, y: &[f64], values: &mut [f64]) {
        let product: f64 = x.iter().product();
        let of_f = [2.0 * x[3], x[3], x[3], 2.0 * x[0] + x[1] + x[2], 0.0, 0.0, x[0], 0.0, x[0], 0.0];
        let mut k = 0;
        for j in 0..4 {
            for i in j..4 {
                let of_rows = if i == j { 2.0 * y[1] } else { y[0] * product / (x[i] * x[j]) };
                values[k] = sigma * of_f[k] + of_rows;
                k += 1;
            }
        }
    }
}

fn tight() -> NlpSettings {
    NlpSettings { tolerance: 1e-11, bound_relaxation: 0.0, ..NlpSettings::default() }
}

fn solution(problem: &dyn NonlinearProgram, start: &[f64], settings: &NlpSettings) -> NlpResult {
    let result = solve(problem, &StartPoint::Cold(start.to_vec()), settings, &mut |_| {}, &|| false).unwrap();
    assert_eq!(result.status, NlpStatus::Converged);
    result
}

/// Lower bounds of x, and bounds of the two rows.
type Parameters = ([f64; 4], f64, f64);
type Change = fn(Parameters, f64) -> Parameters;

#[test]
fn sensitivities_agree_with_central_differences_of_solves() {
    let start = [1.0, 5.0, 5.0, 1.0];
    let base = ([1.0; 4], 25.0, 40.0);
    let parameters: [(Change, ParameterDerivative); 3] = [
        (|(l, p, s), by| (l, p + by, s), ParameterDerivative { row_lower: vec![1.0, 0.0], ..zeros() }),
        (
            |(l, p, s), by| (l, p, s + by),
            ParameterDerivative { row_lower: vec![0.0, 1.0], row_upper: vec![0.0, 1.0], ..zeros() },
        ),
        (
            |(mut l, p, s), by| {
                l[0] += by;
                (l, p, s)
            },
            ParameterDerivative { lower: vec![1.0, 0.0, 0.0, 0.0], ..zeros() },
        ),
    ];
    for scaling in [None, Some(1.0)] {
        let settings = NlpSettings { gradient_scaling: scaling, ..tight() };
        let at = |(lower, product, squares)| solution(&Hs071::new(lower, product, squares), &start, &settings);
        let middle = at(base);
        let problem = Hs071::new(base.0, base.1, base.2);
        let derivatives: Vec<_> = parameters.iter().map(|(_, derivative)| derivative.clone()).collect();
        let found = sensitivities(&problem, &middle.warm_point(), &settings, &derivatives).unwrap();
        for ((change, _), found) in parameters.iter().zip(&found) {
            let step = 1e-4;
            let (more, less) = (at(change(base, step)), at(change(base, -step)));
            let difference = |more: f64, less: f64| (more - less) / (2.0 * step);
            let close = |found: f64, expected: f64| (found - expected).abs() < 1e-5 * (1.0 + expected.abs());
            let expected = difference(more.objective, less.objective);
            assert!(close(found.objective, expected), "{} {expected}", found.objective);
            let (more, less) = (more.warm_point(), less.warm_point());
            let pairs = [
                (&found.point.x, &more.x, &less.x),
                (&found.point.row_multipliers, &more.row_multipliers, &less.row_multipliers),
                (&found.point.lower_multipliers, &more.lower_multipliers, &less.lower_multipliers),
                (&found.point.slacks, &more.slacks, &less.slacks),
            ];
            for (part, (found, more, less)) in pairs.into_iter().enumerate().take(3) {
                for i in 0..found.len() {
                    let expected = difference(more[i], less[i]);
                    assert!(close(found[i], expected), "part {part}, {i}: {} {expected}", found[i]);
                }
            }
            assert!(close(pairs[3].0[0], difference(pairs[3].1[0], pairs[3].2[0])));
        }
    }
}

fn zeros() -> ParameterDerivative {
    ParameterDerivative::zeros(4, 2)
}

/// Minimises (x1 - 2)^2 + (x2 - target)^2 subject to x1 + x2 <= 1, with x2 >= 0.
struct Projection {
    target: f64,
    jacobian: SparsityPattern,
    hessian: SparsityPattern,
}

impl Projection {
    fn new(target: f64) -> Self {
        Self {
            target,
            jacobian: SparsityPattern::from_entries(1, 2, &[(0, 0), (0, 1)]).0,
            hessian: SparsityPattern::from_entries(2, 2, &[(0, 0), (1, 1)]).0,
        }
    }
}

impl NonlinearProgram for Projection {
    fn variables(&self) -> usize {
        2
    }
    fn rows(&self) -> usize {
        1
    }
    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&[f64::NEG_INFINITY, 0.0]);
        upper.fill(f64::INFINITY);
    }
    fn row_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        (lower[0], upper[0]) = (f64::NEG_INFINITY, 1.0);
    }
    fn jacobian_pattern(&self) -> &SparsityPattern {
        &self.jacobian
    }
    fn hessian_pattern(&self) -> &SparsityPattern {
        &self.hessian
    }
    fn objective(&self, x: &[f64]) -> f64 {
        (x[0] - 2.0).powi(2) + (x[1] - self.target).powi(2)
    }
    fn gradient(&self, x: &[f64], gradient: &mut [f64]) {
        gradient.copy_from_slice(&[2.0 * (x[0] - 2.0), 2.0 * (x[1] - self.target)]);
    }
    fn constraints(&self, x: &[f64], values: &mut [f64]) {
        values[0] = x[0] + x[1];
    }
    fn jacobian(&self, _: &[f64], values: &mut [f64]) {
        values.fill(1.0);
    }
    fn hessian(&self, _: &[f64], sigma: f64, _: &[f64], values: &mut [f64]) {
        values.fill(2.0 * sigma);
    }
}

#[test]
fn parameter_of_the_objective_moves_the_projection_as_its_closed_form_does() {
    // With the row active and the bound inactive, x1 = (1 + 2 - t) / 2, x2 = (1 - 2 + t) / 2, y = 1 + t.
    let (settings, target) = (tight(), 1.5);
    let solved = solution(&Projection::new(target), &[0.0, 0.5], &settings);
    let parameter = ParameterDerivative {
        objective: -2.0 * (solved.x[1] - target),
        lagrangian_gradient: vec![0.0, -2.0],
        ..ParameterDerivative::zeros(2, 1)
    };
    let found = &sensitivities(&Projection::new(target), &solved.warm_point(), &settings, &[parameter]).unwrap()[0];
    for (found, expected) in [
        (found.point.x[0], -0.5),
        (found.point.x[1], 0.5),
        (found.point.row_multipliers[0], 1.0),
        (found.objective, 1.0 + target),
    ] {
        assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    }
}

#[test]
fn invalid_parameters_are_refused() {
    let settings = tight();
    let solved = solution(&Hs071::new([1.0; 4], 25.0, 40.0), &[1.0, 5.0, 5.0, 1.0], &settings).warm_point();
    let short = ParameterDerivative { rows: vec![0.0], ..zeros() };
    let problem = Hs071::new([1.0; 4], 25.0, 40.0);
    let refused = sensitivities(&problem, &solved, &settings, &[short]).unwrap_err();
    assert_eq!(refused, SensitivityError::Length { what: "the rows", found: 1, expected: 2 });
    let fixed = Hs071::new([1.0, 5.0, 1.0, 1.0], 25.0, 40.0);
    let moved = ParameterDerivative { lower: vec![0.0, 1.0, 0.0, 0.0], ..zeros() };
    assert_eq!(sensitivities(&fixed, &solved, &settings, &[moved]).unwrap_err(), SensitivityError::FixedVariable(1));
}
