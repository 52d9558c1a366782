//! The forms for a safety report and a safety review on the page of a gait.

use super::error::PageError;
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::extract::Form;
use axum::extract::State;
use axum::response::Redirect;
use gaitwright_service::access;
use gaitwright_service::studies::safety_report::{self, Report};
use gaitwright_service::studies::safety_review::{self, Decision};
use gaitwright_store::{TrialId, commit};

/// `POST /trials/{id}/safety-review`.
pub(super) async fn post(
    authorized: Authorized<access::Answer>,
    State(app): State<AppState>,
    Id(id, _): Id<TrialId, access::Answer>,
    Form(form): Form<Decision>,
) -> Result<Redirect, PageError> {
    let mut writer = app.write().await?;
    safety_review::give(&mut writer, &authorized.caller, id, &form).await?;
    commit(writer).await?;
    app.scheduler.changed();
    Ok(Redirect::to(&format!("/trials/{id}")))
}

/// `POST /trials/{id}/safety-report`.
pub(super) async fn report(
    authorized: Authorized<access::Answer>,
    State(app): State<AppState>,
    Id(id, _): Id<TrialId, access::Answer>,
    Form(form): Form<Report>,
) -> Result<Redirect, PageError> {
    let mut writer = app.write().await?;
    safety_report::give(&mut writer, &authorized.caller, id, &form).await?;
    commit(writer).await?;
    app.scheduler.changed();
    Ok(Redirect::to(&format!("/trials/{id}")))
}
