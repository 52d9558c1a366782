//! Export of gaits: OpenSim motion files, and controller files for the device.
//!
//! The JSON of [`crate::Gait`] has all data of a gait.

pub mod controller;
pub mod opensim_motion_file;
mod samples;

pub use controller::ControllerFile;
pub use opensim_motion_file::motion_file;
pub use samples::RATE_RANGE_HZ;
