//! Values and derivatives of the gait problem for the solver: the traversal of all rows. The same traversal records the
//! structure of the derivatives once.

use super::elimination_tree::elimination_tree;
use super::program_data::{GaitProgram, Structure};
use super::sparse_entries::{Compressed, Entries};
use super::{
    contact_limits, fibre_collocation, hip_velocity_rows, motion_and_contact_rows, muscle_force_and_torque_rows,
    objective, stride, transitions, virtual_constraint_rows, zero_dynamics_collocation,
};
use crate::body::PointState;
use crate::body::dynamics::LinkHessian;
use crate::device::Device;
use crate::model_error::ModelError;
use crate::reference::ReferenceGait;
use crate::settings::GaitSettings;
use crate::subject::Subject;
use crate::tuned_bounds::TunedBounds;
use interior_point::{EliminationBlocks, NonlinearProgram, SparsityPattern};
use std::sync::Arc;

/// A violated row or variable bound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowViolation {
    /// The row, if it is one.
    pub row: Option<usize>,
    /// The variable, if it is a bound.
    pub variable: Option<usize>,
    /// Violation, in scaled units.
    pub amount: f64,
}

impl GaitProgram {
    /// The gait problem with the weights of the final phase: 1 for the cost of transport, and that of the settings
    /// for tracking.
    ///
    /// # Errors
    /// [`ModelError`] with the field that is out of range.
    pub fn new(
        subject: &Subject,
        device: &Device,
        bounds: &TunedBounds,
        muscles: bool,
        settings: &GaitSettings,
        reference: &ReferenceGait,
    ) -> Result<Self, ModelError> {
        let mut program = Self::without_structure(subject, device, bounds, muscles, settings, reference)?;
        program.structure = Arc::new(program.record_structure());
        Ok(program)
    }

    /// Largest violation of a row or variable bound at x, in scaled units, with its row or variable.
    pub fn violations(&self, x: &[f64]) -> Vec<RowViolation> {
        let mut values = vec![0.0; self.rows.names.len()];
        self.constraints(x, &mut values);
        let mut result = Vec::new();
        for (row, value) in values.iter().enumerate() {
            let excess = (self.rows.lower[row] - value).max(value - self.rows.upper[row]);
            // NaN is a violation.
            if excess > 0.0 || excess.is_nan() {
                result.push(RowViolation { row: Some(row), variable: None, amount: excess });
            }
        }
        for (variable, value) in x.iter().enumerate() {
            let excess = (self.bounds.lower[variable] - value).max(value - self.bounds.upper[variable]);
            if excess > 0.0 || excess.is_nan() {
                result.push(RowViolation { row: None, variable: Some(variable), amount: excess });
            }
        }
        result.sort_by(|a, b| b.amount.total_cmp(&a.amount));
        result
    }

    fn write_jacobian(&self, x: &[f64], out: &mut Entries<'_>) {
        for (d, rows) in self.rows.domains.iter().enumerate() {
            for (k, point_rows) in rows.points.iter().enumerate() {
                let context = self.point_context(x, d, k);
                let point = self.layout.point_variables(x, d, k);
                let state = PointState::new(&point.q, &point.qd, &point.qdd);
                let p = context.layout.point(k);
                motion_and_contact_rows::jacobian(self, &context, point_rows, &point, &state, p, out);
                virtual_constraint_rows::jacobian(self, &context, point_rows, &point, x, p, out);
                hip_velocity_rows::jacobian(&context, point_rows, p, out);
                contact_limits::jacobian(self, &context, point_rows, &state, x, p, out);
                muscle_force_and_torque_rows::jacobian(self, context.layout, point_rows, &point, p, out);
            }
            let context = self.domain_context(x, d);
            zero_dynamics_collocation::jacobian(self, &context, rows, x, out);
            fibre_collocation::jacobian(self, &context, rows, x, out);
            transitions::jacobian(self, d, rows, x, out);
        }
        stride::jacobian(self, x, out);
    }

