//! How near a gait comes to reference gaits: to the one that its problem tracks, and to others.
//!
//! An objective or a study that uses a reference gait makes the Gait RMSE against it small, so that the Gait RMSE against
//! other references tells more about the gait.

use crate::gait::Gait;
use crate::gait_rmse::gait_rmse_with_shift;
use crate::model_error::ModelError;
use crate::reference::ReferenceGait;
use serde::Serialize;

/// Largest shift of the reference gait in the alignment, in fractions of the stride.
const MAX_SHIFT: f64 = 0.1;
/// Number of shifts on each side of zero.
const SHIFTS: i32 = 40;

/// How much a gait differs from a reference gait.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReferenceComparison {
    /// Name of the reference gait.
    pub reference_gait: String,
    /// Whether the problem of the gait has this reference gait.
    pub of_the_problem: bool,
    /// Gait RMSE, rad.
    pub gait_rmse_rad: f64,
    /// RMS differences of torso, hip_L, knee_L, ankle_L and hip_R, degrees.
    pub parts_deg: [f64; 5],
    /// Smallest Gait RMSE over shifts of the reference gait by up to a tenth of the stride, rad. What the Gait RMSE exceeds
    /// it by is a difference in timing.
    pub aligned_gait_rmse_rad: f64,
    /// That shift, in percent of the stride; positive if the gait is late.
    pub shift_percent: f64,
    /// RMS differences in standard deviations of the reference gait, if it has them.
    pub parts_in_standard_deviations: Option<[f64; 5]>,
}

/// Compares a gait with the reference gait of its problem and with the built-in ones.
///
/// # Errors
/// [`ModelError`] if the gait is malformed.
pub fn compare_with_references(
    gait: &Gait,
    of_the_problem: &ReferenceGait,
) -> Result<Vec<ReferenceComparison>, ModelError> {
    gait.validate()?;
    let builtin = ReferenceGait::all_builtin()?;
    let others = builtin.iter().map(|(_, reference)| reference).filter(|other| *other != of_the_problem);
    let own = std::iter::once((of_the_problem, true));
    Ok(own.chain(others.map(|other| (other, false))).map(|(reference, own)| compare(gait, reference, own)).collect())
}

fn compare(gait: &Gait, reference: &ReferenceGait, of_the_problem: bool) -> ReferenceComparison {
    let raw = gait_rmse_with_shift(gait, reference, 0.0);
    // The smallest shift of equally good ones.
    let (shift, aligned) = (0..=SHIFTS)
        .flat_map(|step| if step == 0 { vec![0] } else { vec![step, -step] })
        .map(|step| {
            let shift = MAX_SHIFT * f64::from(step) / f64::from(SHIFTS);
            (shift, gait_rmse_with_shift(gait, reference, shift).total)
        })
        .fold((0.0, raw.total), |best, next| if next.1 < best.1 { next } else { best });
    ReferenceComparison {
        reference_gait: reference.name.clone(),
        of_the_problem,
        gait_rmse_rad: raw.total,
        parts_deg: raw.parts.map(f64::to_degrees),
        aligned_gait_rmse_rad: aligned,
        shift_percent: 100.0 * shift,
        parts_in_standard_deviations: in_standard_deviations(gait, reference),
    }
}

/// RMS over the stride of the differences in standard deviations. `None` without standard deviations, or where one is zero.
fn in_standard_deviations(gait: &Gait, reference: &ReferenceGait) -> Option<[f64; 5]> {
    let deviations = reference.standard_deviation_rad.as_ref()?;
    let intervals = deviations.len() - 1;
    let mut squares = [0.0; 5];
    for row in 0..intervals {
        let fraction = row as f64 / intervals as f64;
        let angles = gait.coordinates_at(fraction * gait.stride_time_s);
        for i in 0..5 {
            squares[i] += ((angles[2 + i] - reference.angles_rad[row][i]) / deviations[row][i]).powi(2);
        }
    }
    let parts = squares.map(|sum| (sum / intervals as f64).sqrt());
    parts.iter().all(|part| part.is_finite()).then_some(parts)
}
