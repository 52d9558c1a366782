//! Reference gaits, for Gait RMSE and for the initial guess of a cold start.

mod heel_strikes;
mod matching;
mod mean_stride;
mod motion_recording;
mod plausibility;
mod recorded_strides;
mod reference_from_recording;
mod reference_gait;
mod sign_doubts;

pub use crate::opensim_reading::AngleUnit;
pub use heel_strikes::HeelStrikes;
pub(crate) use heel_strikes::{MIN_CONTACT_S, MIN_SWING_S, contacts, given};
pub use matching::{distance, nearest};
pub use mean_stride::mean_cycle;
pub use motion_recording::{MotionRecording, VerticalForce};
pub use recorded_strides::{RecordedStride, STRIDE_RANGE_S, is_plausible, strides_between};
pub use reference_gait::{
    DEVIATION_COLUMNS, JOINTS, MAX_ANGLE_RAD, MeasuredPerson, REFERENCE_COLUMNS, REFERENCE_ROWS, ReferenceGait,
};
pub use sign_doubts::{doubtful_curve, doubtful_range};
