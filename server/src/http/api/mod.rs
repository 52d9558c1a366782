//! REST under `/api/v1`: one file per resource.

mod devices;
mod events;
mod gaits;
pub mod health;
mod history;
mod motion;
mod preferences;
mod reference_gaits;
mod studies;
mod subjects;
mod trials;

use super::AppState;
use axum::Router;
use axum::routing::{get, post};

/// Every route below `/api/v1`.
pub fn routes() -> Router<AppState> {
    Router::new()
        // who and what
        .route("/subjects", get(subjects::list).post(subjects::create))
        .route("/subjects/{id}", get(subjects::get))
        .route("/devices", get(devices::list))
        .route("/devices/{id}", get(devices::get))
        .route("/reference-gaits", get(reference_gaits::list))
        .route("/reference-gaits/{id}", get(reference_gaits::get))
        // studies
        .route("/studies", get(studies::list).post(studies::create))
        .route("/studies/{id}", get(studies::get))
        .route("/studies/{id}/start", post(studies::start))
        .route("/studies/{id}/pause", post(studies::pause))
        .route("/studies/{id}/resume", post(studies::resume))
        .route("/studies/{id}/stop", post(studies::stop))
        .route("/studies/{id}/trials", get(trials::of_study))
        .route("/studies/{id}/trials.csv", get(trials::of_study_csv))
        .route("/studies/{id}/history", get(history::of_study))
        .route("/studies/{id}/history.csv", get(history::of_study_csv))
        .route("/studies/{id}/preferences", get(preferences::of_study).post(preferences::create))
        .route("/studies/{id}/events", get(events::of_study))
        // trials
        .route("/trials/{id}", get(trials::get))
        .route("/trials/{id}/cancel", post(trials::cancel))
        .route("/trials/{id}/retry", post(trials::retry))
        .route("/trials/{id}/iterations", get(trials::iterations))
        .route("/trials/{id}/gait", get(gaits::get))
        .route("/trials/{id}/gait.csv", get(gaits::get_csv))
        .route("/trials/{id}/motion", get(motion::get))
        // answers
        .route("/preferences/{id}", get(preferences::get))
        .route("/preferences/{id}/retract", post(preferences::retract))
        .route("/health", get(health::get))
}
