//! Problems with known optima; derivatives by hyper-dual numbers.
#![allow(dead_code, clippy::pedantic, clippy::unwrap_used, clippy::type_complexity, missing_docs, unreachable_pub)]

pub mod hock_schittkowski;
pub mod hyper_dual;
pub mod optimal_control;
pub mod sets;
pub mod sparse;
pub mod swing_up;

pub use hyper_dual::Dual;
use interior_point::{NonlinearProgram, SparsityPattern};

/// Objective and rows.
pub type Functions = fn(&[Dual]) -> (Dual, Vec<Dual>);

/// A dense problem.
pub struct Small {
    pub name: &'static str,
    pub start: Vec<f64>,
    pub lower: Vec<f64>,
    pub upper: Vec<f64>,
    pub row_lower: Vec<f64>,
    pub row_upper: Vec<f64>,
    pub functions: Functions,
    /// Known local optima, the best first.
    pub optima: Vec<f64>,
    jacobian: SparsityPattern,
    hessian: SparsityPattern,
}

pub const INF: f64 = f64::INFINITY;

impl Small {
    /// A problem without variable bounds, with the given row bounds.
    pub fn new(name: &'static str, start: &[f64], rows: &[(f64, f64)], optima: &[f64], functions: Functions) -> Self {
        let (n, m) = (start.len(), rows.len());
        let dense: Vec<_> = (0..n).flat_map(|j| (0..m).map(move |i| (i, j))).collect();
        let lower_triangle: Vec<_> = (0..n).flat_map(|j| (j..n).map(move |i| (i, j))).collect();
        Self {
            name,
            start: start.to_vec(),
            lower: vec![-INF; n],
            upper: vec![INF; n],
            row_lower: rows.iter().map(|r| r.0).collect(),
            row_upper: rows.iter().map(|r| r.1).collect(),
            functions,
            optima: optima.to_vec(),
            jacobian: SparsityPattern::from_entries(m, n, &dense).0,
            hessian: SparsityPattern::from_entries(n, n, &lower_triangle).0,
        }
    }

    pub fn bounds(mut self, bounds: &[(f64, f64)]) -> Self {
        self.lower = bounds.iter().map(|b| b.0).collect();
        self.upper = bounds.iter().map(|b| b.1).collect();
        self
    }

    pub fn all_bounds(self, lower: f64, upper: f64) -> Self {
        let n = self.start.len();
        self.bounds(&vec![(lower, upper); n])
    }

    /// Whether `objective` is one of the known optima.
    pub fn is_optimum(&self, objective: f64) -> bool {
        self.optima.iter().any(|f| (objective - f).abs() <= 2e-6 * f.abs().max(1.0))
    }

    fn evaluate(&self, x: &[f64], i: usize, j: usize) -> (Dual, Vec<Dual>) {
        let mut point: Vec<Dual> = x.iter().map(|v| Dual::constant(*v)).collect();
        if let Some(p) = point.get_mut(i) {
            p.a = 1.0;
        }
        if let Some(p) = point.get_mut(j) {
            p.b = 1.0;
        }
        (self.functions)(&point)
    }
}

impl NonlinearProgram for Small {
    fn variables(&self) -> usize {
        self.start.len()
    }
    fn rows(&self) -> usize {
        self.row_lower.len()
    }
    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&self.lower);
        upper.copy_from_slice(&self.upper);
    }
    fn row_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&self.row_lower);
        upper.copy_from_slice(&self.row_upper);
    }
    fn jacobian_pattern(&self) -> &SparsityPattern {
        &self.jacobian
    }
    fn hessian_pattern(&self) -> &SparsityPattern {
        &self.hessian
    }
    fn objective(&self, x: &[f64]) -> f64 {
        self.evaluate(x, usize::MAX, usize::MAX).0.v
    }
    fn gradient(&self, x: &[f64], gradient: &mut [f64]) {
        for j in 0..x.len() {
            gradient[j] = self.evaluate(x, j, usize::MAX).0.a;
        }
    }
    fn constraints(&self, x: &[f64], values: &mut [f64]) {
        for (v, g) in values.iter_mut().zip(self.evaluate(x, usize::MAX, usize::MAX).1) {
            *v = g.v;
        }
    }
    fn jacobian(&self, x: &[f64], values: &mut [f64]) {
        let mut q = 0;
        for j in 0..x.len() {
            for g in self.evaluate(x, j, usize::MAX).1 {
                values[q] = g.a;
                q += 1;
            }
        }
    }
    fn hessian(&self, x: &[f64], sigma: f64, multipliers: &[f64], values: &mut [f64]) {
        let mut q = 0;
        for j in 0..x.len() {
            for i in j..x.len() {
                let (f, g) = self.evaluate(x, i, j);
                values[q] = sigma * f.ab + g.iter().zip(multipliers).map(|(g, y)| g.ab * y).sum::<f64>();
                q += 1;
            }
        }
    }
}
