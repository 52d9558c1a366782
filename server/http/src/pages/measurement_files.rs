//! Uploads of measurement files to a lab session, and the processing of its EMG recordings.

use super::angle_columns_form::{ColumnsPage, unit_word};
use super::emg_form::{EmgFields, EmgStep};
use super::emg_signals::{self, SignalsPreview};
use super::joint_angle_form::JointAngleFields;
use super::lab_session;
use super::measurement_forms::{EmgPage, FilterFields, Forms};
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
use gait_optimizer::limit_cycle::JOINTS;
use gaitwright_compute::OnPool;
use gaitwright_service::access::{Caller, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::lab::{self as session, CheckedFile, EmgOverview, NewEmg, NewJointAngles};
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
    let step = forms.emg.asks_for();
    if let Some(new) = new {
        if step.is_none() {
            match new.clone().checked_wholly(app.store_mut()).await? {
                Ok(checked) => keep(&app, &authorized, id, &mut check, &checked).await?,
                Err(faults) => faults.into_iter().try_for_each(|fault| refuse_file(&mut check, fault))?,
            }
        }
        // A refused upload shows its last step again.
        if step.is_some() || !check.is_clean() {
            match emg_page(&mut app, new, step.unwrap_or(EmgStep::Strides), &check).await {
                Ok((page, overview)) => {
                    if page.step < EmgStep::Strides {
                        forms.emg.fill_in(&overview);
                    }
                    forms.emg_step = Some(page);
                }
                Err(error) => refuse_file(&mut check, error)?,
            }
        }
    }
    answer(&mut app, id, &authorized.caller, check.into_refused(), forms).await
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
    if let Some(new) = new {
        if forms.joint_angles.uploads() {
            match new.clone().checked_wholly(app.store_mut()).await? {
                Ok(checked) => keep(&app, &authorized, id, &mut check, &checked).await?,
                Err(faults) => faults.into_iter().try_for_each(|fault| refuse_file(&mut check, fault))?,
            }
        }
        if !forms.joint_angles.uploads() || !check.is_clean() {
            match joint_angle_page(&mut app, new, &forms.joint_angles).await {
                Ok(page) => {
                    if let Some((_, unit)) = &page.columns {
                        forms.joint_angles.unit = (*unit).to_owned();
                    }
                    forms.joint_angle_columns = page.columns.map(|(columns, _)| columns);
                    forms.joint_angle_preview = page.preview;
                    if let Some(error) = page.refused {
                        refuse_file(&mut check, error)?;
                    }
                }
                Err(error) => refuse_file(&mut check, error)?,
            }
        }
    }
    answer(&mut app, id, &authorized.caller, check.into_refused(), forms).await
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
    caller: &Caller,
    refused: RefusedFields,
    forms: Forms,
) -> Result<Response, PageError> {
    if forms.emg_step.is_some() || forms.joint_angle_columns.is_some() || forms.joint_angle_preview.is_some() {
        let status = refused.status();
        return Ok((status, lab_session::show(app, id, caller, forms, refused).await?).into_response());
    }
    lab_session::answer(app, id, caller, refused, forms).await
}

/// Reads and draws the file of a step on the thread pool. Nothing is stored.
async fn emg_page(
    app: &mut AppState,
    mut new: NewEmg,
    step: EmgStep,
    check: &FormCheck<EmgFields>,
) -> Result<(EmgPage, EmgOverview), Error> {
    let refused = check.refused_names();
    let draw = move |_: &OnPool| {
        let overview = new.overview(step < EmgStep::Strides)?;
        if let Some(guess) = &overview.guessed_strikes {
            new.reading.heel_strike_column = Some(guess.column.clone());
            new.reading.heel_strike_threshold = guess.threshold;
        }
        let signals = match step {
            EmgStep::File | EmgStep::Strides => SignalsPreview::without_charts,
            EmgStep::Signals | EmgStep::Muscles => SignalsPreview::new,
        };
        let signals = signals(&overview, &new.reading, EmgFields::LABELS);
        let recording = if step == EmgStep::Strides { Some(new.preview()?) } else { None };
        let recording = recording.map(|mut preview| {
            // The form already says what is wrong with these fields.
            preview.refused.retain(|error| {
                !matches!(error, Error::Invalid(fault) if refused.iter().any(|field| fault.field.ends_with(field.as_str())))
            });
            RecordingPreview::of_emg(&preview, EmgFields::LABELS)
        });
        let columns = overview.columns.iter().map(|column| column.name.clone()).collect();
        let facts = emg_signals::facts(&overview);
        let page = EmgPage { step, facts, columns, channels: lab_charts::muscles(), signals, recording };
        Ok::<_, Error>((page, overview))
    };
    app.compute(draw).await?
}

/// A step of the form for joint angles.
struct JointAnglePage {
    /// The columns and their unit, if they are chosen.
    columns: Option<(ColumnsPage, &'static str)>,
    preview: Option<RecordingPreview>,
    /// Why there is no preview although the columns are chosen.
    refused: Option<Error>,
}

/// Reads and draws the file of the form on the thread pool. Nothing is stored. Columns are chosen if the form asked for them, or
/// if the file does not have the names of its format; the preview follows once they are.
async fn joint_angle_page(
    app: &mut AppState,
    mut new: NewJointAngles,
    fields: &JointAngleFields,
) -> Result<JointAnglePage, Error> {
    let (are_chosen, asks) = (fields.columns.are_asked_for(), fields.button == "columns");
    let draw = move |_: &OnPool| {
        if !are_chosen && !asks && !new.needs_columns() {
            let preview = RecordingPreview::of_joint_angles(&new.preview()?, JointAngleFields::LABELS);
            return Ok(JointAnglePage { columns: None, preview: Some(preview), refused: None });
        }
        let choice = new.column_choice()?;
        let columns = (ColumnsPage::new(&choice, &JOINTS, &[])?, unit_word(choice.unit));
        let mut page = JointAnglePage { columns: Some(columns), preview: None, refused: None };
        if are_chosen && !asks {
            new.reading.columns = choice.chosen;
            new.reading.unit = Some(choice.unit.into());
            match new.preview() {
                Ok(preview) => {
                    page.preview = Some(RecordingPreview::of_joint_angles(&preview, JointAngleFields::LABELS));
                }
                Err(error) => page.refused = Some(error),
            }
        }
        Ok(page)
    };
    app.compute(draw).await?
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
