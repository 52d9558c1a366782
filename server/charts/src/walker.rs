//! The walker of a gait: a body with limbs, a prosthesis, muscles and ground reaction forces.
//!
//! Every part has a fixed outline in the frame of its segment, so that a pose is one transformation for each segment.
//! The script of the pages and the animation for download move the same outlines.

mod animation;
mod body_outline;
mod gait_walker;
mod muscle_paths;
mod segment;

pub use animation::Animation;
pub(crate) use body_outline::parts;
pub use gait_walker::{GaitWalker, Ghost};
pub(crate) use segment::UNITS_PER_M;
