//! Which reference suits a subject: the nearest in height and body mass.

use super::ReferenceGait;
use crate::subject::Subject;

/// A difference in height that weighs as much as [`MASS_UNIT_KG`]: about one standard deviation of adults, m.
const HEIGHT_UNIT_M: f64 = 0.10;
/// kg.
const MASS_UNIT_KG: f64 = 15.0;

/// `sqrt((dh / 0.10 m)^2 + (dm / 15 kg)^2)`; none when the reference does not say whose it is.
pub fn distance(subject: &Subject, reference: &ReferenceGait) -> Option<f64> {
    let height = (reference.height_m? - subject.height_m) / HEIGHT_UNIT_M;
    let mass = (reference.body_mass_kg? - subject.body_mass_kg) / MASS_UNIT_KG;
    Some(height.hypot(mass))
}

/// The nearest reference with its distance, the first of equally near ones; none when no reference says whose it is.
pub fn nearest<'a>(
    subject: &Subject,
    references: impl IntoIterator<Item = &'a ReferenceGait>,
) -> Option<(&'a ReferenceGait, f64)> {
    references
        .into_iter()
        .filter_map(|reference| distance(subject, reference).map(|d| (reference, d)))
        .reduce(|best, next| if next.1 < best.1 { next } else { best })
}
