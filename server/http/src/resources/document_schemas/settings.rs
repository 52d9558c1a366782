//! Settings whose properties come from the tables and checks of the optimiser (`openapi_rules.rs`).

#![allow(dead_code)] // Schemas are never constructed.

use serde_json::Value;
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// Definition of a device: name, masses, lengths and limits of the prosthesis.
#[derive(Debug, ToSchema)]
pub(crate) struct DeviceDefinition(BTreeMap<String, Value>);

/// Muscle values that differ from the default ones.
#[derive(Debug, ToSchema)]
pub(crate) struct MuscleParameters(BTreeMap<String, Value>);

/// Filters for EMG recordings. Absent settings take their default values.
#[derive(Debug, ToSchema)]
pub(crate) struct EmgSettings {
    /// Lower cut-off frequency of the band-pass filter, Hz.
    #[schema(required = false)]
    band_low_hz: f64,
    /// Upper cut-off frequency of the band-pass filter, Hz; below half the sampling rate.
    #[schema(required = false)]
    band_high_hz: f64,
    /// Cut-off frequency of the low-pass filter for the envelope, Hz.
    #[schema(required = false)]
    envelope_hz: f64,
    /// Order of both filters: 2, 4, 6 or 8.
    #[schema(required = false)]
    order: u64,
}
