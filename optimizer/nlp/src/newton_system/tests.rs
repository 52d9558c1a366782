//! Tests of the Newton system with a faulty factorisation.

use super::*;
use crate::factorisation;
use crate::nonlinear_program::{NonlinearProgram, SparsityPattern};
use crate::settings::NlpSettings;

/// min x_1 + 2 x_2, x_1 + x_2 = 1.
struct Line {
    jacobian: SparsityPattern,
    hessian: SparsityPattern,
}

impl NonlinearProgram for Line {
    fn variables(&self) -> usize {
        2
    }
    fn rows(&self) -> usize {
        1
    }
    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.fill(f64::NEG_INFINITY);
        upper.fill(f64::INFINITY);
    }
    fn row_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.fill(1.0);
        upper.fill(1.0);
    }
    fn jacobian_pattern(&self) -> &SparsityPattern {
        &self.jacobian
    }
    fn hessian_pattern(&self) -> &SparsityPattern {
        &self.hessian
    }
    fn objective(&self, x: &[f64]) -> f64 {
        x[0] + 2.0 * x[1]
    }
    fn gradient(&self, _x: &[f64], gradient: &mut [f64]) {
        gradient.copy_from_slice(&[1.0, 2.0]);
    }
    fn constraints(&self, x: &[f64], values: &mut [f64]) {
        values[0] = x[0] + x[1];
    }
    fn jacobian(&self, _x: &[f64], values: &mut [f64]) {
        values.fill(1.0);
    }
    fn hessian(&self, _x: &[f64], _sigma: f64, _multipliers: &[f64], _values: &mut [f64]) {}
}

/// A factorisation that is wrong until it is distrusted.
struct Faulty {
    exact: Box<dyn KktSolver>,
    /// Factor on its solutions.
    factor: f64,
    /// Negative eigenvalues that it counts too many.
    miscounted: usize,
    has_another_method: bool,
}

impl KktSolver for Faulty {
    fn factor(&mut self, values: &[f64], change: MatrixChange) -> Option<Inertia> {
        let inertia = self.exact.factor(values, change)?;
        Some(Inertia { negative: inertia.negative + self.miscounted, ..inertia })
    }
    fn solve(&mut self, rhs: &mut [f64]) {
        self.exact.solve(rhs);
        for x in rhs {
            *x *= self.factor;
        }
    }
    fn factor_entries(&self) -> usize {
        self.exact.factor_entries()
    }
    fn reject_factorisation(&mut self) -> bool {
        (self.factor, self.miscounted) = (1.0, 0);
        std::mem::take(&mut self.has_another_method)
    }
}

/// Multipliers by a faulty factorisation, and the number of factorisations.
fn multipliers(factor: f64, miscounted: usize, has_another_method: bool) -> (Option<Vec<f64>>, usize) {
    let pattern = |rows, column_starts: &[usize], row_indices: &[usize]| SparsityPattern {
        rows,
        columns: 2,
        column_starts: column_starts.to_vec(),
        row_indices: row_indices.to_vec(),
    };
    let line = Line { jacobian: pattern(1, &[0, 1, 2], &[0, 0]), hessian: pattern(2, &[0, 0, 0], &[]) };
    let settings = NlpSettings::default();
    let form = Formulation::new(&line, &settings).unwrap();
    let matrix = KktMatrix::new(&form);
    let exact = factorisation::choose(&form, &matrix, &settings).unwrap();
    let faulty = Faulty { exact, factor, miscounted, has_another_method };
    let mut newton = NewtonSystem::new(matrix, Box::new(faulty));
    newton.fit(&form);
    let y = newton.least_squares_multipliers(&form, &settings, &[1.0, 2.0], &PrimalDual::zeros(&form), &[1.0, 1.0]);
    (y, newton.tally.factorisations)
}

#[test]
fn least_squares_multipliers_come_from_a_factorisation_with_the_right_inertia() {
    for (factor, miscounted, factorisations) in [(1.0, 0, 1), (1.001, 0, 2), (f64::NAN, 0, 2), (1.0, 1, 2)] {
        let (y, times) = multipliers(factor, miscounted, true);
        assert!((y.unwrap()[0] + 1.5).abs() < 1e-7, "{factor} {miscounted}");
        assert_eq!(times, factorisations, "{factor} {miscounted}");
    }
}

#[test]
fn no_least_squares_multipliers_if_every_factorisation_has_the_wrong_inertia() {
    for (factor, miscounted) in [(1.001, 0), (f64::NAN, 0), (1.0, 1)] {
        assert_eq!(multipliers(factor, miscounted, false), (None, 1), "{factor} {miscounted}");
    }
}
