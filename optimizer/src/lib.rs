//! Gait optimisation for a human walking with a powered transfemoral prosthesis.
//!
//! The crate maps (subject, device, bounds, variant) to a gait. It solves the multi-domain hybrid-zero-dynamics problem
//! with Hill-type muscles of Li, Tucker, Gehlhar, Yue and Ames (RA-L 2022) by a sparse interior-point method, certifies
//! the gait, explains bounds without a gait, and reads recordings. It does no learning, storage or HTTP.

pub mod body;
pub mod bounds;
pub mod certificate;
pub mod cold_start;
pub mod device;
pub mod emg;
pub mod explanation;
pub mod export;
mod filter;
pub mod gait;
pub mod gait_problem;
mod in_words;
pub mod metrics;
pub mod muscle;
pub mod nlp;
mod opensim;
pub mod phase_portrait;
pub mod reference;
pub mod settings;
pub mod solve;
pub mod subject;
mod table;
pub mod walking;

pub use bounds::TunedBounds;
pub use device::{Device, DeviceField};
pub use gait::{DomainTrajectory, Gait};
pub use gait_problem::margins::Margins;
pub use reference::ReferenceGait;
pub use settings::{GaitSettings, Mesh};
pub use solve::{
    Attempt, BasinChoice, CancelToken, ColdGuess, ColdRoute, GaitProblem, GuessTiming, IterationRecord, LinearAlgebra,
    OtherBasin, Phase, SolveError, SolveOptions, SolveOutcome, SolveReport, SolveStatus, StartedFrom, Violation,
    WarmStart, solve, solve_from_guesses,
};
pub use subject::{ModelError, Subject};
