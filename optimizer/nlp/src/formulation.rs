//! The standard form that the interior point solves.
//!
//! minimise F(w) subject to c(w) = 0 and l <= w <= u, with w = (x, t). Each *row variable* t_k, a slack or an elastic
//! variable, occurs in exactly one row, with coefficient a_k = +1 or -1, and has no curvature, so it can be
//! eliminated into the diagonal of its row:
//!
//! * an inequality row g_L <= g(x) <= g_U becomes g(x) - s = 0 with g_L <= s <= g_U;
//! * in the restoration phase every row has elastic variables, g(x) - ... - p + n = 0 with p, n >= 0, and
//!   F(w) = rho sum(p + n) + zeta/2 |D (x - x_R)|^2 (WB06 section 3.3).
//!
//! In both cases the KKT matrix has order n + m and the same pattern. Fixed variables (x_L = x_U) keep their index,
//! with zero derivatives and a unit pivot, and so do rows without bounds.

use std::time::Instant;

use crate::method_constants::MethodConstants;
use crate::nonlinear_program::{NonlinearProgram, SparsityPattern};
use crate::program_checks::{check_bounds, check_pattern};
use crate::settings::NlpSettings;
use crate::status::NlpError;

/// The form of a row of g.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum RowForm {
    /// g_i(x) = target.
    Equality(f64),
    /// g_i(x) = s with s the row variable of this index.
    Inequality(usize),
    /// No bounds.
    Free,
}

/// A variable that occurs in one row only: a slack or an elastic variable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RowVariable {
    pub row: usize,
    /// Its coefficient in that row, +1 or -1.
    pub sign: f64,
}

/// The objective F.
#[derive(Debug, Clone)]
pub(crate) enum Objective {
    /// f(x), scaled.
    Program,
    /// The objective of the restoration phase; the elastic variables are the row variables from `first` on.
    Restoration { first: usize, rho: f64, zeta: f64, reference: Vec<f64>, weight: Vec<f64> },
}

/// Time and number of evaluations.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct EvaluationTally {
    pub seconds: f64,
    pub constraints: usize,
}

#[derive(Clone)]
pub(crate) struct Formulation<'p> {
    pub program: &'p dyn NonlinearProgram,
    /// Number of x.
    pub n: usize,
    /// Number of rows.
    pub m: usize,
    pub fixed: Vec<Option<f64>>,
    pub rows: Vec<RowForm>,
    pub row_variables: Vec<RowVariable>,
    /// Relaxed bounds of w, infinite where there are none.
    pub lower: Vec<f64>,
    pub upper: Vec<f64>,
    pub objective_scale: f64,
    pub row_scale: Vec<f64>,
    pub objective: Objective,
    pub tally: EvaluationTally,
    pub constants: MethodConstants,
    jacobian_zeros: Vec<usize>,
    hessian_zeros: Vec<usize>,
    scaled_multipliers: Vec<f64>,
}

impl<'p> Formulation<'p> {
    /// Checks the problem and gives every row its form.
    pub(crate) fn new(program: &'p dyn NonlinearProgram, settings: &NlpSettings) -> Result<Self, NlpError> {
        let (n, m) = (program.variables(), program.rows());
        check_pattern("Jacobian", program.jacobian_pattern(), m, n, false)?;
        check_pattern("Hessian", program.hessian_pattern(), n, n, true)?;
        let (mut lower, mut upper) = (vec![f64::NEG_INFINITY; n], vec![f64::INFINITY; n]);
        program.variable_bounds(&mut lower, &mut upper);
        let (mut row_lower, mut row_upper) = (vec![0.0; m], vec![0.0; m]);
        program.row_bounds(&mut row_lower, &mut row_upper);
        check_bounds("variable", &lower, &upper)?;
        check_bounds("row", &row_lower, &row_upper)?;

        let mut fixed = vec![None; n];
        for j in 0..n {
            if lower[j] == upper[j] {
                fixed[j] = Some(lower[j]);
                lower[j] = f64::NEG_INFINITY;
                upper[j] = f64::INFINITY;
            }
        }
        let mut row_variables = Vec::new();
        let mut rows = Vec::with_capacity(m);
        for i in 0..m {
            rows.push(if row_lower[i] == row_upper[i] {
                RowForm::Equality(row_lower[i])
            } else if row_lower[i].is_infinite() && row_upper[i].is_infinite() {
                RowForm::Free
            } else {
                row_variables.push(RowVariable { row: i, sign: -1.0 });
                lower.push(row_lower[i]);
                upper.push(row_upper[i]);
                RowForm::Inequality(row_variables.len() - 1)
            });
        }
        let jacobian = program.jacobian_pattern();
        let hessian = program.hessian_pattern();
        let jacobian_zeros = entries(jacobian)
            .filter(|&(_, i, j)| fixed[j].is_some() || rows[i] == RowForm::Free)
            .map(|e| e.0)
            .collect();
        let hessian_zeros =
            entries(hessian).filter(|&(_, i, j)| fixed[i].is_some() || fixed[j].is_some()).map(|e| e.0).collect();
        let mut formulation = Self {
            program,
            n,
            m,
            fixed,
            rows,
            row_variables,
            lower,
            upper,
            objective_scale: 1.0,
            row_scale: vec![1.0; m],
            objective: Objective::Program,
            tally: EvaluationTally::default(),
            constants: settings.constants,
            jacobian_zeros,
            hessian_zeros,
            scaled_multipliers: vec![0.0; m],
        };
        formulation.relax_bounds(settings);
        Ok(formulation)
    }

