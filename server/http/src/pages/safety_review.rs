//! The forms for a safety report and a safety review on the page of a gait.

use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::extractors::Form;
use crate::page_error::PageError;
use axum::extract::State;
use axum::response::Redirect;
use gaitwright_service::access;
use gaitwright_service::error::Error;
use gaitwright_service::studies::new_safety_report::{self, NewSafetyReport};
use gaitwright_service::studies::safety_review::{self, Decision};
use gaitwright_store::safety_reviews::SafetyDecision;
use gaitwright_store::{SafetyReportId, TrialId, commit};
use serde::Deserialize;

/// The form for a review.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Reviewed {
    decision: SafetyDecision,
    reason: String,
    author: String,
    /// The reports that the page showed, separated by commas.
    reports: String,
}

impl Reviewed {
    fn read(self) -> Result<Decision, Error> {
        let identifier = |text: &str| {
            text.parse()
                .map_err(|_| Error::invalid("reports", text, "the identifier of a safety report from this form"))
        };
        let reports = self.reports.split(',').map(identifier).collect::<Result<Vec<SafetyReportId>, _>>()?;
        let Self { decision, reason, author, .. } = self;
        Ok(Decision { decision, reason, author: Some(author), reports: Some(reports) })
    }
}

/// `POST /trials/{id}/safety-review`.
pub(super) async fn post(
    authorized: Authorized<access::Answer>,
    State(app): State<AppState>,
    Id(id, _): Id<TrialId, access::Answer>,
    Form(form): Form<Reviewed>,
) -> Result<Redirect, PageError> {
    let decision = form.read()?;
    let mut writer = app.write().await?;
    safety_review::give(&mut writer, &authorized.caller, id, &decision).await?;
    commit(writer).await?;
    app.scheduler.changed();
    Ok(Redirect::to(&format!("/trials/{id}")))
}

/// `POST /trials/{id}/safety-report`.
pub(super) async fn report(
    authorized: Authorized<access::Answer>,
    State(app): State<AppState>,
    Id(id, _): Id<TrialId, access::Answer>,
    Form(form): Form<NewSafetyReport>,
) -> Result<Redirect, PageError> {
    let mut writer = app.write().await?;
    new_safety_report::give(&mut writer, &authorized.caller, id, &form).await?;
    commit(writer).await?;
    app.scheduler.changed();
    Ok(Redirect::to(&format!("/trials/{id}")))
}
