//! Schemas of documents that are served and received as other crates write them.

#![allow(dead_code)] // Schemas are never constructed.

use serde_json::Value;
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// A gait as the optimiser writes it. `format_version` is the version of its layout.
#[derive(Debug, ToSchema)]
pub(crate) struct GaitDocument(BTreeMap<String, Value>);

/// Input for `gaitwright solve --problem`: subject, device, bounds, settings, reference gait, limits and warm start.
#[derive(Debug, ToSchema)]
pub(crate) struct SolveProblem(BTreeMap<String, Value>);

/// The file that the controller of a device reads. It describes its own fields.
#[derive(Debug, ToSchema)]
pub(crate) struct ControllerFile(BTreeMap<String, Value>);

/// A reference gait: joint angles over the gait cycle, the measured person, and the processing.
#[derive(Debug, ToSchema)]
pub(crate) struct ReferenceGaitDocument(BTreeMap<String, Value>);

/// Definition of a device: name, masses, lengths and limits of the prosthesis.
#[derive(Debug, ToSchema)]
pub(crate) struct DeviceDefinition(BTreeMap<String, Value>);

/// Muscle values that differ from the default ones.
#[derive(Debug, ToSchema)]
pub(crate) struct MuscleParameters(BTreeMap<String, Value>);

/// What exactly was changed; its fields depend on the kind of change.
#[derive(Debug, ToSchema)]
pub(crate) struct AuditDetail(BTreeMap<String, Value>);

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