    fn relax_bounds(&mut self, settings: &NlpSettings) {
        let widen = |b: f64| (settings.bound_relaxation * b.abs().max(1.0)).min(settings.violation_tolerance);
        for l in &mut self.lower {
            *l -= if l.is_finite() { widen(*l) } else { 0.0 };
        }
        for u in &mut self.upper {
            *u += if u.is_finite() { widen(*u) } else { 0.0 };
        }
    }

    /// Gradient-based scaling: scales objective and rows down until no derivative at `x` exceeds `limit` (WB06
    /// section 3.8).
    pub(crate) fn scale_by_gradients(&mut self, x: &[f64], limit: f64) {
        const MIN_SCALE: f64 = 1e-8;
        let mut gradient = vec![0.0; self.length()];
        self.gradient(x, &mut gradient);
        let largest = gradient[..self.n].iter().fold(0.0f64, |a, v| a.max(v.abs()));
        if largest.is_finite() && largest > limit {
            self.objective_scale = (limit / largest).max(MIN_SCALE);
        }
        let mut values = vec![0.0; self.program.jacobian_pattern().row_indices.len()];
        self.jacobian(x, &mut values);
        let mut largest = vec![0.0f64; self.m];
        for (q, i, _) in entries(self.program.jacobian_pattern()) {
            largest[i] = largest[i].max(values[q].abs());
        }
        for i in 0..self.m {
            if largest[i].is_finite() && largest[i] > limit {
                let scale = (limit / largest[i]).max(MIN_SCALE);
                self.row_scale[i] = scale;
                match &mut self.rows[i] {
                    RowForm::Equality(target) => *target *= scale,
                    RowForm::Inequality(k) => {
                        self.lower[self.n + *k] *= scale;
                        self.upper[self.n + *k] *= scale;
                    }
                    RowForm::Free => {}
                }
            }
        }
    }

    /// Length of w.
    pub(crate) fn length(&self) -> usize {
        self.n + self.row_variables.len()
    }

    /// F(w); not finite where it cannot be evaluated.
    pub(crate) fn objective(&mut self, w: &[f64]) -> f64 {
        match &self.objective {
            Objective::Program => {
                let clock = Instant::now();
                let value = self.objective_scale * self.program.objective(&w[..self.n]);
                self.tally.seconds += clock.elapsed().as_secs_f64();
                value
            }
            Objective::Restoration { first, rho, zeta, reference, weight } => {
                let elastic: f64 = w[self.n + first..].iter().sum();
                let drift: f64 = (0..self.n).map(|j| (weight[j] * (w[j] - reference[j])).powi(2)).sum();
                rho * elastic + 0.5 * zeta * drift
            }
        }
    }

    /// dF/dw (length of w).
    pub(crate) fn gradient(&mut self, w: &[f64], gradient: &mut [f64]) {
        let n = self.n;
        gradient.fill(0.0);
        match &self.objective {
            Objective::Program => {
                let clock = Instant::now();
                self.program.gradient(&w[..n], &mut gradient[..n]);
                for j in 0..n {
                    gradient[j] = if self.fixed[j].is_some() { 0.0 } else { gradient[j] * self.objective_scale };
                }
                self.tally.seconds += clock.elapsed().as_secs_f64();
            }
            Objective::Restoration { first, rho, zeta, reference, weight } => {
                for j in 0..n {
                    gradient[j] = zeta * weight[j] * weight[j] * (w[j] - reference[j]);
                }
                gradient[n + first..].fill(*rho);
            }
        }
    }

    /// c(w) (length m).
    pub(crate) fn constraints(&mut self, w: &[f64], c: &mut [f64]) {
        let clock = Instant::now();
        self.program.constraints(&w[..self.n], c);
        for i in 0..self.m {
            c[i] = match self.rows[i] {
                RowForm::Equality(target) => c[i] * self.row_scale[i] - target,
                RowForm::Inequality(_) => c[i] * self.row_scale[i],
                RowForm::Free => 0.0,
            };
        }
        for (a, t) in self.row_variables.iter().zip(&w[self.n..]) {
            c[a.row] += a.sign * t;
        }
        self.tally.seconds += clock.elapsed().as_secs_f64();
        self.tally.constraints += 1;
    }

