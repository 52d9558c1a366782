//! Data of the gait problem as a nonlinear program: walker, variables, rows, weights and bounds, and the common data
//! of the rows of a domain or a node.

use super::layout::{DomainLayout, Layout, PointVariables};
use super::rows::RowTable;
use super::sparse_entries::Compressed;
use super::variable_bounds::{ActiveLimits, VariableBounds, set_row_bounds, variable_bounds};
use crate::body::{Axis, ContactPoint, FootPoint, GRAVITY, Side, WalkerModel};
use crate::device::Device;
use crate::model_error::ModelError;
use crate::muscle::{MUSCLE_COUNT, Muscle};
use crate::reference::ReferenceGait;
use crate::settings::{GaitSettings, Regularisation};
use crate::subject::Subject;
use crate::tuned_bounds::TunedBounds;
use crate::walking::{CYCLE, ContactRow, phase_gradient};
use interior_point::EliminationBlocks;
use std::sync::Arc;

/// Weights of the parts of the objective in a phase of the solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectiveWeights {
    /// Weight of the cost of transport.
    pub cost_of_transport: f64,
    /// Weight of the tracking term.
    pub tracking: f64,
}

/// Nonzero terms of the phase gradient of a stance side: index in q and coefficient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PhaseTerms([(usize, f64); 4]);

impl PhaseTerms {
    fn new(model: &WalkerModel, stance: Side) -> Self {
        let gradient = phase_gradient(model, stance);
        let hip = stance.hip();
        Self([2, hip, hip + 1, hip + 2].map(|i| (i, gradient[i - 2])))
    }

    #[inline]
    pub(super) fn terms(&self) -> impl Iterator<Item = (usize, f64)> + use<> {
        self.0.into_iter()
    }

    /// dp and its first two time derivatives at a node.
    #[inline]
    pub(super) fn derivatives(&self, point: &PointVariables) -> [f64; 3] {
        [self.along(&point.q), self.along(&point.qd), self.along(&point.qdd)]
    }

    #[inline]
    fn along(&self, a: &[f64; 9]) -> f64 {
        self.0.iter().map(|&(i, c)| c * a[i]).sum()
    }
}

/// Common data of the rows of a domain.
pub(super) struct DomainContext<'a> {
    pub(super) d: usize,
    pub(super) layout: &'a DomainLayout,
    pub(super) phase: PhaseTerms,
    pub(super) duration: f64,
}

/// Common data of the rows of a node.
pub(super) struct PointContext<'a> {
    pub(super) d: usize,
    pub(super) k: usize,
    pub(super) layout: &'a DomainLayout,
    pub(super) contacts: &'a [ContactRow],
    /// Target of each contact row: constant + coefficient of x_L + coefficient of D.
    pub(super) contact_targets: &'a [[f64; 3]],
    phase: PhaseTerms,
    pub(super) duration: f64,
    pub(super) hip_velocity: f64,
    pub(super) right_step_length: f64,
    pub(super) stride_length: f64,
}

impl PointContext<'_> {
    /// dp and its first two time derivatives at the node.
    #[inline]
    pub(super) fn hip_phase(&self, point: &PointVariables) -> [f64; 3] {
        self.phase.derivatives(point)
    }

    #[inline]
    pub(super) fn phase_terms(&self) -> impl Iterator<Item = (usize, f64)> + use<> {
        self.phase.terms()
    }
}

/// The gait problem of a subject, device, set of bounds and variant, as a nonlinear program.
#[derive(Debug, Clone)]
pub struct GaitProgram {
    /// The walker.
    pub model: WalkerModel,
    /// Variables.
    pub layout: Layout,
    /// Rows.
    pub rows: RowTable,
    /// Weights of the objective.
    pub weights: ObjectiveWeights,
    /// The subject's muscles.
    pub muscles: [Muscle; MUSCLE_COUNT],
    pub(super) limits: ActiveLimits,
    pub(super) regularisation: Regularisation,
    pub(super) foot_points: [ContactPoint; 4],
    pub(super) contacts: Vec<Vec<ContactRow>>,
    contact_targets: Vec<Vec<[f64; 3]>>,
    phases: [PhaseTerms; 2],
    /// Reference angles q[2..] of each domain and node, rad.
    pub(super) reference_angles: Vec<Vec<[f64; 7]>>,
    pub(super) bounds: VariableBounds,
    settings: GaitSettings,
    reference: ReferenceGait,
    timing: StrideTiming,
    pub(super) structure: Arc<Structure>,
}

