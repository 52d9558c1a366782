//! The problem in the form the interior point works on.
//!
//! minimise F(w) subject to c(w) = 0 and l <= w <= u, with w = (x, t). Each *row variable* t_k, a slack or an
//! elastic, occurs in exactly one row, with coefficient a_k = +1 or -1, and has no curvature, so it can be eliminated into the diagonal
//! of its row:
//!
//! * an inequality row g_L <= g(x) <= g_U becomes g(x) - s = 0 with g_L <= s <= g_U;
//! * in the restoration phase every row carries elastics, g(x) - ... - p + n = 0 with p, n >= 0, and
//!   F(w) = rho sum(p + n) + zeta/2 |D (x - x_R)|^2 (WB06 section 3.3).
//!
//! Either way the KKT matrix has order n + m and the same pattern. Fixed variables (x_L = x_U) keep their index with
//! zero derivatives and a unit pivot; rows without bounds likewise.

use std::time::Instant;

use super::problem::{NonlinearProgram, SparsityPattern};
use super::settings::NlpSettings;
use super::status::NlpError;

/// What becomes of a row of g.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum RowKind {
    /// g_i(x) = target.
    Equality(f64),
    /// g_i(x) = slack, the row variable with this index.
    Inequality(usize),
    /// No bounds at all.
    Free,
}

/// A variable that occurs in one row only.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RowVariable {
    pub row: usize,
    /// Its coefficient in that row, +1 or -1.
    pub sign: f64,
}

/// The objective F.
#[derive(Debug, Clone)]
pub(super) enum Objective {
    /// f(x), scaled.
    Program,
    /// The elastic objective; elastics are the row variables from `first` on.
    Restoration { first: usize, rho: f64, zeta: f64, reference: Vec<f64>, weight: Vec<f64> },
}

/// Time and number of evaluations.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct EvaluationTally {
    pub seconds: f64,
    pub constraints: usize,
}

#[derive(Clone)]
pub(super) struct Formulation<'p> {
    pub program: &'p dyn NonlinearProgram,
    /// Number of x.
    pub n: usize,
    /// Number of rows.
    pub m: usize,
    pub fixed: Vec<Option<f64>>,
    pub rows: Vec<RowKind>,
    pub row_variables: Vec<RowVariable>,
    /// Relaxed l and u of w, infinite where there is none.
    pub lower: Vec<f64>,
    pub upper: Vec<f64>,
    pub objective_scale: f64,
    pub row_scale: Vec<f64>,
    pub objective: Objective,
    pub tally: EvaluationTally,
    jacobian_zeros: Vec<usize>,
    hessian_zeros: Vec<usize>,
    scaled_multipliers: Vec<f64>,
}