    fn write_hessian(&self, x: &[f64], sigma: f64, multipliers: &[f64], out: &mut Entries<'_>) {
        for (d, rows) in self.rows.domains.iter().enumerate() {
            for (k, point_rows) in rows.points.iter().enumerate() {
                let context = self.point_context(x, d, k);
                let point = self.layout.point_variables(x, d, k);
                let state = PointState::new(&point.q, &point.qd, &point.qdd);
                let p = context.layout.point(k);
                let mut link = LinkHessian::default();
                motion_and_contact_rows::hessian(
                    self,
                    &context,
                    point_rows,
                    &point,
                    &state,
                    p,
                    multipliers,
                    &mut link,
                    out,
                );
                contact_limits::hessian(self, &context, point_rows, &state, x, multipliers, &mut link, out);
                motion_and_contact_rows::write_link_hessian(&link, p, out);
                virtual_constraint_rows::hessian(self, &context, point_rows, &point, x, p, multipliers, out);
                hip_velocity_rows::hessian(&context, point_rows, multipliers, out);
                muscle_force_and_torque_rows::hessian(self, context.layout, point_rows, &point, p, multipliers, out);
            }
            let context = self.domain_context(x, d);
            zero_dynamics_collocation::hessian(&context, rows, multipliers, out);
            fibre_collocation::hessian(&context, rows, multipliers, out);
            transitions::hessian(self, d, rows, x, multipliers, out);
        }
        stride::hessian(self, x, multipliers, out);
        objective::hessian(self, x, sigma, out);
    }

    fn record_structure(&self) -> Structure {
        // The structure does not depend on values; any point with positive durations and phase widths gives it.
        let mut x = vec![0.5; self.layout.variables];
        for domain in &self.layout.domains {
            if let Some(end) = domain.phase_end {
                x[end] = 1.0;
            }
        }
        let (n, m) = (self.layout.variables, self.rows.names.len());
        let mut entries = Vec::new();
        self.write_jacobian(&x, &mut Entries::structure(&self.layout.scale, &mut entries));
        let jacobian = Compressed::new(m, n, &entries);
        entries.clear();
        self.write_hessian(&x, 1.0, &vec![1.0; m], &mut Entries::structure(&self.layout.scale, &mut entries));
        let hessian = Compressed::new(n, n, &entries);
        Structure {
            jacobian,
            hessian,
            blocks: elimination_tree(&self.layout, &self.rows, self.activations_are_coupled()),
        }
    }
}

impl NonlinearProgram for GaitProgram {
    fn variables(&self) -> usize {
        self.layout.variables
    }

    fn rows(&self) -> usize {
        self.rows.names.len()
    }

    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&self.bounds.lower);
        upper.copy_from_slice(&self.bounds.upper);
    }

    fn row_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&self.rows.lower);
        upper.copy_from_slice(&self.rows.upper);
    }

    fn jacobian_pattern(&self) -> &SparsityPattern {
        &self.structure.jacobian.pattern
    }

    fn hessian_pattern(&self) -> &SparsityPattern {
        &self.structure.hessian.pattern
    }

    fn objective(&self, x: &[f64]) -> f64 {
        objective::value(self, x)
    }

    fn gradient(&self, x: &[f64], gradient: &mut [f64]) {
        objective::gradient(self, x, gradient);
    }

    fn constraints(&self, x: &[f64], values: &mut [f64]) {
        for (d, rows) in self.rows.domains.iter().enumerate() {
            for (k, point_rows) in rows.points.iter().enumerate() {
                let context = self.point_context(x, d, k);
                let point = self.layout.point_variables(x, d, k);
                let state = PointState::new(&point.q, &point.qd, &point.qdd);
                motion_and_contact_rows::values(self, &context, point_rows, &point, &state, values);
                virtual_constraint_rows::values(self, &context, point_rows, &point, x, values);
                hip_velocity_rows::values(self, &context, point_rows, &point, x, values);
                contact_limits::values(self, &context, point_rows, &point, &state, x, values);
                muscle_force_and_torque_rows::values(self, point_rows, &point, values);
            }
            let context = self.domain_context(x, d);
            zero_dynamics_collocation::values(self, &context, rows, x, values);
            fibre_collocation::values(self, &context, rows, x, values);
            transitions::values(self, d, rows, x, values);
        }
        stride::values(self, x, values);
    }

    fn jacobian(&self, x: &[f64], values: &mut [f64]) {
        let structure = &self.structure.jacobian;
        self.write_jacobian(x, &mut Entries::values(&self.layout.scale, &structure.slots, values));
    }

    fn hessian(&self, x: &[f64], sigma: f64, multipliers: &[f64], values: &mut [f64]) {
        let structure = &self.structure.hessian;
        let mut out = Entries::values(&self.layout.scale, &structure.slots, values);
        self.write_hessian(x, sigma, multipliers, &mut out);
    }

    fn elimination_blocks(&self) -> Option<&EliminationBlocks> {
        Some(&self.structure.blocks)
    }
}
