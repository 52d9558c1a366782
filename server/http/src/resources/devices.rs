//! Devices.

use super::document_schemas;
use gait_optimizer::Device as Definition;
use gaitwright_store::{DeviceId, Instant, devices};
use serde::Serialize;
use utoipa::ToSchema;

/// Device. Changing a definition creates a new device, so that studies keep the one they use.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Device {
    /// Identifier.
    id: DeviceId,
    /// Name shown to users.
    name: String,
    /// Definition of the device.
    #[schema(value_type = document_schemas::DeviceDefinition)]
    definition: Definition,
    /// Time of creation.
    created_at: Instant,
}

impl From<devices::DeviceRow> for Device {
    fn from(row: devices::DeviceRow) -> Self {
        let devices::DeviceRow { id, name, definition, created_at } = row;
        Self { id, name, definition, created_at }
    }
}
