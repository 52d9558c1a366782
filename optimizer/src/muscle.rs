//! Hill-type muscle-tendon units (Geyer and Herr 2010) and their attachments to the walker.

pub mod attachment;
pub mod curves;
pub mod measured_parameters;
pub mod muscle_tendon_units;
pub mod parameters;

pub use attachment::Attachment;
pub use curves::{CurveValue, force_length, force_velocity, tendon_force};
pub use measured_parameters::{MuscleField, MuscleOverride};
pub use muscle_tendon_units::{MUSCLE_COUNT, MUSCLES, Muscle};
pub use parameters::MuscleParameters;
