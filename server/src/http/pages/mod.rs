//! Pages for people: rendered on the server, usable without scripts.

mod certificate;
mod compare;
pub mod error;
mod format;
mod gait;
mod gait_charts;
mod home;
mod new_study;
mod rate;
mod reference;
mod reference_gaits;
mod sign_in;
mod study;
mod subject;

use super::AppState;
use super::api::recordings;
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
        .route("/subjects", get(subject::list))
        .route("/subjects/{id}", get(subject::get))
        .route("/subjects/{id}/consent", post(subject::consent))
        .route("/subjects/{id}/withdraw", post(subject::withdraw))
        .route("/trials/{id}", get(gait::get))
        .route("/trials/{id}/certify", post(certificate::post))
        .route("/references", get(reference_gaits::list).post(reference_gaits::import).layer(recordings()))
        .route("/references/{id}", get(reference_gaits::get))
        .route("/rate", get(rate::list))
        .route("/rate/{id}", post(rate::next))
        .route("/rate/pair/{token}", get(rate::pair).post(rate::answer))
        .route("/api", get(reference::get))
        .route("/sign-in", get(sign_in::get).post(sign_in::post))
        .route("/sign-in/{link}", get(sign_in::link).post(sign_in::use_link))
        .route("/sign-out", post(sign_in::out))
        .route("/account", get(sign_in::account).post(sign_in::set_password))
}
