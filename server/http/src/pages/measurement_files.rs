//! Uploads of measurement files to a lab session, and the processing of its EMG recordings.

use super::lab;
use super::measurement_forms::{EmgFields, Forms, MotionFields, Settings};
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::extractors::Form;
use crate::page_error::PageError;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::Run;
use gaitwright_service::error::Error;
use gaitwright_service::studies::lab::{self as session, Checked};
use gaitwright_store::{LabSessionId, commit};

/// `POST /lab-sessions/{id}/measurement-files/emg`.
pub(super) async fn emg(
    authorized: Authorized<Run>,
    State(mut app): State<AppState>,
    Id(id, _): Id<LabSessionId, Run>,
    Form(fields): Form<EmgFields>,
) -> Result<Response, PageError> {
    let kept = async {
        let checked = fields.read()?.checked(app.store_mut()).await?;
        keep(&app, &authorized, id, checked).await
    };
    let kept = kept.await;
    lab::answer(&mut app, id, &authorized.caller, kept, Forms { emg: fields, open: "emg", ..Forms::default() }).await
}

/// `POST /lab-sessions/{id}/measurement-files/motion`.
pub(super) async fn motion(
    authorized: Authorized<Run>,
    State(mut app): State<AppState>,
    Id(id, _): Id<LabSessionId, Run>,
    Form(fields): Form<MotionFields>,
) -> Result<Response, PageError> {
    let kept = async {
        let checked = fields.read()?.checked(app.store_mut()).await?;
        keep(&app, &authorized, id, checked).await
    };
    let kept = kept.await;
    lab::answer(&mut app, id, &authorized.caller, kept, Forms { motion: fields, open: "motion", ..Forms::default() })
        .await
}

async fn keep(app: &AppState, authorized: &Authorized<Run>, id: LabSessionId, checked: Checked) -> Result<(), Error> {
    let mut writer = app.write().await?;
    session::keep(&mut writer, &authorized.caller.actor, id, &checked).await?;
    Ok(commit(writer).await?)
}

/// `POST /lab-sessions/{id}/process`.
pub(super) async fn process(
    authorized: Authorized<Run>,
    State(mut app): State<AppState>,
    Id(id, _): Id<LabSessionId, Run>,
    Form(typed): Form<Settings>,
) -> Result<Response, PageError> {
    let processed = async {
        let result = session::compute(app.store_mut(), id, typed.read()?).await?;
        let mut writer = app.write().await?;
        session::keep_result(&mut writer, &authorized.caller.actor, id, &result).await?;
        Ok(commit(writer).await?)
    };
    let processed = processed.await;
    let forms = Forms { filters: Some(typed), open: "filters", ..Forms::default() };
    lab::answer(&mut app, id, &authorized.caller, processed, forms).await
}
