//! Gait optimisation for a human walking with a powered transfemoral prosthesis.
//!
//! The crate maps (subject, device, bounds, variant) to a gait. It solves the multi-domain hybrid-zero-dynamics problem
//! with Hill-type muscles of Li, Tucker, Gehlhar, Yue and Ames (RA-L 2022) by a sparse interior-point method, certifies
//! the gait, explains bounds without a gait, and reads recordings. It does no learning, storage or HTTP.

pub mod activation_alternations;
pub mod angle_table;
pub mod body;
mod cancel_token;
pub mod certificate;
pub mod cost_of_transport;
pub mod device;
mod display_angle_unit;
pub mod emg;
pub mod execution;
pub mod explanation;
pub mod export;
pub mod gait;
pub mod gait_problem;
pub mod gait_rmse;
pub mod initial_guess;
pub mod limit_cycle;
mod model_error;
pub mod muscle;
pub mod number_format;
mod opensim_reading;
mod quadrature;
pub mod reference;
pub mod reference_comparison;
pub mod sensitivity;
pub mod settings;
mod signal_filter;
pub mod solve;
pub mod spatiotemporal;
mod statistics;
pub mod subject;
mod table;
pub mod tuned_bounds;
pub mod walking;

pub use device::{Device, DeviceField};
pub use display_angle_unit::DisplayAngleUnit;
pub use gait::{DomainTrajectory, Gait};
pub use gait_problem::margins::Margins;
pub use gait_problem::{GaitProblem, UnchangedBound};
pub use interior_point::{NlpSettings, WarmPoint};
pub use model_error::ModelError;
pub use reference::ReferenceGait;
pub use settings::{GaitSettings, Mesh};
pub use solve::{
    CancelToken, GaitResults, GuessTiming, InitialGuess, IterationRecord, LinearAlgebra, LocalOptimumChoice,
    MuscleRoute, OtherLocalOptimum, SolveError, SolveOptions, SolveOutcome, SolvePhase, SolveReport, SolveStatus,
    SolverRun, StartedFrom, Violation, WarmStart, solve, solve_from_guesses,
};
pub use subject::Subject;
pub use tuned_bounds::TunedBounds;
