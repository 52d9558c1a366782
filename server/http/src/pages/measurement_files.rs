//! Uploads of measurement files to a lab session, and the processing of its EMG recordings.

use super::lab;
use super::measurement_forms::{EmgFields, FilterFields, Forms, JointAngleFields, MeasurementPreview};
use super::page_chart::PageChart;
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::extractors::Form;
use crate::figures::lab_charts;
use crate::form_errors;
use crate::page_error::PageError;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use gaitwright_compute::OnPool;
use gaitwright_service::access::Run;
use gaitwright_service::error::Error;
use gaitwright_service::studies::lab::{self as session, CheckedFile, EmgPreview};
use gaitwright_store::{LabSessionId, commit};

/// `POST /lab-sessions/{id}/measurement-files/emg`.
pub(super) async fn emg(
    authorized: Authorized<Run>,
    State(mut app): State<AppState>,
    Id(id, _): Id<LabSessionId, Run>,
    Form(fields): Form<EmgFields>,
) -> Result<Response, PageError> {
    if fields.previews() {
        let (preview, refused) = match previewed(&mut app, &fields).await {
            Ok(preview) => (Some(preview), None),
            Err(error @ Error::Invalid(_)) => (None, Some(form_errors::in_words(&error))),
            Err(other) => return Err(other.into()),
        };
        let status = if refused.is_some() { StatusCode::UNPROCESSABLE_ENTITY } else { StatusCode::OK };
        let forms = Forms { emg: fields, open: "emg", preview, ..Forms::default() };
        return Ok((status, lab::show(&mut app, id, &authorized.caller, forms, refused).await?).into_response());
    }
    let kept = async {
        let checked = fields.read()?.checked(app.store_mut()).await?;
        keep(&app, &authorized, id, checked).await
    };
    let kept = kept.await;
    lab::answer(&mut app, id, &authorized.caller, kept, Forms { emg: fields, open: "emg", ..Forms::default() }).await
}

/// `POST /lab-sessions/{id}/measurement-files/joint-angles`.
pub(super) async fn joint_angles(
    authorized: Authorized<Run>,
    State(mut app): State<AppState>,
    Id(id, _): Id<LabSessionId, Run>,
    Form(fields): Form<JointAngleFields>,
) -> Result<Response, PageError> {
    let kept = async {
        let checked = fields.read()?.checked(app.store_mut()).await?;
        keep(&app, &authorized, id, checked).await
    };
    let kept = kept.await;
    lab::answer(
        &mut app,
        id,
        &authorized.caller,
        kept,
        Forms { joint_angles: fields, open: "joint_angles", ..Forms::default() },
    )
    .await
}

/// Reads and draws the file of the form on the thread pool. Nothing is stored.
async fn previewed(app: &mut AppState, fields: &EmgFields) -> Result<MeasurementPreview, Error> {
    let new = fields.read()?;
    let draw = move |_: &OnPool| {
        let preview = new.preview()?;
        let charts = lab_charts::preview(&preview).iter().map(PageChart::new).collect();
        let EmgPreview { columns, strides, refused, .. } = preview;
        let refused = refused.as_ref().map(form_errors::in_words);
        Ok::<_, Error>(MeasurementPreview { columns, channels: lab_charts::muscles(), charts, strides, refused })
    };
    app.compute(draw).await?
}

async fn keep(
    app: &AppState,
    authorized: &Authorized<Run>,
    id: LabSessionId,
    checked: CheckedFile,
) -> Result<(), Error> {
    let mut writer = app.write().await?;
    session::store_upload(&mut writer, &authorized.caller.actor, id, &checked).await?;
    Ok(commit(writer).await?)
}

/// `POST /lab-sessions/{id}/process`.
pub(super) async fn process(
    authorized: Authorized<Run>,
    State(mut app): State<AppState>,
    Id(id, _): Id<LabSessionId, Run>,
    Form(typed): Form<FilterFields>,
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
