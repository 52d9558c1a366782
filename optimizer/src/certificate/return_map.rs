//! The stride-to-stride map at right heel strike: its fixed point, its multipliers, and a second opinion on them.
//!
//! The section is the state after right heel strike without px, on which nothing depends: 17 numbers. Contacts make
//! many of its directions impossible; those have multiplier 0 and are left out.

use super::control::{State, StateMatrix, split};
use super::domain_differences::{ByDifferences, by_differences, possible_directions};
use super::hybrid_walker::{Fall, HybridWalker};
use nalgebra::linalg::Schur;
use nalgebra::{DMatrix, SMatrix, SVector};
use serde::{Deserialize, Serialize};

/// Numbers of the section.
pub(super) const SECTION: usize = 17;
/// State without px.
pub(super) type Section = SVector<f64, SECTION>;
/// Derivative of the map.
type SectionMatrix = SMatrix<f64, SECTION, SECTION>;

/// Newton steps to the fixed point, and the change (rad, rad/s) at which it is reached.
const NEWTON_STEPS: usize = 8;
const FIXED_POINT: f64 = 1e-8;
/// Both methods must agree on the largest multiplier to this, relative.
const AGREEMENT: f64 = 1e-3;
/// Most iterations of the eigenvalue iteration.
const SCHUR_ITERATIONS: usize = 10_000;

/// One Poincare multiplier.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Multiplier {
    /// Real part.
    pub real: f64,
    /// Imaginary part.
    pub imaginary: f64,
}

impl Multiplier {
    /// Absolute value.
    pub fn modulus(&self) -> f64 {
        self.real.hypot(self.imaginary)
    }
}

/// What the stride-to-stride map says of a gait.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReturnMap {
    /// Largest change of the section's state over one stride from the gait's own first state, rad and rad/s.
    pub gait_residual: f64,
    /// The same at the fixed point of the closed loop near it.
    pub fixed_point_residual: f64,
    /// Largest distance from the gait's first state to the fixed point, rad and rad/s.
    pub fixed_point_distance: f64,
    /// Multipliers from variational equations and saltation, largest first.
    pub multipliers: Vec<Multiplier>,
    /// Largest modulus of them.
    pub largest: f64,
    /// Largest modulus of the multipliers from differences of simulated domains.
    pub largest_by_differences: f64,
    /// What the last extrapolation of the differences changed in it: what they resolve.
    pub differences_resolve: f64,
    /// What a stride leaves of a change of all velocities in proportion, which keeps contacts and virtual constraints: its
    /// share in that very direction. A multiplier only as far as the direction is carried into itself, which the switch from
    /// SS2 to SS1 by force prevents; the multiplier of the zero dynamics is [`Self::largest`] of the map whose hip velocity is
    /// left alone.
    #[serde(alias = "zero_dynamics")]
    pub speed_kept: f64,
    /// What the stride turns such a change into in other directions, over its size.
    #[serde(alias = "zero_dynamics_leak")]
    pub speed_leak: f64,
}

impl ReturnMap {
    /// Relative difference of the largest multiplier between both methods.
    pub fn disagreement(&self) -> f64 {
        (self.largest - self.largest_by_differences).abs() / self.largest.max(f64::MIN_POSITIVE)
    }

    /// Whether both methods agree: to a thousandth, or as far as differences resolve where that is more, and they resolve
    /// what matters.
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

pub(super) fn section(x: &State) -> Section {
    Section::from_column_slice(&x.as_slice()[1..])
}

pub(super) fn with_section(x: &State, section: &Section) -> State {
    State::from_fn(|i, _| if i == 0 { x[0] } else { section[i - 1] })
}

fn section_matrix(derivative: &StateMatrix) -> SectionMatrix {
    derivative.fixed_view::<SECTION, SECTION>(1, 1).into_owned()
}

/// Fixed point of the map near a state, by Newton's method (so that an unstable one is found too); the state itself
/// where Newton's method does not get closer.
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
    // A walker that falls in its very first stride says why.
    if smallest.is_finite() { Ok(best) } else { walker.after_stride(start).map(|_| best) }
}

/// Eigenvalues, largest modulus first; `None` when the iteration does not end.
fn multipliers(matrix: DMatrix<f64>) -> Option<Vec<Multiplier>> {
    let schur = Schur::try_new(matrix, f64::EPSILON, SCHUR_ITERATIONS)?;
    let mut values: Vec<Multiplier> =
        schur.complex_eigenvalues().iter().map(|v| Multiplier { real: v.re, imaginary: v.im }).collect();
    values.sort_by(|a, b| b.modulus().total_cmp(&a.modulus()));
    Some(values)
}

/// Checks the map near the gait's first state.
pub(super) fn return_map(walker: &HybridWalker<'_>, start: &State) -> Result<(State, ReturnMap), Fall> {
    let residual = |x: &State| walker.after_stride(x).map(|after| (section(&after) - section(x)).amax());
    let fixed = fixed_point(walker, start)?;
    let (_, derivative) = walker.stride_with_derivative(&fixed)?;
    let derivative = section_matrix(&derivative);
    let no_eigenvalues = || Fall::NotIntegrable {
        domain: "stride",
        reason: "the eigenvalues of the stride-to-stride map cannot be found".to_owned(),
    };
    let possible = possible_directions(&walker.controls[0], &fixed);
    let on_possible = possible.transpose() * derivative * &possible;
    let multipliers_found = multipliers(on_possible).ok_or_else(no_eigenvalues)?;
    let ByDifferences { finest, coarser } = by_differences(walker, &fixed)?;
    let largest = |matrix| multipliers(matrix).map(|found| found.first().map_or(0.0, Multiplier::modulus));
    let by_differences = largest(finest).ok_or_else(no_eigenvalues)?;
    let less_fine = largest(coarser).ok_or_else(no_eigenvalues)?;
    // Velocities in proportion keep contacts and virtual constraints.
    let (_, qd) = split(&fixed);
    let faster = Section::from_fn(|i, _| if i < 8 { 0.0 } else { qd[i - 8] });
    let carried = derivative * faster;
    let speed_kept = carried.dot(&faster) / faster.norm_squared();
    Ok((
        fixed,
        ReturnMap {
            gait_residual: residual(start)?,
            fixed_point_residual: residual(&fixed)?,
            fixed_point_distance: (section(&fixed) - section(start)).amax(),
            largest: multipliers_found.first().map_or(0.0, Multiplier::modulus),
            largest_by_differences: by_differences,
            differences_resolve: (by_differences - less_fine).abs(),
            multipliers: multipliers_found,
            speed_kept,
            speed_leak: (carried - faster * speed_kept).norm() / faster.norm(),
        },
    ))
}
