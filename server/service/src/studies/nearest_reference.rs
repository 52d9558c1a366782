//! Sorts reference gaits by their distance from a subject in height and body mass.

use crate::error::Error;
use gait_optimizer::Subject;
use gait_optimizer::reference::distance;
use gaitwright_store::reference_gaits::{self, ReferenceGaitRow};
use gaitwright_store::{Connection, ReferenceGaitId};
use std::cmp::Reverse;

/// A reference gait and the distance between the measured person and a subject.
#[derive(Debug, Clone)]
pub struct ReferenceGaitMatch {
    /// The reference gait.
    pub reference_gait: ReferenceGaitRow,
    /// `sqrt((dh / 0.10 m)^2 + (dm / 15 kg)^2)`. Absent if the reference gait does not state height and mass.
    pub distance: Option<f64>,
}

impl ReferenceGaitMatch {
    /// Its place in the order by distance. Distances are not negative, so their bits have the order of their values.
    pub fn place(&self) -> (u64, Reverse<ReferenceGaitId>) {
        (self.distance.unwrap_or(f64::INFINITY).to_bits(), Reverse(self.reference_gait.id))
    }
}

/// Every reference gait, the nearest to the subject in height and body mass first. Those without height and mass come
/// last.
///
/// # Errors
/// Errors of the database.
pub async fn matches(db: &mut Connection, subject: &Subject) -> Result<Vec<ReferenceGaitMatch>, Error> {
    let mut found: Vec<ReferenceGaitMatch> = reference_gaits::all(db)
        .await?
        .into_iter()
        .map(|reference_gait| ReferenceGaitMatch {
            distance: distance(subject, &reference_gait.definition),
            reference_gait,
        })
        .collect();
    found.sort_by_key(ReferenceGaitMatch::place);
    Ok(found)
}
