//! Reference gaits.

use super::document_schemas;
use gait_optimizer::ReferenceGait as Definition;
use gaitwright_service::studies::nearest_reference;
use gaitwright_store::{Instant, ReferenceGaitId, reference_gaits};
use serde::Serialize;
use utoipa::ToSchema;

/// Reference gait. Changing a definition creates a new reference gait, so that studies keep the one they use.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ReferenceGait {
    /// Identifier.
    id: ReferenceGaitId,
    /// Name shown to users.
    name: String,
    /// Definition of the reference gait.
    #[schema(value_type = document_schemas::ReferenceGaitDocument)]
    definition: Definition,
    /// Time of creation.
    created_at: Instant,
}

impl From<reference_gaits::ReferenceGaitRow> for ReferenceGait {
    fn from(row: reference_gaits::ReferenceGaitRow) -> Self {
        let reference_gaits::ReferenceGaitRow { id, name, definition, created_at } = row;
        Self { id, name, definition, created_at }
    }
}

/// A reference gait and the distance between the measured person and a subject.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ReferenceGaitMatch {
    /// The reference gait.
    reference_gait: ReferenceGait,
    /// Distance to the reference gait, without a unit: `sqrt((dh / 0.10 m)^2 + (dm / 15 kg)^2)`, with the difference in
    /// height dh and in body mass dm. Null if the reference gait does not state height and mass.
    distance: Option<f64>,
}

impl From<nearest_reference::ReferenceGaitMatch> for ReferenceGaitMatch {
    fn from(found: nearest_reference::ReferenceGaitMatch) -> Self {
        let nearest_reference::ReferenceGaitMatch { reference_gait, distance } = found;
        Self { reference_gait: reference_gait.into(), distance }
    }
}
