//! HTML pages, rendered on the server and usable without scripts.

mod access_log;
mod audit;
pub(super) mod belief;
mod bound_use;
mod certificate;
mod compare;
mod devices;
mod explanation;
pub(super) mod figures;
mod format;
mod gait;
mod help;
mod home;
mod lab;
mod lab_charts;
mod lab_walk;
mod measurement_files;
mod measurement_forms;
mod members;
mod muscles;
mod new_study;
mod notice;
mod page_chart;
mod problems;
mod rate;
mod reference;
mod reference_gaits;
mod safety_review;
mod side_by_side;
mod sign_in;
mod study;
mod subject;
mod system;
mod unsent_form;
mod users;

use super::AppState;
use axum::Router;
use axum::middleware::from_fn_with_state;
use axum::routing::{get, post};

/// Every page.
pub fn routes(state: &AppState) -> Router<AppState> {
    Router::new()
        .route("/", get(home::get))
        .route("/studies/new", get(new_study::get).post(new_study::post))
        .route("/studies/new/check", post(new_study::check))
        .route("/studies/compare", get(side_by_side::get))
        .route("/studies/{id}", get(study::get))
        .route("/studies/{id}/live", get(study::live))
        .route("/studies/{id}/belief", get(belief::get))
        .route("/studies/{id}/figures", get(figures::get))
        .route("/studies/{id}/do", post(study::post))
        .route("/studies/{id}/compare", get(compare::get).post(compare::post))
        .route("/studies/{id}/retract", post(compare::retract))
        .route("/studies/{id}/members", get(members::get).post(members::post))
        .route("/subjects", get(subject::list).post(subject::add))
        .route("/subjects/{id}", get(subject::get))
        .route("/subjects/{id}/consent", post(subject::consent))
        .route("/subjects/{id}/withdraw", post(subject::withdraw))
        .route("/subjects/{id}/correct", post(subject::correct))
        .route("/subjects/{id}/muscles", get(muscles::get).post(muscles::post))
        .route("/devices", get(devices::list))
        .route("/devices/{id}", get(devices::get).post(devices::post))
        .route("/trials/{id}", get(gait::get))
        .route("/trials/{id}/running", get(study::running))
        .route("/trials/{id}/certify", post(certificate::post))
        .route("/trials/{id}/explain", post(explanation::post))
        .route("/trials/{id}/safety-report", post(safety_review::report))
        .route("/trials/{id}/safety-review", post(safety_review::post))
        .route("/reference-gaits", get(reference_gaits::list).post(reference_gaits::import))
        .route("/reference-gaits/{id}", get(reference_gaits::get))
        .route("/rate", get(rate::list))
        .route("/rate/{id}", post(rate::next))
        .route("/rate/pair/{token}", get(rate::pair).post(rate::answer))
        .route("/rate/pair/{token}/retract", post(rate::retract))
        .route("/studies/{id}/lab", get(lab::list).post(lab::plan))
        .route("/lab-sessions/{id}", get(lab::get))
        .route("/lab-sessions/{id}/close", post(lab::close))
        .route("/lab-sessions/{id}/unblind", post(lab::unblind))
        .route("/lab-sessions/{id}/measurement-files/emg", post(measurement_files::emg))
        .route("/lab-sessions/{id}/measurement-files/motion", post(measurement_files::motion))
        .route("/lab-sessions/{id}/process", post(measurement_files::process))
        .route("/lab", get(lab_walk::list))
        .route("/lab/{id}", get(lab_walk::get).post(lab_walk::record))
        .route("/lab/{id}/answer", post(lab_walk::answer))
        .route("/lab/{id}/retract", post(lab_walk::retract))
        .route("/users", get(users::get).post(users::post))
        .route("/audit", get(audit::get))
        .route("/access-log", get(access_log::get))
        .route("/system", get(system::get))
        .route("/system/backup", post(system::make_backup))
        .route("/help", get(help::contents))
        .route("/help/{name}", get(help::guide))
        .route("/help/images/{name}", get(help::image))
        .route("/problems", get(problems::list))
        .route("/problems/{name}", get(problems::get))
        .route("/api", get(reference::get))
        .route("/sign-in", get(sign_in::get).post(sign_in::post))
        .route("/sign-in/{link}", get(sign_in::link).post(sign_in::use_link))
        .route("/sign-out", post(sign_in::out))
        .route("/account/sessions", post(sign_in::end_session))
        .route("/account", get(sign_in::account).post(sign_in::set_password))
        .route_layer(from_fn_with_state(state.clone(), unsent_form::keep))
        .route_layer(from_fn_with_state(state.clone(), notice::show))
}
