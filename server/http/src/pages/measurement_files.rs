//! Uploads of measurement files to a lab session, and the processing of its EMG recordings.

use super::lab_sessions;
use super::measurement_forms::{EmgFields, FilterFields, Forms, JointAngleFields, PreviewedEmg};
use super::recording_preview::RecordingPreview;
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
use gaitwright_service::studies::lab::{self as session, CheckedFile};
use gaitwright_store::{LabSessionId, commit};

/// `POST /lab-sessions/{id}/measurement-files/emg`.
pub(super) async fn emg(
    authorized: Authorized<Run>,
    State(mut app): State<AppState>,
    Id(id, _): Id<LabSessionId, Run>,
    Form(fields): Form<EmgFields>,
) -> Result<Response, PageError> {
    if fields.previews() {
        let (preview, refused) = or_refused(previewed_emg(&mut app, &fields).await)?;
        let forms = Forms { emg: fields, open: "emg", preview, ..Forms::default() };
        return show_preview(&mut app, id, &authorized, forms, refused).await;
    }
    let kept = async {
        let checked = fields.read()?.checked(app.store_mut()).await?;
        keep(&app, &authorized, id, checked).await
    };
    let kept = kept.await;
    lab_sessions::answer(&mut app, id, &authorized.caller, kept, Forms { emg: fields, open: "emg", ..Forms::default() })
        .await
}

/// `POST /lab-sessions/{id}/measurement-files/joint-angles`.
pub(super) async fn joint_angles(
    authorized: Authorized<Run>,
    State(mut app): State<AppState>,
    Id(id, _): Id<LabSessionId, Run>,
    Form(fields): Form<JointAngleFields>,
) -> Result<Response, PageError> {
    if fields.previews() {
        let (joint_angle_preview, refused) = or_refused(previewed_joint_angles(&mut app, &fields).await)?;
        let forms = Forms { joint_angles: fields, open: "joint_angles", joint_angle_preview, ..Forms::default() };
        return show_preview(&mut app, id, &authorized, forms, refused).await;
    }
    let kept = async {
        let checked = fields.read()?.checked(app.store_mut()).await?;
        keep(&app, &authorized, id, checked).await
    };
    let kept = kept.await;
    lab_sessions::answer(
        &mut app,
        id,
        &authorized.caller,
        kept,
        Forms { joint_angles: fields, open: "joint_angles", ..Forms::default() },
    )
    .await
}

/// A preview, or why the file cannot be read.
fn or_refused<T>(previewed: Result<T, Error>) -> Result<(Option<T>, Option<String>), PageError> {
    match previewed {
        Ok(preview) => Ok((Some(preview), None)),
        Err(error @ Error::Invalid(_)) => Ok((None, Some(form_errors::in_words(&error)))),
        Err(other) => Err(other.into()),
    }
}

async fn show_preview(
    app: &mut AppState,
    id: LabSessionId,
    authorized: &Authorized<Run>,
    forms: Forms,
    refused: Option<String>,
) -> Result<Response, PageError> {
    let status = if refused.is_some() { StatusCode::UNPROCESSABLE_ENTITY } else { StatusCode::OK };
    Ok((status, lab_sessions::show(app, id, &authorized.caller, forms, refused).await?).into_response())
}

/// Reads and draws the file of the form on the thread pool. Nothing is stored.
async fn previewed_emg(app: &mut AppState, fields: &EmgFields) -> Result<PreviewedEmg, Error> {
    let new = fields.read()?;
    let draw = move |_: &OnPool| {
        let preview = new.preview()?;
        let recording = RecordingPreview::of_emg(&preview);
        Ok::<_, Error>(PreviewedEmg { columns: preview.columns, channels: lab_charts::muscles(), recording })
    };
    app.compute(draw).await?
}

/// Reads and draws the file of the form on the thread pool. Nothing is stored.
async fn previewed_joint_angles(app: &mut AppState, fields: &JointAngleFields) -> Result<RecordingPreview, Error> {
    let new = fields.read()?;
    app.compute(move |_: &OnPool| Ok(RecordingPreview::of_joint_angles(&new.preview()?))).await?
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
    lab_sessions::answer(&mut app, id, &authorized.caller, processed, forms).await
}
