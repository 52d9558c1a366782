//! Pages for people: rendered on the server, usable without scripts.

mod compare;
pub mod error;
mod format;
mod gait;
mod gait_charts;
mod home;
mod new_study;
mod study;

use super::AppState;
use axum::Router;
use axum::routing::{get, post};

/// Every page.
pub fn routes() -> Router<AppState> {
    Router::new()
        .route("/", get(home::get))
        .route("/studies/new", get(new_study::get).post(new_study::post))
        .route("/studies/{id}", get(study::get))
        .route("/studies/{id}/live", get(study::live))
        .route("/studies/{id}/do", post(study::post))
        .route("/studies/{id}/compare", get(compare::get).post(compare::post))
        .route("/studies/{id}/retract", post(compare::retract))
        .route("/trials/{id}", get(gait::get))
}
