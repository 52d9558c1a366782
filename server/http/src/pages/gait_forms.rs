//! Forms on the page of a gait, to simulate walks, to report the gait as unsafe, and to review such reports.

use super::gait::{self, GaitForms};
use super::safety_review::{ReportFields, ReviewFields};
use super::simulated_walks::SimulationFields;
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::extractors::Form;
use crate::page_error::PageError;
use crate::refused_fields::{FormCheck, TypedForm};
use axum::extract::State;
use axum::response::{IntoResponse, Redirect, Response};
use gaitwright_service::access::{Answer, Caller, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::{execution_request, new_safety_report, safety_review};
use gaitwright_store::{TrialId, Writer, commit};
use std::future::Future;
use std::ops::ControlFlow;

/// `POST /trials/{id}/execution-report`.
pub(super) async fn simulate(
    authorized: Authorized<Run>,
    State(mut app): State<AppState>,
    Id(id, _): Id<TrialId, Run>,
    Form(fields): Form<SimulationFields>,
) -> Result<Response, PageError> {
    let mut check = FormCheck::new(&fields);
    let asked = check.read(SimulationFields::request)?;
    if let Some(asked) = asked.filter(|_| check.is_clean()) {
        let requested = async {
            let mut writer = app.write().await?;
            execution_request::ask(&mut writer, &app.scheduler, &authorized.caller.actor, id, asked).await?;
            Ok(commit(writer).await?)
        };
        let requested = requested.await;
        if let ControlFlow::Break(Some(())) = check.step(requested)? {
            app.scheduler.changed();
            return Ok(Redirect::to(&format!("/trials/{id}#simulated-walks")).into_response());
        }
    }
    let forms = GaitForms {
        open: "simulation",
        refused: check.into_refused(),
        simulation: Some(fields),
        ..GaitForms::default()
    };
    gait::refuse(&mut app, authorized.caller, id, forms).await
}

/// `POST /trials/{id}/safety-report`.
pub(super) async fn report(
    authorized: Authorized<Answer>,
    State(mut app): State<AppState>,
    Id(id, _): Id<TrialId, Answer>,
    Form(fields): Form<ReportFields>,
) -> Result<Response, PageError> {
    let mut check = FormCheck::new(&fields);
    if is_recorded(&app, &mut check, &authorized.caller, id).await? {
        return Ok(Redirect::to(&format!("/trials/{id}")).into_response());
    }
    let forms = GaitForms { open: "report", refused: check.into_refused(), report: fields, ..GaitForms::default() };
    gait::refuse(&mut app, authorized.caller, id, forms).await
}

/// `POST /trials/{id}/safety-review`.
pub(super) async fn review(
    authorized: Authorized<Answer>,
    State(mut app): State<AppState>,
    Id(id, _): Id<TrialId, Answer>,
    Form(fields): Form<ReviewFields>,
) -> Result<Response, PageError> {
    let mut check = FormCheck::new(&fields);
    if is_recorded(&app, &mut check, &authorized.caller, id).await? {
        return Ok(Redirect::to(&format!("/trials/{id}")).into_response());
    }
    let forms = GaitForms { open: "review", refused: check.into_refused(), review: fields, ..GaitForms::default() };
    gait::refuse(&mut app, authorized.caller, id, forms).await
}

/// A form about the safety of a gait.
trait SafetyForm: TypedForm + Sync {
    /// Records what the form says.
    fn record(
        &self,
        writer: &mut Writer,
        caller: &Caller,
        id: TrialId,
    ) -> impl Future<Output = Result<(), Error>> + Send;
}

impl SafetyForm for ReportFields {
    async fn record(&self, writer: &mut Writer, caller: &Caller, id: TrialId) -> Result<(), Error> {
        new_safety_report::give(writer, caller, id, &self.new_report()).await.map(|_| ())
    }
}

impl SafetyForm for ReviewFields {
    async fn record(&self, writer: &mut Writer, caller: &Caller, id: TrialId) -> Result<(), Error> {
        safety_review::give(writer, caller, id, &self.read()?).await.map(|_| ())
    }
}

/// Records what a form says, unless one of its fields is refused.
async fn is_recorded<F: SafetyForm>(
    app: &AppState,
    check: &mut FormCheck<F>,
    caller: &Caller,
    id: TrialId,
) -> Result<bool, Error> {
    loop {
        let mut writer = app.write().await?;
        let recorded = check.form().record(&mut writer, caller, id).await;
        match check.step(recorded)? {
            ControlFlow::Continue(()) => {}
            ControlFlow::Break(Some(())) if check.is_clean() => {
                commit(writer).await?;
                app.scheduler.changed();
                return Ok(true);
            }
            ControlFlow::Break(_) => return Ok(false),
        }
    }
}
