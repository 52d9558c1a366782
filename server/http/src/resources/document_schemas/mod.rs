//! Schemas of documents that are served and received as other crates write them. `tests/tests/documents.rs` compares
//! them with documents that the service serves.

mod audit_detail;
mod controller_file;
mod gait;
mod reference_gait;
mod settings;
mod solve_problem;

pub(crate) use audit_detail::AuditDetail;
pub(crate) use controller_file::ControllerFile;
pub(crate) use gait::GaitDocument;
pub(crate) use reference_gait::ReferenceGaitDocument;
pub(crate) use settings::{DeviceDefinition, EmgSettings, MuscleParameters};
pub(crate) use solve_problem::SolveProblem;

/// Schemas that have no other fields than theirs.
pub(crate) const CLOSED: [&str; 17] = [
    "AuditDetail",
    "AuditedBodyMeasures",
    "AuditedSafetyReport",
    "AuditedStudySettings",
    "ContactRowName",
    "ControlledDomain",
    "ControllerFile",
    "ControllerOutput",
    "DomainTrajectory",
    "GaitDocument",
    "GaitProblem",
    "MuscleTrajectory",
    "ReferenceGaitDocument",
    "SetPoints",
    "SolveProblem",
    "WalkerSubject",
    "WarmStart",
];
