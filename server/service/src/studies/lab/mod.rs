//! The paper's experiment: a person walks without the device and with two gaits, blind to which is which.
//!
//! Walk 1 is the one without the device, which nobody can be blind to. The order of the two gaits is an allocation
//! (`store::allocations`), drawn by the operating system in balanced blocks; an administrator unblinds the session. Until
//! then the device alone gets the controller files, or a person of whom that is recorded. What is measured is known by the
//! number of its walk, and so is what the person says of it: the learner hears that when the session is unblinded.

mod answer;
mod measured;
mod recording;
mod session;

pub use answer::{AnswerView, NewAnswer, give as answer, take_back};
pub use measured::{
    EmgResult, EmgView, LimitCycles, WalkActivity, WalkModel, beside_model, compute, emg, keep_result, known_gait,
    limit_cycles,
};
pub use recording::{
    Brought, Checked, EmgReading, FileForm, MotionReading, NewEmg, NewMotion, brought, check_kept, keep,
};
pub use session::{
    Condition, GaitOfWalk, InTheLab, NewSession, RecordedWalk, SessionState, SessionView, WALKS, WalkView,
    checked_walk, close, for_device, gaits_to_walk_with, in_the_lab, plan, record_walk, still_open, unblind,
    was_recorded,
};
