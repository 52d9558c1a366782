//! The stride-to-stride map at right heel strike: its fixed point, its multipliers, and a second opinion on them.
//!
//! The section is the state after right heel strike without px, on which nothing depends: 17 numbers. Contacts make
//! many of its directions impossible; those have multiplier 0.

use super::control::{State, StateMatrix, split};
use super::hybrid_walker::{Fall, HybridWalker};
use nalgebra::linalg::Schur;
use nalgebra::{DMatrix, SMatrix, SVector};
use serde::{Deserialize, Serialize};

/// State without px.
type Section = SVector<f64, 17>;
/// Derivative of the map.
type SectionMatrix = SMatrix<f64, 17, 17>;

/// Newton steps to the fixed point, and the change (rad, rad/s) at which it is reached.
const NEWTON_STEPS: usize = 8;
const FIXED_POINT: f64 = 1e-8;
/// Perturbation of the central differences, rad and rad/s: its third-order error and the integrator's noise are alike.
const DIFFERENCE: f64 = 1e-5;
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
    /// Largest modulus of the multipliers from central differences of simulated strides.
    pub largest_by_differences: f64,
    /// Multiplier of a change of the walking speed that keeps all virtual constraints: the zero dynamics.
    pub zero_dynamics: f64,
    /// What the stride turns such a change into outside the zero dynamics, over its size: 0 for invariance.
    pub zero_dynamics_leak: f64,
}

impl ReturnMap {
    /// Relative difference of the largest multiplier between both methods.
    pub fn disagreement(&self) -> f64 {
        (self.largest - self.largest_by_differences).abs() / self.largest.max(f64::MIN_POSITIVE)
    }

    /// Whether every multiplier is inside the unit circle.
    pub fn is_stable(&self) -> bool {
        self.largest < 1.0
    }
}

fn section(x: &State) -> Section {
    Section::from_column_slice(&x.as_slice()[1..])
}

fn with_section(x: &State, section: &Section) -> State {
    State::from_fn(|i, _| if i == 0 { x[0] } else { section[i - 1] })
}

fn section_matrix(derivative: &StateMatrix) -> SectionMatrix {
    derivative.fixed_view::<17, 17>(1, 1).into_owned()
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

/// Derivative of the map by central differences of simulated strides.
fn by_differences(walker: &HybridWalker<'_>, x: &State) -> Result<SectionMatrix, Fall> {
    let mut result = SectionMatrix::zeros();
    for column in 0..17 {
        let moved = |sign: f64| {
            let mut from = *x;
            from[column + 1] += sign * DIFFERENCE;
            walker.after_stride(&from).map(|after| section(&after))
        };
        result.set_column(column, &((moved(1.0)? - moved(-1.0)?) / (2.0 * DIFFERENCE)));
    }
    Ok(result)
}

/// Eigenvalues, largest modulus first; `None` when the iteration does not end.
fn multipliers(matrix: &SectionMatrix) -> Option<Vec<Multiplier>> {
    let dynamic = DMatrix::from_column_slice(17, 17, matrix.as_slice());
    let schur = Schur::try_new(dynamic, f64::EPSILON, SCHUR_ITERATIONS)?;
    let mut values: Vec<Multiplier> =
        schur.complex_eigenvalues().iter().map(|v| Multiplier { real: v.re, imaginary: v.im }).collect();
    values.sort_by(|a, b| b.modulus().total_cmp(&a.modulus()));
    Some(values)
}

/// Examines the map near the gait's first state.
pub(super) fn return_map(walker: &HybridWalker<'_>, start: &State) -> Result<(State, ReturnMap), Fall> {
    let residual = |x: &State| walker.after_stride(x).map(|after| (section(&after) - section(x)).amax());
    let fixed = fixed_point(walker, start)?;
    let (_, derivative) = walker.stride_with_derivative(&fixed)?;
    let derivative = section_matrix(&derivative);
    let no_eigenvalues = || Fall::NotIntegrable {
        domain: "stride",
        reason: "the eigenvalues of the stride-to-stride map cannot be found".to_owned(),
    };
    let multipliers_found = multipliers(&derivative).ok_or_else(no_eigenvalues)?;
    let differences = multipliers(&by_differences(walker, &fixed)?).ok_or_else(no_eigenvalues)?;
    // Velocities in proportion keep contacts and virtual constraints: the direction of the zero dynamics.
    let (_, qd) = split(&fixed);
    let faster = Section::from_fn(|i, _| if i < 8 { 0.0 } else { qd[i - 8] });
    let carried = derivative * faster;
    let zero_dynamics = carried.dot(&faster) / faster.norm_squared();
    Ok((
        fixed,
        ReturnMap {
            gait_residual: residual(start)?,
            fixed_point_residual: residual(&fixed)?,
            fixed_point_distance: (section(&fixed) - section(start)).amax(),
            largest: multipliers_found.first().map_or(0.0, Multiplier::modulus),
            largest_by_differences: differences.first().map_or(0.0, Multiplier::modulus),
            multipliers: multipliers_found,
            zero_dynamics,
            zero_dynamics_leak: (carried - faster * zero_dynamics).norm() / faster.norm(),
        },
    ))
}
