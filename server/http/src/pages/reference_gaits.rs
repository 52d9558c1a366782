//! The pages of reference gaits: the list with the import form, and each one with its curves.

use super::angle_columns_form::{AngleColumnFields, ColumnsPage, OF_REFERENCE, USED_BY_REFERENCE, unit_word};
use super::form_numbers;
use super::page_chart::{PageChart, shared_legend};
use super::recording_preview::RecordingPreview;
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::extractors::{Form as Submitted, Params};
use crate::figures::reference_figures;
use crate::format;
use crate::page_error::{PageError, PageResult, page};
use crate::refused_fields::{FieldLabels, FormCheck, RefusedFields, TypedForm};
use crate::units::Units;
use askama::Template;
use axum::extract::State;
use axum::response::{IntoResponse, Redirect, Response};
use gaitwright_compute::OnPool;
use gaitwright_service::access::{Read, RequiredRight, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::lab::check_not_c3d;
use gaitwright_service::studies::nearest_reference::{self, ReferenceGaitMatch};
use gaitwright_service::studies::reference_import::{self, JointAngleFormat, NewReferenceGait, Strikes, Unit};
use gaitwright_store::reference_gaits::{self, ReferenceGaitRow};
use gaitwright_store::subjects::{self, SubjectRow};
use gaitwright_store::{Connection, ReferenceGaitId, SubjectId, commit};
use serde::Deserialize;
use std::str::FromStr;

/// The fields as typed, to show a refused form again.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default)]
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
    /// Shown beside the preview, not stored.
    file_name: String,
    /// `preview` or `columns`, or else an import.
    button: String,
    #[serde(flatten)]
    columns: AngleColumnFields,
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
            columns: self.columns.read()?,
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

impl ReferenceGaitFields {
    /// The recording, with everything checked that needs no look into it.
    fn read_and_check(&self) -> Result<NewReferenceGait, Error> {
        let new = self.read()?;
        check_not_c3d(&self.file_name)?;
        new.check_person(!self.imports())?;
        Ok(new)
    }
}

impl ReferenceGaitFields {
    /// Whether the form asks for the import.
    fn imports(&self) -> bool {
        !["preview", "columns"].contains(&self.button.as_str())
    }

    /// The name of the file, as the page shows it.
    fn shown_file_name(&self) -> String {
        form_numbers::file_name(&self.file_name).unwrap_or_default()
    }
}

impl TypedForm for ReferenceGaitFields {
    const LABELS: FieldLabels = &[
        ("name", "Name"),
        ("height_m", "Height of the measured person"),
        ("body_mass_kg", "Body mass"),
        ("recording", "File contents"),
        ("heel_strikes_s", "Times of right heel strikes, s"),
        ("unit", "Unit of the angles"),
        ("columns", "Columns of the angles"),
        ("force_column", "Column of the vertical force under the right foot"),
        ("forces", "Contents of the force file"),
    ];

    fn labels(&self) -> Vec<(String, String)> {
        self.units.with_headings(Self::LABELS)
    }

    fn repair(&mut self, field: &str) -> bool {
        match field {
            "name" => "a name".clone_into(&mut self.name),
            "height_m" => self.height_m.clear(),
            "body_mass_kg" => self.body_mass_kg.clear(),
            "heel_strikes_s" => self.heel_strikes_s.clear(),
            "unit" => self.unit.clear(),
            "columns" => self.columns = AngleColumnFields::default(),
            _ => return false,
        }
        true
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
    subjects: Vec<SubjectRow>,
    /// The subject from whom distances are measured.
    nearest_to: Option<SubjectRow>,
    may_run: bool,
    fields: ReferenceGaitFields,
    refused: RefusedFields,
    /// The columns of the recording in the form, if they are chosen.
    columns: Option<ColumnsPage>,
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
            refused: RefusedFields::default(),
            columns: None,
            preview: None,
        })
    }

    fn is_nearest_to(&self, subject: &SubjectRow) -> bool {
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
    let mut check = FormCheck::new(&fields);
    let new = check.read(ReferenceGaitFields::read_and_check)?;
    let (mut fields, mut columns, mut preview) = (fields, None, None);
    if let Some(new) = new {
        if fields.imports() {
            match new.clone().definition_on_pool(app.store_mut()).await {
                Ok(definition) if check.is_clean() => {
                    let mut writer = app.write().await?;
                    let (added, _) = reference_import::add(&mut writer, &authorized.caller.actor, &definition).await?;
                    commit(writer).await?;
                    return Ok(Redirect::to(&format!("/reference-gaits/{}", added.id)).into_response());
                }
                Ok(_) => {}
                Err(error) => check.refuse(error).map(drop)?,
            }
        }
        let (are_chosen, asks, imports) =
            (fields.columns.are_asked_for(), fields.button == "columns", fields.imports());
        match app.compute(move |_: &OnPool| shown(new, are_chosen, asks, imports)).await.map_err(Error::from)? {
            Ok(found) => {
                if let Some((page, unit)) = found.columns {
                    unit.clone_into(&mut fields.unit);
                    columns = Some(page);
                }
                preview = found.preview;
                if let Some(error) = found.refused {
                    check.refuse(error)?;
                }
            }
            Err(error) => check.refuse(error).map(drop)?,
        }
    }
    let refused = check.into_refused();
    let status = refused.status();
    let empty = ReferenceGaitsPage::read(&mut *app.read().await?, units, None, true).await?;
    Ok((status, page(&ReferenceGaitsPage { fields, refused, columns, preview, ..empty })?).into_response())
}

