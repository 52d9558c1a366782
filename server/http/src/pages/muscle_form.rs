//! The form for measured muscle parameters of a subject, which override the default ones.

use super::saved::{Saved, confirmed};
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::extractors::{Form, FormFields, Params};
use crate::form_errors;
use crate::format;
use crate::page_error::{PageError, PageResult, page};
use crate::refused_fields::{FieldLabels, FormCheck, RefusedFields, TypedForm};
use crate::visible::Visible;
use askama::Template;
use axum::extract::State;
use axum::response::{IntoResponse, Redirect, Response};
use gait_optimizer::muscle::{MuscleField, MuscleOverride, MuscleParameters};
use gaitwright_service::access::{Read, RequiredRight, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::subject;
use gaitwright_store::subjects::{self, SubjectRow};
use gaitwright_store::{SubjectId, commit};
use serde_json::{Map, Value, json};

/// Names of the muscles.
const KINDS: [(&str, &str); 7] = [
    ("ham", "hamstrings"),
    ("glu", "gluteus"),
    ("hfl", "hip flexors"),
    ("gas", "gastrocnemius"),
    ("vas", "vasti"),
    ("sol", "soleus"),
    ("ta", "tibialis anterior"),
];

#[derive(Template)]
#[template(path = "muscles.html")]
struct MusclesPage {
    subject: SubjectRow,
    columns: [MuscleField; 7],
    rows: Vec<MuscleRow>,
    scaled_to_body: bool,
    may_run: bool,
    saved: bool,
    refused: RefusedFields,
}

struct MuscleRow {
    name: &'static str,
    cells: Vec<ParameterCell>,
}

/// One parameter of a muscle.
struct ParameterCell {
    /// `sol_max_force_n`.
    field: String,
    label: String,
    entry: String,
    /// The value of an empty field; `None` if the muscle does not span that joint.
    otherwise: Option<String>,
}

/// Shows the values in force, or the entries of a refused form.
fn shown(
    subject: SubjectRow,
    muscles: &MuscleParameters,
    may_run: bool,
    refusal: Option<(&FormFields, RefusedFields)>,
) -> MusclesPage {
    let (fields, refused) = refusal.map(|(fields, refused)| (Some(fields), refused)).unwrap_or_default();
    let scaled_to_body = fields.map_or(muscles.scaled_to_body, |fields| fields.contains_key("scaled_to_body"));
    let unchanged = MuscleParameters { scaled_to_body, ..MuscleParameters::default() };
    let body = subject.body();
    let row = |&(kind, name): &(&str, &'static str)| {
        let otherwise = unchanged.muscle_of_kind(&body, kind);
        let given = muscles.overrides().into_iter().find(|(known, _)| *known == kind).map(|(_, given)| *given);
        let cell = |column: &MuscleField| {
            let field = format!("{kind}_{}", column.name);
            let kept = given.as_ref().and_then(column.given).map(|value| value.to_string());
            ParameterCell {
                label: label(name, column),
                entry: fields.map_or(kept, |fields| fields.get(&field).cloned()).unwrap_or_default(),
                otherwise: otherwise.as_ref().and_then(column.value).map(format::number),
                field,
            }
        };
        MuscleRow { name, cells: MuscleOverride::FIELDS.iter().map(cell).collect() }
    };
    let rows: Vec<MuscleRow> = KINDS.iter().map(row).collect();
    MusclesPage { subject, columns: MuscleOverride::FIELDS, rows, scaled_to_body, may_run, saved: false, refused }
}

fn label(muscle: &str, column: &MuscleField) -> String {
    format!("{muscle}: {}", column.meaning)
}

/// The form as typed.
#[derive(Debug, Clone)]
struct TypedMuscles(FormFields);

impl TypedForm for TypedMuscles {
    const LABELS: FieldLabels = &[];

    fn labels(&self) -> Vec<(String, String)> {
        let of_muscle = |&(kind, name): &(&str, &str)| {
            MuscleOverride::FIELDS.map(|column| (format!("{kind}_{}", column.name), label(name, &column)))
        };
        KINDS.iter().flat_map(of_muscle).collect()
    }

    fn repair(&mut self, field: &str) -> bool {
        self.0.remove(field).is_some()
    }

    /// `muscles.sol.max_force_n` is the field `sol_max_force_n`.
    fn field_of(&self, refused: &str) -> String {
        refused.trim_start_matches("muscles.").replacen('.', "_", 1)
    }
}

/// `GET /subjects/{id}/muscles`.
pub(super) async fn get(
    authorized: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<SubjectId, Read>,
    Params(Saved { saved }): Params<Saved>,
) -> PageResult {
    let mut reader = app.read().await?;
    let subject = subjects::get(&mut reader, id).await?;
    let muscles = subjects::muscles(&mut reader, id).await?;
    drop(reader);
    page(&MusclesPage { saved, ..shown(subject, &muscles, authorized.caller.may(Run::NEEDED), None) })
}

/// `POST /subjects/{id}/muscles`.
pub(super) async fn post(
    authorized: Authorized<Run>,
    State(app): State<AppState>,
    Id(id, _): Id<SubjectId, Run>,
    Form(fields): Form<FormFields>,
) -> Result<Response, PageError> {
    let mut writer = app.write().await?;
    let subject = subjects::get(&mut writer, id).await?;
    let before = subjects::muscles(&mut writer, id).await?;
    let mut check = FormCheck::new(&TypedMuscles(fields));
    let typed = check.form().0.clone();
    let muscles = check.read(|TypedMuscles(fields)| {
        let muscles = read(fields)?;
        muscles.validate()?;
        Ok(muscles)
    })?;
    let refused = check.into_refused();
    if let Some(muscles) = muscles.filter(|_| refused.is_empty()) {
        subject::set_muscles(&mut writer, &authorized.caller.actor, id, &muscles).await?;
        commit(writer).await?;
        return Ok(Redirect::to(&confirmed(&format!("/subjects/{id}/muscles"))).into_response());
    }
    drop(writer);
    let status = refused.status();
    Ok((status, page(&shown(subject, &before, true, Some((&typed, refused))))?).into_response())
}

/// The entries as a document, without empty fields.
fn read(fields: &FormFields) -> Result<MuscleParameters, Error> {
    let mut document = Map::new();
    for (field, text) in fields.iter().filter(|(_, text)| !text.trim().is_empty()) {
        if field == "scaled_to_body" {
            document.insert(field.clone(), json!(true));
            continue;
        }
        let part = field.split_once('_').filter(|(kind, name)| {
            KINDS.iter().any(|(known, _)| known == kind) && MuscleOverride::FIELDS.iter().any(|f| f.name == *name)
        });
        let (kind, name) = part.ok_or_else(|| form_errors::unknown_field(field))?;
        let value: f64 = text.trim().parse().map_err(|_| Error::invalid(field, text.as_str(), "a number, or empty"))?;
        let of_kind = document.entry(kind).or_insert_with(|| json!({}));
        if let Value::Object(of_kind) = of_kind {
            of_kind.insert(name.to_owned(), json!(value));
        }
    }
    serde_json::from_value(Value::Object(document)).map_err(|e| Error::Internal(e.to_string()))
}
