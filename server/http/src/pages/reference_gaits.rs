//! The pages of reference gaits: the list with the import form, and each one with its curves.

use super::page_chart::PageChart;
use super::recording_preview::RecordingPreview;
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::extractors::{Form as Submitted, Params};
use crate::figures::reference_figures;
use crate::form_errors;
use crate::format;
use crate::page_error::{PageError, PageResult, page};
use crate::units::Units;
use askama::Template;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Redirect, Response};
use gaitwright_compute::OnPool;
use gaitwright_service::access::{Read, RequiredRight, Run};
use gaitwright_service::error::{Error, FieldError};
use gaitwright_service::studies::nearest_reference::{self, ReferenceGaitMatch};
use gaitwright_service::studies::reference_import::{self, JointAngleFormat, NewReferenceGait, Strikes, Unit};
use gaitwright_store::reference_gaits::{self, ReferenceGait};
use gaitwright_store::subjects::{self, Subject};
use gaitwright_store::{Connection, ReferenceGaitId, SubjectId, commit};
use serde::Deserialize;
use std::str::FromStr;

/// The fields as typed, to show a refused form again.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct ReferenceGaitFields {
    name: String,
    format: JointAngleFormat,
    recording: String,
    unit: String,
    force_column: String,
    forces: String,
    strikes: Strikes,
    heel_strikes_s: String,
    height_m: String,
    body_mass_kg: String,
    /// The units in which the form was shown.
    units: Units,
    /// `preview`, or else an import.
    button: String,
}

impl ReferenceGaitFields {
    fn read(&self) -> Result<NewReferenceGait, Error> {
        let given = |text: &str| Some(text.trim().to_owned()).filter(|text| !text.is_empty());
        Ok(NewReferenceGait {
            name: self.name.clone(),
            format: self.format,
            recording: self.recording.clone(),
            unit: match self.unit.as_str() {
                "" => None,
                "degrees" => Some(Unit::Degrees),
                "radians" => Some(Unit::Radians),
                other => return Err(Error::invalid("unit", other, "degrees, radians or empty")),
            },
            force_column: given(&self.force_column),
            forces: Some(self.forces.clone()).filter(|text| !text.trim().is_empty()),
            strikes: self.strikes,
            heel_strikes_s: match given(&self.heel_strikes_s) {
                None => Vec::new(),
                Some(text) => text.split(',').map(|part| number("heel_strikes_s", part)).collect::<Result<_, _>>()?,
            },
            height_m: given(&self.height_m).map(|text| self.units.read_height("height_m", &text)).transpose()?,
            body_mass_kg: given(&self.body_mass_kg)
                .map(|text| self.units.read_mass("body_mass_kg", &text))
                .transpose()?,
        })
    }
}

fn number(field: &str, text: &str) -> Result<f64, Error> {
    f64::from_str(text.trim()).map_err(|_| Error::invalid(field, text, "a number"))
}

#[derive(Template)]
#[template(path = "reference_gaits.html")]
struct ReferenceGaitsPage {
    units: Units,
    matches: Vec<ReferenceGaitMatch>,
    subjects: Vec<Subject>,
    /// The subject from whom distances are measured.
    nearest_to: Option<Subject>,
    may_run: bool,
    fields: ReferenceGaitFields,
    refused: Option<FieldError>,
    /// The preview of the recording in the form.
    preview: Option<RecordingPreview>,
}

impl ReferenceGaitsPage {
    async fn read(db: &mut Connection, units: Units, subject: Option<SubjectId>, may_run: bool) -> Result<Self, Error> {
        let nearest_to = match subject {
            Some(id) => Some(subjects::get(db, id).await?),
            None => None,
        };
        let matches = if let Some(subject) = &nearest_to {
            nearest_reference::matches(db, &subject.body()).await?
        } else {
            let all = reference_gaits::all(db).await?.into_iter();
            all.map(|reference_gait| ReferenceGaitMatch { reference_gait, distance: None }).collect()
        };
        let subjects = subjects::consenting(db).await?;
        Ok(Self {
            units,
            matches,
            subjects,
            nearest_to,
            may_run,
            fields: ReferenceGaitFields::default(),
            refused: None,
            preview: None,
        })
    }