#[derive(Debug, Default)]
pub(super) struct Structure {
    pub(super) jacobian: Compressed,
    pub(super) hessian: Compressed,
    pub(super) blocks: EliminationBlocks,
}

/// Stride fractions, 0 to 1, of the boundaries between domains in the initial guess and the tracked reference gait.
pub type StrideTiming = [f64; 9];

/// The same timing in both steps.
pub const EVEN_TIMING: StrideTiming = [0.0, 0.07, 0.12, 0.33, 0.50, 0.57, 0.62, 0.83, 1.0];

fn reference_points(layout: &Layout, reference: &ReferenceGait, timing: &StrideTiming) -> Vec<Vec<[f64; 7]>> {
    let at = |d: usize, sigma: f64| timing[d] + sigma * (timing[d + 1] - timing[d]);
    let domains = layout.domains.iter().enumerate();
    domains
        .map(|(d, domain)| (0..domain.points).map(|k| reference.seven_angles(at(d, domain.sigma(k)))).collect())
        .collect()
}

impl GaitProgram {
    /// The program without the structure of its derivatives.
    pub(super) fn without_structure(
        subject: &Subject,
        device: &Device,
        bounds: &TunedBounds,
        muscles: bool,
        settings: &GaitSettings,
        reference: &ReferenceGait,
    ) -> Result<Self, ModelError> {
        bounds.validate()?;
        settings.validate()?;
        reference.validate()?;
        let model = WalkerModel::new(subject, device)?;
        let muscle_table = settings.muscles.muscles(subject);
        let layout = Layout::new(&settings.mesh, muscles);
        let mut rows = RowTable::new(&layout);
        set_row_bounds(&mut rows, &settings.limits, false);
        let foot_points = [
            (FootPoint::Heel, Side::Left),
            (FootPoint::Toe, Side::Left),
            (FootPoint::Heel, Side::Right),
            (FootPoint::Toe, Side::Right),
        ]
        .map(|(point, side)| model.contact_point(point, side));
        let contacts: Vec<Vec<ContactRow>> = CYCLE.iter().map(|d| d.contact_rows()).collect();
        let contact_targets = CYCLE
            .iter()
            .zip(&contacts)
            .map(|(domain, rows)| rows.iter().map(|row| contact_target(&model, domain.stance, *row)).collect())
            .collect();
        let reference_angles = reference_points(&layout, reference, &EVEN_TIMING);
        let phases = [PhaseTerms::new(&model, Side::Left), PhaseTerms::new(&model, Side::Right)];
        Ok(Self {
            limits: ActiveLimits::new(&settings.limits, bounds),
            regularisation: settings.regularisation,
            bounds: variable_bounds(&layout, bounds, settings, device, &muscle_table, model.total_mass * GRAVITY),
            muscles: muscle_table,
            settings: *settings,
            reference: reference.clone(),
            timing: EVEN_TIMING,
            weights: ObjectiveWeights { cost_of_transport: 1.0, tracking: settings.naturalness.reference_weight },
            structure: Arc::new(Structure::default()),
            model,
            layout,
            rows,
            foot_points,
            contacts,
            contact_targets,
            phases,
            reference_angles,
        })
    }

    /// The problem of a tracking phase: other weights, and landing points must only move downwards.
    #[must_use]
    pub fn for_tracking(&self, tracking: f64) -> Self {
        let mut program = self.clone();
        program.weights = ObjectiveWeights { cost_of_transport: 0.0, tracking };
        set_row_bounds(&mut program.rows, &self.settings.limits, true);
        program
    }

    /// The problem with another timing of the tracked reference gait.
    #[must_use]
    pub fn with_timing(mut self, timing: &StrideTiming) -> Self {
        self.timing = *timing;
        self.reference_angles = reference_points(&self.layout, &self.reference, timing);
        self
    }

    /// Stride fraction of a relative time of domain d, by the timing of the tracked reference gait.
    pub fn stride_fraction(&self, d: usize, sigma: f64) -> f64 {
        self.timing[d] + sigma * (self.timing[d + 1] - self.timing[d])
    }

    /// Lower and upper bounds of the stored variables.
    pub(super) fn stored_bounds(&self) -> (&[f64], &[f64]) {
        (&self.bounds.lower, &self.bounds.upper)
    }

    /// Projects every variable into its bounds.
    pub fn project_into_bounds(&self, x: &mut [f64]) {
        for (value, (low, high)) in x.iter_mut().zip(self.bounds.lower.iter().zip(&self.bounds.upper)) {
            *value = value.max(*low).min(*high);
        }
    }

