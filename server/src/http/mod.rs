//! The HTTP face: REST under `/api/v1`, pages for people, static files.

pub mod api;
mod extract;
mod gait_series;
mod negotiate;
mod once;
pub mod pages;
mod problem;
mod router;
mod same_origin;
mod state;
mod static_files;

pub use router::router;
pub use state::AppState;
