//! The derivative of the stride-to-stride map by finite differences of simulated domains, without derivatives of motion,
//! guards or impacts.
//!
//! The map of a stride is the composition of its eight domains, so its derivative is the product of theirs. Each domain
//! contracts by about a factor of ten, which differences resolve to many digits. The product, such as 1e-7, would be
//! below the noise of differences over a whole stride. States are restricted to those with contact points on the ground
//! and at rest. The other directions have a multiple multiplier 0, and noise in a multiple eigenvalue is amplified.
//!
//! Richardson extrapolation of central differences with three steps (Romberg's table) gives the limit. The change by
//! the last extrapolation estimates the resolution.

use super::feedback_linearization::{Control, State, split};
use super::hybrid_walker::{Fall, HybridWalker};
use super::poincare_section::{SECTION, Section, section, with_section};
use crate::body::{Axis, PointState};
use nalgebra::{DMatrix, SymmetricEigen};

/// Largest step of the differences, rad and rad/s. Each further step is half the previous one.
const STEP: f64 = 1e-3;
/// Number of steps: the extrapolation removes errors of order 2 and 4.
const STEPS: usize = 3;
/// Number of retries with a tenth of the step after a fall.
const SMALLER_STEPS: usize = 2;
/// Threshold between eigenvalues of constrained directions, which are of order 1, and rounding error.
const UNCONSTRAINED: f64 = 1e-9;

/// Derivative of the map on the admissible states, in an orthonormal basis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ByDifferences {
    /// Extrapolated from all steps.
    pub(super) finest: DMatrix<f64>,
    /// Without the last extrapolation.
    pub(super) coarser: DMatrix<f64>,
}

/// Admissible directions of the section at the start of a domain: an orthonormal basis of the changes of state that
/// keep contact points on the ground and at rest.
pub(super) fn possible_directions(control: &Control<'_>, x: &State) -> DMatrix<f64> {
    let (q, qd) = split(x);
    let state = PointState::new(&q, &qd, &[0.0; 9]);
    let mut rows: Vec<Section> = Vec::new();
    for contact in &control.contacts {
        let gradient = contact.gradient(&state);
        let by_angle = contact.velocity_by_angle(&state);
        if contact.row.axis == Axis::Z {
            rows.push(Section::from_fn(|i, _| if i < 8 { gradient[i + 1] } else { 0.0 }));
        }
        rows.push(Section::from_fn(|i, _| match i {
            0 => 0.0,
            1..8 => by_angle[i - 1],
            _ => gradient[i - 8],
        }));
    }
    let mut squares = DMatrix::<f64>::zeros(SECTION, SECTION);
    for row in &rows {
        squares += row * row.transpose();
    }
    let eigen = SymmetricEigen::new(squares);
    let free: Vec<_> = (0..SECTION)
        .filter(|&k| eigen.eigenvalues[k] < UNCONSTRAINED)
        .map(|k| eigen.eigenvectors.column(k).into_owned())
        .collect();
    DMatrix::from_columns(&free)
}

/// The derivative at a fixed point of the map.
pub(super) fn by_differences(walker: &HybridWalker<'_>, fixed: &State) -> Result<ByDifferences, Fall> {
    let passages = walker.stride(fixed, &mut |_, _, _| {})?;
    let starts: Vec<State> = std::iter::once(*fixed).chain(passages.iter().map(|passage| passage.after)).collect();
    let domains = walker.controls.len();
    let bases: Vec<DMatrix<f64>> =
        walker.controls.iter().zip(&starts).map(|(control, x)| possible_directions(control, x)).collect();
    let (mut finest, mut coarser) = (bases[0].transpose() * &bases[0], bases[0].transpose() * &bases[0]);
    for d in 0..domains {
        let (from, to) = (&bases[d], &bases[(d + 1) % domains]);
        let [order_4, order_6] = extrapolated(|step| passage_by_differences(walker, d, &starts[d], from, to, step))?;
        finest = order_6 * finest;
        coarser = order_4 * coarser;
    }
    Ok(ByDifferences { finest, coarser })
}

/// Central differences of three steps, extrapolated to fourth and to sixth order.
fn extrapolated(difference: impl Fn(f64) -> Result<DMatrix<f64>, Fall>) -> Result<[DMatrix<f64>; 2], Fall> {
    let with_step = |largest: f64| -> Result<[DMatrix<f64>; 2], Fall> {
        let mut row: Vec<DMatrix<f64>> = Vec::with_capacity(STEPS);
        for halving in 0..STEPS {
            let mut next = vec![difference(largest * 0.5_f64.powi(i32::try_from(halving).unwrap_or(0)))?];
            for (order, before) in row.iter().enumerate() {
                let gain = 4.0_f64.powi(i32::try_from(order + 1).unwrap_or(1));
                next.push((&next[order] * gain - before) / (gain - 1.0));
            }
            row = next;
        }
        Ok([row[STEPS - 2].clone(), row[STEPS - 1].clone()])
    };
    let mut found = with_step(STEP);
    for smaller in 1..=SMALLER_STEPS {
        if found.is_ok() {
            break;
        }
        found = with_step(STEP * 0.1_f64.powi(i32::try_from(smaller).unwrap_or(0)));
    }
    found
}

/// Derivative of a domain with its reset, from its basis to that of the next domain.
fn passage_by_differences(
    walker: &HybridWalker<'_>,
    d: usize,
    start: &State,
    from: &DMatrix<f64>,
    to: &DMatrix<f64>,
    step: f64,
) -> Result<DMatrix<f64>, Fall> {
    let mut columns = Vec::with_capacity(from.ncols());
    for direction in from.column_iter() {
        let moved = |change: f64| -> Result<Section, Fall> {
            let x = with_section(start, &(section(start) + direction * change));
            Ok(section(&walker.passage(d, &x, &mut |_, _, _| {})?.after))
        };
        columns.push(to.transpose() * ((moved(step)? - moved(-step)?) / (2.0 * step)));
    }
    Ok(DMatrix::from_columns(&columns))
}