    fn refuses(&self, field: &str) -> bool {
        self.refused.as_ref().is_some_and(|refused| refused.field == field)
    }

    fn is_nearest_to(&self, subject: &Subject) -> bool {
        self.nearest_to.as_ref().is_some_and(|chosen| chosen.id == subject.id)
    }
}

/// The subject to match.
#[derive(Debug, Deserialize)]
pub(super) struct To {
    #[serde(default)]
    subject: Option<SubjectId>,
}

/// `GET /reference-gaits`.
pub(super) async fn list(
    authorized: Authorized<Read>,
    State(app): State<AppState>,
    units: Units,
    Params(to): Params<To>,
) -> PageResult {
    let may_run = authorized.caller.may(Run::NEEDED);
    page(&ReferenceGaitsPage::read(&mut *app.read().await?, units, to.subject, may_run).await?)
}

/// `POST /reference-gaits`.
pub(super) async fn import(
    authorized: Authorized<Run>,
    State(mut app): State<AppState>,
    units: Units,
    Submitted(fields): Submitted<ReferenceGaitFields>,
) -> Result<Response, PageError> {
    if fields.button == "preview" {
        let preview = match fields.read() {
            Ok(new) => {
                let of = move |_: &OnPool| Ok(RecordingPreview::of_reference(&new.preview()?));
                app.compute(of).await.map_err(Error::from)?
            }
            Err(error) => Err(error),
        };
        let (status, preview, refused) = match preview {
            Ok(preview) => (StatusCode::OK, Some(preview), None),
            Err(Error::Invalid(refused)) => {
                (StatusCode::UNPROCESSABLE_ENTITY, None, Some(form_errors::with_label(*refused)))
            }
            Err(other) => return Err(other.into()),
        };
        let empty = ReferenceGaitsPage::read(&mut *app.read().await?, units, None, true).await?;
        let form = page(&ReferenceGaitsPage { fields, refused, preview, ..empty })?;
        return Ok((status, form).into_response());
    }
    let definition = match fields.read() {
        Ok(new) => new.definition_on_pool(app.store_mut()).await,
        Err(error) => Err(error),
    };
    let definition = match definition {
        Ok(definition) => definition,
        Err(Error::Invalid(refused)) => {
            let empty = ReferenceGaitsPage::read(&mut *app.read().await?, units, None, true).await?;
            let form = page(&ReferenceGaitsPage { fields, refused: Some(form_errors::with_label(*refused)), ..empty })?;
            return Ok((StatusCode::UNPROCESSABLE_ENTITY, form).into_response());
        }
        Err(other) => return Err(other.into()),
    };
    let mut writer = app.write().await?;
    let (added, _) = reference_import::add(&mut writer, &authorized.caller.actor, &definition).await?;
    commit(writer).await?;
    Ok(Redirect::to(&format!("/reference-gaits/{}", added.id)).into_response())
}

#[derive(Template)]
#[template(path = "reference_gait.html")]
struct ReferenceGaitPage {
    units: Units,
    reference: ReferenceGait,
    /// Curves that differ from the built-in reference gait.
    warning: Option<String>,
    steps: Vec<String>,
    charts: Vec<PageChart>,
}

impl ReferenceGaitPage {
    fn file_name(&self) -> String {
        format::file_name(&self.reference.name)
    }
}

/// `GET /reference-gaits/{id}`.
pub(super) async fn get(
    _: Authorized<Read>,
    State(app): State<AppState>,
    units: Units,
    Id(id, _): Id<ReferenceGaitId, Read>,
) -> PageResult {
    let reference = reference_gaits::get(&mut *app.read().await?, id).await?;
    page(&ReferenceGaitPage {
        units,
        warning: reference.definition.warning().map_err(Error::from)?,
        steps: reference.definition.provenance.lines().map(str::to_owned).collect(),
        charts: reference_figures::of_reference(&reference.definition)
            .iter()
            .map(|figure| PageChart::of(figure, &format!("/api/v1/reference-gaits/{id}/figures"), ""))
            .collect(),
        reference,
    })
}