impl<'p> Formulation<'p> {
    /// Checks the problem and splits its rows.
    pub(super) fn new(program: &'p dyn NonlinearProgram, settings: &NlpSettings) -> Result<Self, NlpError> {
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
                RowKind::Equality(row_lower[i])
            } else if row_lower[i].is_infinite() && row_upper[i].is_infinite() {
                RowKind::Free
            } else {
                row_variables.push(RowVariable { row: i, sign: -1.0 });
                lower.push(row_lower[i]);
                upper.push(row_upper[i]);
                RowKind::Inequality(row_variables.len() - 1)
            });
        }
        let jacobian = program.jacobian_pattern();
        let hessian = program.hessian_pattern();
        let jacobian_zeros = entries(jacobian)
            .filter(|&(_, i, j)| fixed[j].is_some() || rows[i] == RowKind::Free)
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

    /// Scales objective and rows down until no derivative at `x` exceeds `limit` (WB06 section 3.8).
    pub(super) fn scale_by_gradients(&mut self, x: &[f64], limit: f64) {
        const SMALLEST: f64 = 1e-8;
        let mut gradient = vec![0.0; self.length()];
        self.gradient(x, &mut gradient);
        let largest = gradient[..self.n].iter().fold(0.0f64, |a, v| a.max(v.abs()));
        if largest.is_finite() && largest > limit {
            self.objective_scale = (limit / largest).max(SMALLEST);
        }
        let mut values = vec![0.0; self.program.jacobian_pattern().row_indices.len()];
        self.jacobian(x, &mut values);
        let mut largest = vec![0.0f64; self.m];
        for (q, i, _) in entries(self.program.jacobian_pattern()) {
            largest[i] = largest[i].max(values[q].abs());
        }
        for i in 0..self.m {
            if largest[i].is_finite() && largest[i] > limit {
                let scale = (limit / largest[i]).max(SMALLEST);
                self.row_scale[i] = scale;
                match &mut self.rows[i] {
                    RowKind::Equality(target) => *target *= scale,
                    RowKind::Inequality(k) => {
                        self.lower[self.n + *k] *= scale;
                        self.upper[self.n + *k] *= scale;
                    }
                    RowKind::Free => {}
                }
            }
        }
    }

    /// Length of w.
    pub(super) fn length(&self) -> usize {
        self.n + self.row_variables.len()
    }

    /// F(w); NaN or infinite when it cannot be evaluated.
    pub(super) fn objective(&mut self, w: &[f64]) -> f64 {
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
    pub(super) fn gradient(&mut self, w: &[f64], gradient: &mut [f64]) {
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
    pub(super) fn constraints(&mut self, w: &[f64], c: &mut [f64]) {
        let clock = Instant::now();
        self.program.constraints(&w[..self.n], c);
        for i in 0..self.m {
            c[i] = match self.rows[i] {
                RowKind::Equality(target) => c[i] * self.row_scale[i] - target,
                RowKind::Inequality(_) => c[i] * self.row_scale[i],
                RowKind::Free => 0.0,
            };
        }
        for (a, t) in self.row_variables.iter().zip(&w[self.n..]) {
            c[a.row] += a.sign * t;
        }
        self.tally.seconds += clock.elapsed().as_secs_f64();
        self.tally.constraints += 1;
    }

    /// dg/dx, scaled, zero in fixed columns and free rows.
    pub(super) fn jacobian(&mut self, w: &[f64], values: &mut [f64]) {
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

    /// Hessian of F + y^T c, of F alone without y; without the diagonal of [`add_curvature`](Self::add_curvature).
    pub(super) fn hessian(&mut self, w: &[f64], y: Option<&[f64]>, values: &mut [f64]) {
        let clock = Instant::now();
        self.scaled_multipliers.fill(0.0);
        if let Some(y) = y {
            for i in (0..self.m).filter(|&i| self.rows[i] != RowKind::Free) {
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

    /// Adds the diagonal of the Hessian of F that is not in the pattern.
    pub(super) fn add_curvature(&self, diagonal: &mut [f64]) {
        if let Objective::Restoration { zeta, weight, .. } = &self.objective {
            for (d, weight) in diagonal[..self.n].iter_mut().zip(weight) {
                *d += zeta * weight * weight;
            }
        }
    }

    /// out += that diagonal times d.
    pub(super) fn add_curvature_product(&self, d: &[f64], out: &mut [f64]) {
        if let Objective::Restoration { zeta, weight, .. } = &self.objective {
            for ((out, d), weight) in out[..self.n].iter_mut().zip(d).zip(weight) {
                *out += zeta * weight * weight * d;
            }
        }
    }

    /// Bounds of w_j on one side only: +1 (lower), -1 (upper), else 0. Such variables are damped (WB06 section 3.7).
    pub(super) fn single_side(&self, j: usize) -> f64 {
        match (self.lower[j].is_finite(), self.upper[j].is_finite()) {
            (true, false) => 1.0,
            (false, true) => -1.0,
            _ => 0.0,
        }
    }

    /// out += A^T y for A = dc/dw.
    pub(super) fn add_transpose(&self, jacobian: &[f64], y: &[f64], out: &mut [f64]) {
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
    pub(super) fn add_both_products(
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
    pub(super) fn add_hessian_product(&self, hessian: &[f64], d: &[f64], out: &mut [f64]) {
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
pub(super) fn entries(pattern: &SparsityPattern) -> impl Iterator<Item = (usize, usize, usize)> + '_ {
    (0..pattern.columns).flat_map(move |j| {
        (pattern.column_starts[j]..pattern.column_starts[j + 1]).map(move |q| (q, pattern.row_indices[q], j))
    })
}

fn check_pattern(
    name: &str,
    pattern: &SparsityPattern,
    rows: usize,
    columns: usize,
    lower: bool,
) -> Result<(), NlpError> {
    let fail = |what: String| Err(NlpError::InvalidProblem(format!("{name} pattern: {what}")));
    if pattern.rows != rows || pattern.columns != columns {
        return fail(format!("is {} x {}, expected {rows} x {columns}", pattern.rows, pattern.columns));
    }
    let starts = &pattern.column_starts;
    if starts.len() != columns + 1
        || starts.first() != Some(&0)
        || starts.last() != Some(&pattern.row_indices.len())
        || starts.windows(2).any(|s| s[0] > s[1])
    {
        return fail("column starts are not 0 = s_0 <= s_1 <= ... = number of entries".to_owned());
    }
    for j in 0..columns {
        let column = &pattern.row_indices[starts[j]..starts[j + 1]];
        if column.windows(2).any(|r| r[0] >= r[1]) {
            return fail(format!("row indices of column {j} are not ascending"));
        }
        if column.last().is_some_and(|&i| i >= rows) {
            return fail(format!("column {j} has a row index beyond {rows}"));
        }
        if lower && column.first().is_some_and(|&i| i < j) {
            return fail(format!("column {j} has an entry above the diagonal"));
        }
    }
    Ok(())
}

fn check_bounds(name: &str, lower: &[f64], upper: &[f64]) -> Result<(), NlpError> {
    for (i, (l, u)) in lower.iter().zip(upper).enumerate() {
        if l.is_nan() || u.is_nan() || l > u || *l == f64::INFINITY || *u == f64::NEG_INFINITY {
            return Err(NlpError::InvalidProblem(format!("bounds of {name} {i} are {l} and {u}")));
        }
    }
    Ok(())
}
