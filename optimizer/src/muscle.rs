//! Hill-type muscle-tendon units (Geyer and Herr 2010) and their attachments to the walker.

pub mod attachment;
pub mod curves;
pub mod parameters;
pub mod unit;

pub use attachment::Attachment;
pub use curves::{CurveValue, force_length, force_velocity, tendon_force};
pub use parameters::{MuscleField, MuscleOverride, MuscleParameters};
pub use unit::{MUSCLE_COUNT, MUSCLES, Muscle};