    /// dg/dx, scaled, zero in fixed columns and free rows.
    pub(crate) fn jacobian(&mut self, w: &[f64], values: &mut [f64]) {
        let clock = Instant::now();
        self.program.jacobian(&w[..self.n], values);
        for (v, &i) in values.iter_mut().zip(&self.program.jacobian_pattern().row_indices) {
            *v *= self.row_scale[i];
        }
        for &q in &self.jacobian_zeros {
            values[q] = 0.0;
        }
        self.tally.seconds += clock.elapsed().as_secs_f64();
    }

    /// Hessian of F + y^T c, or of F without y; without the diagonal of [`add_curvature`](Self::add_curvature).
    pub(crate) fn hessian(&mut self, w: &[f64], y: Option<&[f64]>, values: &mut [f64]) {
        let clock = Instant::now();
        self.scaled_multipliers.fill(0.0);
        if let Some(y) = y {
            for i in (0..self.m).filter(|&i| self.rows[i] != RowForm::Free) {
                self.scaled_multipliers[i] = y[i] * self.row_scale[i];
            }
        }
        let sigma = match self.objective {
            Objective::Program => self.objective_scale,
            Objective::Restoration { .. } => 0.0,
        };
        self.program.hessian(&w[..self.n], sigma, &self.scaled_multipliers, values);
        for &q in &self.hessian_zeros {
            values[q] = 0.0;
        }
        self.tally.seconds += clock.elapsed().as_secs_f64();
    }

    /// Adds the diagonal of the Hessian of the proximal term of the restoration phase, which is not in the pattern.
    pub(crate) fn add_curvature(&self, diagonal: &mut [f64]) {
        if let Objective::Restoration { zeta, weight, .. } = &self.objective {
            for (d, weight) in diagonal[..self.n].iter_mut().zip(weight) {
                *d += zeta * weight * weight;
            }
        }
    }

    /// out += that diagonal times d.
    pub(crate) fn add_curvature_product(&self, d: &[f64], out: &mut [f64]) {
        if let Objective::Restoration { zeta, weight, .. } = &self.objective {
            for ((out, d), weight) in out[..self.n].iter_mut().zip(d).zip(weight) {
                *out += zeta * weight * weight * d;
            }
        }
    }

    /// +1 if w_j has only a lower bound, -1 if only an upper one, otherwise 0. The barrier damps such variables (WB06
    /// section 3.7).
    pub(crate) fn single_side(&self, j: usize) -> f64 {
        match (self.lower[j].is_finite(), self.upper[j].is_finite()) {
            (true, false) => 1.0,
            (false, true) => -1.0,
            _ => 0.0,
        }
    }

    /// out += A^T y for A = dc/dw.
    pub(crate) fn add_transpose(&self, jacobian: &[f64], y: &[f64], out: &mut [f64]) {
        let pattern = self.program.jacobian_pattern();
        for j in 0..self.n {
            let range = pattern.column_starts[j]..pattern.column_starts[j + 1];
            let mut sum = 0.0;
            for (v, &i) in jacobian[range.clone()].iter().zip(&pattern.row_indices[range]) {
                sum += v * y[i];
            }
            out[j] += sum;
        }
        for (k, a) in self.row_variables.iter().enumerate() {
            out[self.n + k] += a.sign * y[a.row];
        }
    }

    /// out_w += A^T y and out_y += A w, in one pass over A.
    pub(crate) fn add_both_products(
        &self,
        jacobian: &[f64],
        y: &[f64],
        out_w: &mut [f64],
        w: &[f64],
        out_y: &mut [f64],
    ) {
        let pattern = self.program.jacobian_pattern();
        for j in 0..self.n {
            let range = pattern.column_starts[j]..pattern.column_starts[j + 1];
            let (mut sum, own) = (0.0, w[j]);
            for (v, &i) in jacobian[range.clone()].iter().zip(&pattern.row_indices[range]) {
                sum += v * y[i];
                out_y[i] += v * own;
            }
            out_w[j] += sum;
        }
        for (k, a) in self.row_variables.iter().enumerate() {
            out_w[self.n + k] += a.sign * y[a.row];
            out_y[a.row] += a.sign * w[self.n + k];
        }
    }

    /// out += H d for the symmetric H whose lower triangle is `hessian`.
    pub(crate) fn add_hessian_product(&self, hessian: &[f64], d: &[f64], out: &mut [f64]) {
        let pattern = self.program.hessian_pattern();
        for j in 0..self.n {
            let range = pattern.column_starts[j]..pattern.column_starts[j + 1];
            let mut sum = 0.0;
            for (v, &i) in hessian[range.clone()].iter().zip(&pattern.row_indices[range]) {
                out[i] += v * d[j];
                if i != j {
                    sum += v * d[i];
                }
            }
            out[j] += sum;
        }
    }
}

/// (position, row, column) of every stored entry.
pub(crate) fn entries(pattern: &SparsityPattern) -> impl Iterator<Item = (usize, usize, usize)> + '_ {
    (0..pattern.columns).flat_map(move |j| {
        (pattern.column_starts[j]..pattern.column_starts[j + 1]).map(move |q| (q, pattern.row_indices[q], j))
    })
}