    /// Range of a variable, in physical units.
    pub fn variable_range(&self, variable: usize) -> (f64, f64) {
        let scale = self.layout.scale[variable];
        (self.bounds.lower[variable] * scale, self.bounds.upper[variable] * scale)
    }

    /// Reference angles q\[2..\] at a stride fraction, rad.
    pub fn reference_at(&self, fraction: f64) -> [f64; 7] {
        self.reference.seven_angles(fraction)
    }

    /// Contact rows of a domain with their target positions, m, and foot points.
    pub fn contact_targets_at(
        &self,
        d: usize,
        right_step: f64,
        stride: f64,
    ) -> impl Iterator<Item = (ContactRow, f64, usize)> + '_ {
        self.contacts[d].iter().zip(&self.contact_targets[d]).map(move |(row, target)| {
            let position = target[0] + target[1] * right_step + target[2] * stride;
            (*row, position, super::rows::foot_point_index(row.point, row.side))
        })
    }

    /// Whether domain d has a contact row of the same foot in the same direction.
    pub fn shares_contact(&self, d: usize, contact: ContactRow) -> bool {
        self.contacts[d].iter().any(|row| row.side == contact.side && row.axis == contact.axis)
    }

    /// dp of the stance leg of domain d in a posture, m.
    pub fn hip_phase_of(&self, d: usize, q: &[f64; 9]) -> f64 {
        self.phase_of_stance(self.layout.domains[d].domain.stance).along(q)
    }

    /// A vector with the variables without node of another problem on the same mesh; the variables of nodes are zero.
    pub fn adopt_globals(&self, other: &Self, x_other: &[f64]) -> Vec<f64> {
        let mut x = vec![0.0; self.layout.variables];
        // Nodes come first in every layout, and the other variables have the same order in both variants.
        let (start, start_other) = (self.layout.hip_velocities, other.layout.hip_velocities);
        let tail = self.layout.variables - start;
        x[start..].copy_from_slice(&x_other[start_other..start_other + tail]);
        x
    }

    /// The settings of the problem.
    pub fn settings(&self) -> &GaitSettings {
        &self.settings
    }

    /// Whether the objective couples activations of adjacent nodes.
    pub(super) fn activations_are_coupled(&self) -> bool {
        self.layout.muscles && self.regularisation.activation_bend > 0.0
    }

    pub(super) fn contact_point(&self, row: ContactRow) -> &ContactPoint {
        &self.foot_points[super::rows::foot_point_index(row.point, row.side)]
    }

    fn phase_of_stance(&self, stance: Side) -> PhaseTerms {
        match stance {
            Side::Left => self.phases[0],
            Side::Right => self.phases[1],
        }
    }

    pub(super) fn domain_context(&self, x: &[f64], d: usize) -> DomainContext<'_> {
        let layout = &self.layout.domains[d];
        DomainContext {
            d,
            layout,
            phase: self.phase_of_stance(layout.domain.stance),
            duration: self.layout.value(x, layout.duration),
        }
    }

    pub(super) fn point_context(&self, x: &[f64], d: usize, k: usize) -> PointContext<'_> {
        let layout = &self.layout.domains[d];
        PointContext {
            d,
            k,
            layout,
            contacts: &self.contacts[d],
            contact_targets: &self.contact_targets[d],
            phase: self.phase_of_stance(layout.domain.stance),
            duration: self.layout.value(x, layout.duration),
            hip_velocity: layout.hip_velocity.map_or(0.0, |i| self.layout.value(x, i)),
            right_step_length: self.layout.value(x, self.layout.right_step_length),
            stride_length: self.layout.value(x, self.layout.stride_length),
        }
    }
}

/// Target position of a contact row, m: constant, coefficient of x_L and coefficient of D.
fn contact_target(model: &WalkerModel, stance: Side, row: ContactRow) -> [f64; 3] {
    if row.axis == Axis::Z {
        return [0.0; 3];
    }
    let toe = match (stance, row.side) {
        (_, Side::Right) => [0.0, 0.0, 0.0],
        (Side::Right, Side::Left) => [0.0, 1.0, -1.0],
        (Side::Left, Side::Left) => [0.0, 1.0, 0.0],
    };
    let leg = model.leg(row.side);
    match row.point {
        FootPoint::Toe => toe,
        FootPoint::Heel => [toe[0] - leg.heel_behind_m - leg.toe_ahead_m, toe[1], toe[2]],
    }
}
