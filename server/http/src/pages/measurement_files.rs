//! Uploads of measurement files to a lab session, and the processing of its EMG recordings.

use super::lab_session;
use super::measurement_forms::{EmgFields, FilterFields, Forms, JointAngleFields, PreviewedEmg};
use super::recording_preview::RecordingPreview;
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::extractors::Form;
use crate::figures::lab_charts;
use crate::page_error::PageError;
use crate::refused_fields::{FormCheck, RefusedFields, TypedForm};
use axum::extract::State;
use axum::response::{IntoResponse, Response};
use gaitwright_compute::OnPool;
use gaitwright_service::access::Run;
use gaitwright_service::error::Error;
use gaitwright_service::studies::lab::{self as session, CheckedFile, NewEmg, NewJointAngles};
use gaitwright_store::{LabSessionId, commit};

/// `POST /lab-sessions/{id}/measurement-files/emg`.
pub(super) async fn emg(
    authorized: Authorized<Run>,
    State(mut app): State<AppState>,
    Id(id, _): Id<LabSessionId, Run>,
    Form(fields): Form<EmgFields>,
) -> Result<Response, PageError> {
    let mut check = FormCheck::new(&fields);
    let new = check.read(EmgFields::read)?;
    let mut forms = Forms { emg: fields, open: "emg", ..Forms::default() };
    match new {
        Some(new) if forms.emg.previews() => match previewed_emg(&mut app, new, &check).await {
            Ok(preview) => forms.preview = Some(preview),
            Err(error) => refuse_file(&mut check, error)?,
        },
        Some(new) => match new.checked_wholly(app.store_mut()).await? {
            Ok(checked) => keep(&app, &authorized, id, &mut check, &checked).await?,
            Err(faults) => faults.into_iter().try_for_each(|fault| refuse_file(&mut check, fault))?,
        },
        None => {}
    }
    answer(&mut app, id, &authorized, check.into_refused(), forms).await
}

/// `POST /lab-sessions/{id}/measurement-files/joint-angles`.
pub(super) async fn joint_angles(
    authorized: Authorized<Run>,
    State(mut app): State<AppState>,
    Id(id, _): Id<LabSessionId, Run>,
    Form(fields): Form<JointAngleFields>,
) -> Result<Response, PageError> {
    let mut check = FormCheck::new(&fields);
    let new = check.read(JointAngleFields::read)?;
    let mut forms = Forms { joint_angles: fields, open: "joint_angles", ..Forms::default() };
    match new {
        Some(new) if forms.joint_angles.previews() => match previewed_joint_angles(&mut app, new).await {
            Ok(preview) => forms.joint_angle_preview = Some(preview),
            Err(error) => refuse_file(&mut check, error)?,
        },
        Some(new) => match new.checked_wholly(app.store_mut()).await? {
            Ok(checked) => keep(&app, &authorized, id, &mut check, &checked).await?,
            Err(faults) => faults.into_iter().try_for_each(|fault| refuse_file(&mut check, fault))?,
        },
        None => {}
    }
    answer(&mut app, id, &authorized, check.into_refused(), forms).await
}

/// Notes a fault of a file. How a file must look depends on its sampling rate, so a refused rate comes first.
fn refuse_file<F: TypedForm>(check: &mut FormCheck<F>, error: Error) -> Result<(), Error> {
    let hidden = matches!(&error, Error::Invalid(fault) if fault.field == "recording") && check.refuses("rate_hz");
    if !hidden {
        check.refuse(error)?;
    }
    Ok(())
}

/// Shows the preview or the refused form, or the session with the new file.
async fn answer(
    app: &mut AppState,
    id: LabSessionId,
    authorized: &Authorized<Run>,
    refused: RefusedFields,
    forms: Forms,
) -> Result<Response, PageError> {
    if forms.preview.is_some() || forms.joint_angle_preview.is_some() {
        let status = refused.status();
        return Ok((status, lab_session::show(app, id, &authorized.caller, forms, refused).await?).into_response());
    }
    lab_session::answer(app, id, &authorized.caller, refused, forms).await
}

/// Reads and draws the file of the form on the thread pool. Nothing is stored.
async fn previewed_emg(app: &mut AppState, new: NewEmg, check: &FormCheck<EmgFields>) -> Result<PreviewedEmg, Error> {
    let refused = check.refused_names();
    let draw = move |_: &OnPool| {
        let mut preview = new.preview()?;
        // The form already says what is wrong with these fields.
        preview.refused.retain(|error| {
            !matches!(error, Error::Invalid(fault) if refused.iter().any(|field| fault.field.ends_with(field.as_str())))
        });
        let recording = RecordingPreview::of_emg(&preview, EmgFields::LABELS);
        Ok::<_, Error>(PreviewedEmg { columns: preview.columns, channels: lab_charts::muscles(), recording })
    };
    app.compute(draw).await?
}

/// Reads and draws the file of the form on the thread pool. Nothing is stored.
async fn previewed_joint_angles(app: &mut AppState, new: NewJointAngles) -> Result<RecordingPreview, Error> {
    app.compute(move |_: &OnPool| Ok(RecordingPreview::of_joint_angles(&new.preview()?, JointAngleFields::LABELS)))
        .await?
}

/// Stores a file, if no field was refused.
async fn keep<F: TypedForm>(
    app: &AppState,
    authorized: &Authorized<Run>,
    id: LabSessionId,
    check: &mut FormCheck<F>,
    checked: &CheckedFile,
) -> Result<(), Error> {
    if !check.is_clean() {
        return Ok(());
    }
    let mut writer = app.write().await?;
    match session::store_upload(&mut writer, &authorized.caller.actor, id, checked).await {
        Ok(_) => Ok(commit(writer).await?),
        Err(error) => check.refuse(error).map(drop),
    }
}

/// `POST /lab-sessions/{id}/process`.
pub(super) async fn process(
    authorized: Authorized<Run>,
    State(mut app): State<AppState>,
    Id(id, _): Id<LabSessionId, Run>,
    Form(typed): Form<FilterFields>,
) -> Result<Response, PageError> {
    let mut check = FormCheck::new(&typed);
    let settings = check.read(FilterFields::read_and_check)?;
    if let Some(settings) = settings.filter(|_| check.is_clean()) {
        let processed = async {
            let result = session::compute(app.store_mut(), id, settings).await?;
            let mut writer = app.write().await?;
            session::keep_result(&mut writer, &authorized.caller.actor, id, &result).await?;
            Ok(commit(writer).await?)
        };
        if let Err(error) = processed.await {
            check.refuse(error)?;
        }
    }
    let forms = Forms { filters: Some(typed), open: "filters", ..Forms::default() };
    lab_session::answer(&mut app, id, &authorized.caller, check.into_refused(), forms).await
}
