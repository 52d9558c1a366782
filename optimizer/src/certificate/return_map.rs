//! The stride-to-stride map at right heel strike: its fixed point, and its multipliers by two methods.
//!
//! The section is the state after right heel strike without px, on which nothing depends: 17 numbers. Directions that
//! violate the contacts have multiplier 0 and are omitted.

use super::feedback_linearization::{State, StateMatrix, split};
use super::finite_differences::{ByDifferences, by_differences, possible_directions};
use super::hybrid_walker::{Fall, HybridWalker};
use super::poincare_section::{SECTION, Section, section, with_section};
use nalgebra::linalg::Schur;
use nalgebra::{DMatrix, SMatrix};
use serde::{Deserialize, Serialize};

/// Derivative of the map.
type SectionMatrix = SMatrix<f64, SECTION, SECTION>;

/// Largest number of Newton steps to the fixed point, and the residual (rad, rad/s) at convergence.
const NEWTON_STEPS: usize = 8;
const FIXED_POINT: f64 = 1e-8;
/// Largest relative difference of the largest multiplier between both methods.
const AGREEMENT: f64 = 1e-3;
/// Largest number of iterations for the eigenvalues.
const SCHUR_ITERATIONS: usize = 10_000;

/// A multiplier: an eigenvalue of the derivative of the Poincare map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FloquetMultiplier {
    /// Real part.
    pub real: f64,
    /// Imaginary part.
    pub imaginary: f64,
}

impl FloquetMultiplier {
    /// Absolute value.
    pub fn modulus(&self) -> f64 {
        self.real.hypot(self.imaginary)
    }
}

/// Largest differences between the first state of the gait and the fixed point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FixedPointDistance {
    /// In the height of the hip, m.
    pub height_m: f64,
    /// In an angle, rad.
    pub angle_rad: f64,
    /// In a velocity of the hip, m/s.
    pub velocity_m_s: f64,
    /// In an angular velocity, rad/s.
    pub angular_velocity_rad_s: f64,
}

impl FixedPointDistance {
    /// The section has the height of the hip, seven angles, two velocities of the hip and seven angular velocities.
    fn between(a: &Section, b: &Section) -> Self {
        let difference = a - b;
        let largest = |first, number| difference.rows(first, number).amax();
        Self {
            height_m: largest(0, 1),
            angle_rad: largest(1, 7),
            velocity_m_s: largest(8, 2),
            angular_velocity_rad_s: largest(10, 7),
        }
    }
}

/// Fixed point and multipliers of the stride-to-stride map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReturnMap {
    /// Largest change of a component of the state (m, rad, m/s or rad/s) over one stride from the first state of the gait.
    pub gait_residual: f64,
    /// The same from the fixed point of the closed loop.
    pub fixed_point_residual: f64,
    /// Distance between the first state of the gait and the fixed point.
    pub fixed_point_distance: FixedPointDistance,
    /// Multipliers by variational equations and saltation, largest modulus first.
    pub multipliers: Vec<FloquetMultiplier>,
    /// Largest modulus of these multipliers.
    pub largest: f64,
    /// Largest modulus of the multipliers, from finite differences of simulated domains.
    pub largest_by_differences: f64,
    /// Change of that modulus by the last extrapolation: the resolution of the differences.
    pub differences_resolve: f64,
    /// Response of the map to a proportional change of all velocities, which preserves contacts and virtual
    /// constraints: the component of the result in that direction. It is a multiplier only if the direction is
    /// invariant, which the transition from SS2 to SS1 by force prevents. The multiplier of the zero dynamics is
    /// [`Self::largest`] of the map with a free hip velocity.
    pub speed_kept: f64,
    /// Norm of the response in the other directions, relative to the change.
    pub speed_leak: f64,
}

impl ReturnMap {
    /// Relative difference of the largest multiplier between both methods.
    pub fn disagreement(&self) -> f64 {
        (self.largest - self.largest_by_differences).abs() / self.largest.max(f64::MIN_POSITIVE)
    }

    /// Whether both methods agree within the relative limit or the resolution of the differences, and the resolution is
    /// sufficient.
    pub fn methods_agree(&self) -> bool {
        let difference = (self.largest - self.largest_by_differences).abs();
        difference <= (AGREEMENT * self.largest).max(self.differences_resolve)
            && self.differences_resolve <= AGREEMENT * self.largest.max(AGREEMENT)
    }

