//! Surface electromyograms (EMG): from raw signals to muscle activity over the gait cycle.
//!
//! 1. Zero-phase Butterworth band-pass, full-wave rectification, zero-phase Butterworth low-pass: [`Envelope`].
//! 2. Segmentation at the heel strikes of the leg of each channel, mean of the strides at 101 points, normalisation by the peak of normal walking:
//!    [`CycleActivity`].
//! 3. Distance from normal walking: [`emg_rmse`].

mod activity;
mod cycle_activity;
mod emg_filter;
mod emg_recording;
mod emg_rmse;
mod envelope;
mod filter_settings;
mod leg_strides;
mod model_activity;
mod raw_signal_checks;

pub use activity::Activity;
pub use cycle_activity::{CYCLE_POINTS, CycleActivity};
pub use emg_recording::{EmgRecording, MAX_RATE_HZ};
pub use emg_rmse::{EmgRmse, emg_rmse};
pub use envelope::Envelope;
pub use filter_settings::EmgSettings;
pub use leg_strides::{CycleStart, LegStrides};
pub use model_activity::{ModelActivity, model_activity};

/// Channels of the experiment in the paper: rectus femoris, tibialis anterior, biceps femoris and gastrocnemius of the
/// intact leg, rectus femoris and biceps femoris of the residual limb.
pub const CHANNELS: [&str; 6] = ["RF_L", "TA_L", "BF_L", "GAS_L", "RF_R", "BF_R"];
/// The muscles of [`CHANNELS`].
const MUSCLES: [&str; 6] = [
    "left rectus femoris",
    "left tibialis anterior",
    "left biceps femoris",
    "left gastrocnemius",
    "right rectus femoris",
    "right biceps femoris",
];

/// The muscle of a channel, if it is one of [`CHANNELS`].
pub fn muscle_of(channel: &str) -> Option<&'static str> {
    CHANNELS.iter().zip(MUSCLES).find(|(known, _)| **known == channel).map(|(_, muscle)| muscle)
}