/// A recording as the page shows it.
struct ShownRecording {
    /// The columns and their unit, if they are chosen.
    columns: Option<(ColumnsPage, &'static str)>,
    preview: Option<RecordingPreview>,
    /// Why there is no preview although the columns are chosen.
    refused: Option<Error>,
}

/// Reads and draws a recording. Columns are chosen if the form asked for them, or if the file does not have the names of its
/// format; the preview follows once they are. A refused import without a choice of columns shows the form alone.
fn shown(mut new: NewReferenceGait, are_chosen: bool, asks: bool, imports: bool) -> Result<ShownRecording, Error> {
    let preview_of = |new: &NewReferenceGait| {
        Ok::<_, Error>(RecordingPreview::of_reference(&new.preview()?, ReferenceGaitFields::LABELS))
    };
    if !are_chosen && !asks && !new.needs_columns() {
        let preview = if imports { None } else { Some(preview_of(&new)?) };
        return Ok(ShownRecording { columns: None, preview, refused: None });
    }
    let choice = new.column_choice()?;
    let columns = (ColumnsPage::new(&choice, &USED_BY_REFERENCE, &OF_REFERENCE)?, unit_word(choice.unit));
    let mut found = ShownRecording { columns: Some(columns), preview: None, refused: None };
    if are_chosen && !asks {
        new.columns = choice.chosen;
        new.unit = Some(choice.unit.into());
        match preview_of(&new) {
            Ok(preview) => found.preview = Some(preview),
            Err(error) => found.refused = Some(error),
        }
    }
    Ok(found)
}

#[derive(Template)]
#[template(path = "reference_gait.html")]
struct ReferenceGaitPage {
    units: Units,
    reference: ReferenceGaitRow,
    /// Curves that differ from the built-in reference gait.
    warning: Option<String>,
    steps: Vec<String>,
    charts: Vec<PageChart>,
    /// The legend of the charts, and what they show.
    legend: Vec<(String, String)>,
    hint: String,
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
    let figures = reference_figures::of_reference(&reference.definition);
    let drawn = |figure| PageChart::of(figure, &format!("/api/v1/reference-gaits/{id}/figures"), "");
    let mut charts: Vec<PageChart> = figures.iter().map(drawn).collect();
    page(&ReferenceGaitPage {
        units,
        warning: reference.definition.warning().map_err(Error::from)?,
        steps: reference.definition.provenance.lines().map(str::to_owned).collect(),
        legend: shared_legend(&mut charts),
        charts,
        hint: reference_figures::in_words(&reference.definition),
        reference,
    })
}
