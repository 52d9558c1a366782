//! The reference gait nearest to a subject in height and body mass.

use super::reference_gait::ReferenceGait;
use crate::subject::Subject;

/// Unit of the difference in height, m: about one standard deviation of adults.
const HEIGHT_UNIT_M: f64 = 0.10;
/// Unit of the difference in body mass, kg: about one standard deviation of adults.
const MASS_UNIT_KG: f64 = 15.0;

/// Distance from a subject to a reference gait: `sqrt((dh / 0.10 m)^2 + (dm / 15 kg)^2)`. `None` if the height or mass
/// of the measured person is unknown.
pub fn distance(subject: &Subject, reference: &ReferenceGait) -> Option<f64> {
    let height = (reference.height_m? - subject.height_m) / HEIGHT_UNIT_M;
    let mass = (reference.body_mass_kg? - subject.body_mass_kg) / MASS_UNIT_KG;
    Some(height.hypot(mass))
}

/// The nearest reference gait with its distance; the first of equally near ones. `None` if no distance is known.
pub fn nearest<'a>(
    subject: &Subject,
    references: impl IntoIterator<Item = &'a ReferenceGait>,
) -> Option<(&'a ReferenceGait, f64)> {
    references
        .into_iter()
        .filter_map(|reference| distance(subject, reference).map(|d| (reference, d)))
        .reduce(|best, next| if next.1 < best.1 { next } else { best })
}
