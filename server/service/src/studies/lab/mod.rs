//! Lab sessions: a subject walks without the device and with two gaits, blinded, as in the experiment of the paper.
//!
//! Walk 1 is without the device. The order of the two gaits is an allocation (`store::allocations`), drawn with a
//! biased coin and concealed until an administrator unblinds the session. Before that, only the device gets the
//! controller files; if a person fetches one, the record says so. Measurements and the subject's answer refer to walk
//! numbers, and the answer reaches the learner at unblinding.

mod controller_file_download;
mod emg_guesses;
mod emg_overview;
mod emg_preview;
mod emg_reading;
mod file_format;
mod foot_strikes;
mod joint_angle_preview;
mod joint_cycles;
mod measurement_results;
mod question;
mod rejected_strides;
mod session;
mod session_name;
mod session_view;
mod subject_answer;
mod unblinding;
mod upload;

pub use controller_file_download::{GaitOfWalk, for_device};
pub use emg_guesses::HeelStrikeColumn;
pub use emg_overview::{ColumnTrace, EmgOverview};
pub use emg_preview::{EmgPreview, Stride, Trace};
pub use emg_reading::EmgReading;
pub use file_format::{C3D_FILE, MeasurementFormat, check_not_c3d};
pub use foot_strikes::FootStrikes;
pub use joint_angle_preview::JointAnglePreview;
pub use joint_cycles::{JointCycle, WalkingLeg};
pub use measurement_results::{
    EmgResult, LimitCycles, ProcessedEmg, WalkActivity, WalkModel, compute, emg, keep_result, known_gait, limit_cycles,
    with_model,
};
pub use question::{AnswerView, WALKS};
pub use session::{
    GaitsToPlanWith, LabSessionProgress, NewLabSession, RecordedWalk, checked_walk, close, gaits_to_plan_with,
    gaits_to_walk_with, plan, record_walk, session_progress, still_open, was_recorded,
};
pub use session_name::name_in_lab;
pub use session_view::{LabSessionState, LabSessionView, WalkCondition, WalkView};
pub use subject_answer::{NewAnswer, give as answer, retract};
pub use unblinding::unblind;
pub use upload::{
    CheckedFile, JointAngleReading, NewEmg, NewJointAngles, UploadedFile, check_kept, read_upload, store_upload,
};