    /// Whether every multiplier is inside the unit circle.
    pub fn is_stable(&self) -> bool {
        self.largest < 1.0
    }
}

fn section_matrix(derivative: &StateMatrix) -> SectionMatrix {
    derivative.fixed_view::<SECTION, SECTION>(1, 1).into_owned()
}

/// Fixed point of the map near a state, by Newton's method, which also finds unstable ones. The state itself if
/// Newton's method makes no progress.
fn fixed_point(walker: &HybridWalker<'_>, start: &State) -> Result<State, Fall> {
    let mut best = *start;
    let mut smallest = f64::INFINITY;
    let mut x = *start;
    for _ in 0..NEWTON_STEPS {
        let Ok((after, derivative)) = walker.stride_with_derivative(&x) else { break };
        let change = section(&after) - section(&x);
        if change.amax() < smallest {
            (best, smallest) = (x, change.amax());
        } else {
            break;
        }
        if smallest < FIXED_POINT {
            break;
        }
        let Some(step) = (SectionMatrix::identity() - section_matrix(&derivative)).lu().solve(&change) else { break };
        x = with_section(&x, &(section(&x) + step));
    }
    // A fall in the first stride is an error with a reason.
    if smallest.is_finite() { Ok(best) } else { walker.after_stride(start).map(|_| best) }
}

/// Eigenvalues, largest modulus first; `None` if the iteration does not converge.
fn multipliers(matrix: DMatrix<f64>) -> Option<Vec<FloquetMultiplier>> {
    let schur = Schur::try_new(matrix, f64::EPSILON, SCHUR_ITERATIONS)?;
    let mut values: Vec<FloquetMultiplier> =
        schur.complex_eigenvalues().iter().map(|v| FloquetMultiplier { real: v.re, imaginary: v.im }).collect();
    values.sort_by(|a, b| b.modulus().total_cmp(&a.modulus()));
    Some(values)
}

/// The map near the first state of the gait.
pub(super) fn return_map(walker: &HybridWalker<'_>, start: &State) -> Result<(State, ReturnMap), Fall> {
    let residual = |x: &State| walker.after_stride(x).map(|after| (section(&after) - section(x)).amax());
    let fixed = fixed_point(walker, start)?;
    let (_, derivative) = walker.stride_with_derivative(&fixed)?;
    let derivative = section_matrix(&derivative);
    let no_eigenvalues = || Fall::NotIntegrable {
        domain: "the stride",
        reason: "the eigenvalues of the stride-to-stride map did not converge".to_owned(),
    };
    let possible = possible_directions(&walker.controls[0], &fixed);
    let on_possible = possible.transpose() * derivative * &possible;
    let multipliers_found = multipliers(on_possible).ok_or_else(no_eigenvalues)?;
    let ByDifferences { finest, coarser } = by_differences(walker, &fixed)?;
    let largest = |matrix| multipliers(matrix).map(|found| found.first().map_or(0.0, FloquetMultiplier::modulus));
    let by_differences = largest(finest).ok_or_else(no_eigenvalues)?;
    let less_fine = largest(coarser).ok_or_else(no_eigenvalues)?;
    // A proportional change of velocities preserves contacts and virtual constraints.
    let (_, qd) = split(&fixed);
    let faster = Section::from_fn(|i, _| if i < 8 { 0.0 } else { qd[i - 8] });
    let carried = derivative * faster;
    let speed_kept = carried.dot(&faster) / faster.norm_squared();
    Ok((
        fixed,
        ReturnMap {
            gait_residual: residual(start)?,
            fixed_point_residual: residual(&fixed)?,
            fixed_point_distance: FixedPointDistance::between(&section(&fixed), &section(start)),
            largest: multipliers_found.first().map_or(0.0, FloquetMultiplier::modulus),
            largest_by_differences: by_differences,
            differences_resolve: (by_differences - less_fine).abs(),
            multipliers: multipliers_found,
            speed_kept,
            speed_leak: (carried - faster * speed_kept).norm() / faster.norm(),
        },
    ))
}
