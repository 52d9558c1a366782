//! The form on a gait's page by which staff decide about what was called unsafe.

use super::error::PageError;
use crate::access;
use crate::http::AppState;
use crate::http::extract::Form;
use crate::http::may::May;
use crate::http::reached::Id;
use crate::store::{TrialId, commit};
use crate::studies::safety_review::{self, Decision};
use axum::extract::State;
use axum::response::Redirect;

/// `POST /trials/{id}/safety-review`.
pub(super) async fn post(
    may: May<access::Answer>,
    State(app): State<AppState>,
    Id(id, _): Id<TrialId, access::Answer>,
    Form(form): Form<Decision>,
) -> Result<Redirect, PageError> {
    let mut writer = app.write().await?;
    safety_review::give(&mut writer, &may.caller, id, &form).await?;
    commit(writer).await?;
    app.scheduler.changed();
    Ok(Redirect::to(&format!("/trials/{id}")))
}
