//! The findings of the residuals: the worst value of each quantity, at the nodes and between them.

use super::checked_quantity::{Check, CheckLocation, Quantity, WorstValues};
use crate::gait::between_nodes::GaitInstant;

/// A quantity with two limits: at the nodes, where the gait problem imposes the constraint, and between them, where the
/// error depends on the mesh. Quantities of torques and muscle states have no limit between nodes (`None`), because no
/// device executes these parabolas; the closed loop checks the torques of the controller.
pub(super) struct MeasuredQuantity {
    name: &'static str,
    unit: &'static str,
    at_points: f64,
    between: Option<f64>,
}

impl MeasuredQuantity {
    pub(super) const fn new(name: &'static str, unit: &'static str, at_points: f64, between: Option<f64>) -> Self {
        Self { name, unit, at_points, between }
    }
}

/// A grid point.
pub(super) struct GridPoint<'a> {
    pub(super) instant: &'a GaitInstant,
    pub(super) place: CheckLocation<'a>,
    pub(super) on_mesh: bool,
}

/// The worst values at the nodes, between them, and of quantities of the whole stride.
#[derive(Default)]
pub(super) struct Findings {
    at_points: WorstValues,
    between: WorstValues,
    pub(super) other: WorstValues,
}

impl Findings {
    pub(super) fn add(&mut self, point: &GridPoint<'_>, measured: &MeasuredQuantity, value: f64) {
        let (worst, limit) = if point.on_mesh {
            (&mut self.at_points, Some(measured.at_points))
        } else {
            (&mut self.between, measured.between)
        };
        worst.add(Quantity { name: measured.name, unit: measured.unit, limit }, value, point.place);
    }

    pub(super) fn into_checks(self) -> Vec<Check> {
        let mut checks = self.at_points.into_checks(", at nodes");
        checks.extend(self.between.into_checks(", between nodes"));
        checks.extend(self.other.into_checks(""));
        checks
    }
}
