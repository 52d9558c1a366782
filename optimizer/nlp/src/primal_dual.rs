//! Primal-dual points and directions, and the derivatives and slacks at a point.

use crate::factorisation::{all_finite, largest_magnitude};
use crate::formulation::Formulation;

/// A primal-dual point or direction: w, row multipliers y, bound multipliers z_L and z_U.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct PrimalDual {
    pub w: Vec<f64>,
    pub y: Vec<f64>,
    pub zl: Vec<f64>,
    pub zu: Vec<f64>,
}

impl PrimalDual {
    pub(crate) fn zeros(form: &Formulation) -> Self {
        let length = form.length();
        Self { w: vec![0.0; length], y: vec![0.0; form.m], zl: vec![0.0; length], zu: vec![0.0; length] }
    }

    /// Copies the values of another one of the same size.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        for (a, b) in self.parts_mut().into_iter().zip(other.parts()) {
            a.copy_from_slice(b);
        }
    }

    pub(crate) fn add(&mut self, other: &Self) {
        for (a, b) in self.parts_mut().into_iter().zip(other.parts()) {
            for (x, y) in a.iter_mut().zip(b) {
                *x += y;
            }
        }
    }

    pub(crate) fn parts(&self) -> [&[f64]; 4] {
        [&self.w, &self.y, &self.zl, &self.zu]
    }

    pub(crate) fn parts_mut(&mut self) -> [&mut [f64]; 4] {
        [&mut self.w, &mut self.y, &mut self.zl, &mut self.zu]
    }

    /// Largest absolute entry; NaN counts as infinite.
    pub(crate) fn largest(&self) -> f64 {
        self.parts().iter().map(|p| largest(p)).fold(0.0, f64::max)
    }
}

/// Largest absolute entry; NaN counts as infinite.
pub(crate) fn largest(values: &[f64]) -> f64 {
    if all_finite(values) { largest_magnitude(values) } else { f64::INFINITY }
}

/// Derivatives and slacks at the current point.
#[derive(Debug, Clone, Default)]
pub(crate) struct Linearisation {
    pub jacobian: Vec<f64>,
    pub hessian: Vec<f64>,
    /// w - l and u - w; infinite without a bound.
    pub slack_lower: Vec<f64>,
    pub slack_upper: Vec<f64>,
}
