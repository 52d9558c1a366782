//! C3 and C4: bounds of variables and of inequality rows, from the tuned bounds, the device and the settings.
//! `contact_force_bounds` has those of contact forces.

use super::contact_force_bounds::contact_force_bounds;
use super::joint_ranges::joint_ranges;
use super::layout::{FORCE, Layout, Q, QD, QDD, U};
use super::rows::RowTable;
use crate::device::Device;
use crate::muscle::{MUSCLE_COUNT, Muscle};
use crate::settings::{GaitLimits, GaitSettings, PerDomainKind};
use crate::tuned_bounds::TunedBounds;
use crate::walking::{CYCLE, DomainKind};

/// Lower and upper bounds of the stored, scaled variables.
#[derive(Debug, Clone, PartialEq)]
pub struct VariableBounds {
    /// Lower bounds.
    pub lower: Vec<f64>,
    /// Upper bounds.
    pub upper: Vec<f64>,
}

/// Limits in the inequality rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActiveLimits {
    /// Friction coefficient.
    pub friction: f64,
    /// Friction coefficient of the landing heel's impulse.
    pub impact_friction: f64,
    /// Swing clearance at mid-swing, m.
    pub clearance_m: f64,
}

impl ActiveLimits {
    /// The limits of settings and tuned bounds.
    pub fn new(limits: &GaitLimits, bounds: &TunedBounds) -> Self {
        Self {
            friction: limits.friction,
            impact_friction: limits.impact_friction,
            clearance_m: bounds.a5.max(limits.clearance_min_m),
        }
    }
}

fn of_kind(per: &PerDomainKind, kind: DomainKind) -> f64 {
    match kind {
        DomainKind::Ds2 => per.ds2,
        DomainKind::Ds3 => per.ds3,
        DomainKind::Ss2 => per.ss2,
        DomainKind::Ss1 => per.ss1,
    }
}

/// Bounds of all variables.
pub fn variable_bounds(
    layout: &Layout,
    bounds: &TunedBounds,
    settings: &GaitSettings,
    device: &Device,
    muscles: &[Muscle; MUSCLE_COUNT],
    weight_n: f64,
) -> VariableBounds {
    let limits = &settings.limits;
    let load = settings.naturalness.trailing_load_share * weight_n;
    let mut lower = vec![f64::NEG_INFINITY; layout.variables];
    let mut upper = vec![f64::INFINITY; layout.variables];
    let mut set = |index: usize, low: f64, high: f64| {
        lower[index] = low / layout.scale[index];
        upper[index] = high / layout.scale[index];
    };
    let position = joint_ranges(bounds, limits, device);
    let device_speed = bounds.a1.min(device.joint_speed_limit_rad_s);
    let torque = limits.joint_torques_n_m(device);
    for (d, domain) in layout.domains.iter().enumerate() {
        let contacts = CYCLE[d].contact_rows();
        for k in 0..domain.points {
            let p = domain.point(k);
            for i in 0..9 {
                set(p + Q + i, position[i].0, position[i].1);
                let speed = if i >= 7 { device_speed } else { bounds.a1 };
                set(p + QD + i, -speed, speed);
                set(p + QDD + i, -bounds.a2, bounds.a2);
            }
            for i in 0..6 {
                set(p + U + i, torque[i].0, torque[i].1);
            }
            for (c, row) in contacts.iter().enumerate() {
                let last = k == domain.last();
                let (low, high) = contact_force_bounds(limits, CYCLE[d], c, *row, domain.sigma(k), last, load);
                set(p + FORCE + c, low, high);
            }
            if layout.muscles {
                for m in 0..MUSCLE_COUNT {
                    let speed = muscles[m].max_speed;
                    set(p + domain.fibre_length() + m, limits.fibre_length_min, limits.fibre_length_max);
                    set(p + domain.fibre_velocity() + m, -speed, speed);
                    set(p + domain.activation() + m, 0.0, 1.0);
                }
            }
        }
        set(
            domain.duration,
            of_kind(&limits.duration_min_s, CYCLE[d].kind),
            of_kind(&limits.duration_max_s, CYCLE[d].kind),
        );
        set(domain.phase_start, -2.0, 2.0);
        for i in 0..domain.outputs.len() * crate::walking::BEZIER_COEFFICIENTS {
            set(domain.bezier + i, -4.0, 4.0);
        }
        if let Some(impulse) = domain.impulse {
            let largest = limits.impulse_max_n_s;
            for c in 0..domain.contacts {
                let low = if CYCLE[d].landing_row() == Some(c) { 0.0 } else { -largest };
                set(impulse + c, low, largest);
            }
        }
    }
    for i in 0..4 {
        set(layout.hip_velocities + i, bounds.a3, bounds.a4);
    }
    set(layout.right_step_length, 0.1, 2.0);
    set(layout.stride_length, 0.2, 3.0);
    VariableBounds { lower, upper }
}

/// Sets the bounds of the inequality rows that depend on settings. With `relaxed_touchdown`, in the first phase of a
/// cold start, landing points must only move downwards.
pub fn set_row_bounds(rows: &mut RowTable, limits: &GaitLimits, relaxed_touchdown: bool) {
    for d in 0..rows.domains.len() {
        let touchdown = match CYCLE[d].kind {
            DomainKind::Ds2 => limits.toe_touchdown_m_s,
            _ => limits.heel_touchdown_m_s,
        };
        for k in 0..rows.domains[d].points.len() {
            if let Some((_, row)) = rows.domains[d].points[k].touchdown {
                rows.upper[row] = if relaxed_touchdown { 0.0 } else { -touchdown };
            }
            if let Some(row) = rows.domains[d].points[k].phase_rate {
                rows.lower[row] = limits.phase_rate_min_m_s;
            }
        }
    }
    for row in [rows.step_length, rows.step_length + 1] {
        rows.lower[row] = limits.step_min_m;
        rows.upper[row] = limits.step_max_m;
    }
    rows.lower[rows.speed] = limits.speed_min_m_s;
    rows.upper[rows.speed] = limits.speed_max_m_s;
}
