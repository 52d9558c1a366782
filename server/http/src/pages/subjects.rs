//! The list of subjects, with the form that adds one.

use crate::AppState;
use crate::authorization::Authorized;
use crate::extractors::{Form, Params};
use crate::form_errors;
use crate::page_error::{PageError, PageResult, page};
use crate::problem_details::Problem;
use crate::units::Units;
use askama::Template;
use axum::extract::State;
use axum::response::{IntoResponse, Redirect, Response};
use gaitwright_service::access::{Read, RequiredRight, Run};
use gaitwright_service::error::{Error, FieldError};
use gaitwright_service::studies::subject::{self, NewSubject};
use gaitwright_store::consents::{self, ConsentKind};
use gaitwright_store::subjects::{self, Subject};
use gaitwright_store::{SubjectId, commit};
use serde::Deserialize;

/// How many subjects the list shows.
const PAGE: u32 = 100;

#[derive(Template)]
#[template(path = "subjects.html")]
struct SubjectsPage {
    units: Units,
    subjects: Vec<SubjectRow>,
    /// The last subject of this page, if more follow.
    next: Option<SubjectId>,
    may_run: bool,
    fields: SubjectFields,
    /// Every refused field.
    refused: Vec<FieldError>,
}

impl SubjectsPage {
    /// The attributes that mark a refused field and point to the reason. The first one gets the focus.
    fn invalid(&self, field: &str) -> &'static str {
        match self.refused.iter().position(|refused| refused.field == field) {
            Some(0) => " aria-invalid=\"true\" aria-describedby=\"refused\" autofocus",
            Some(_) => " aria-invalid=\"true\" aria-describedby=\"refused\"",
            None => "",
        }
    }
}

/// The fields as typed, to show a refused form again.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct SubjectFields {
    pseudonym: String,
    height_m: String,
    body_mass_kg: String,
    /// The units in which the form was shown.
    units: Units,
    notes: String,
}

impl SubjectFields {
    fn read(&self) -> Result<NewSubject, Error> {
        let (height_m, body_mass_kg) = self.units.read_height_and_mass(&self.height_m, &self.body_mass_kg)?;
        Ok(NewSubject { pseudonym: self.pseudonym.clone(), height_m, body_mass_kg, notes: self.notes.clone() })
    }
}

/// Every field of a new subject that would be refused, in the order of the form.
fn faults(fields: &SubjectFields) -> Vec<FieldError> {
    let mut repaired = fields.clone();
    let mut found: Vec<FieldError> = Vec::new();
    // Each field is refused once, and an acceptable value takes its place.
    while let Err(Error::Invalid(fault)) = repaired.read().and_then(|new| subject::check_new(&new)) {
        if found.iter().any(|known| known.field == fault.field) {
            break;
        }
        match fault.field.as_str() {
            "pseudonym" => "S01".clone_into(&mut repaired.pseudonym),
            "height_m" => "1.75 m".clone_into(&mut repaired.height_m),
            "body_mass_kg" => "70 kg".clone_into(&mut repaired.body_mass_kg),
            _ => repaired.notes.clear(),
        }
        found.push(form_errors::with_label(*fault));
    }
    let place = |fault: &FieldError| ["pseudonym", "height_m", "body_mass_kg"].iter().position(|f| *f == fault.field);
    found.sort_by_key(|fault| place(fault).unwrap_or(usize::MAX));
    found
}

struct SubjectRow {
    subject: Subject,
    consent: &'static str,
    withdrawn: bool,
}

/// Which subjects to show.
#[derive(Debug, Deserialize)]
pub(super) struct SubjectsBefore {
    before: Option<SubjectId>,
}

/// `GET /subjects`.
pub(super) async fn list(
    authorized: Authorized<Read>,
    State(app): State<AppState>,
    units: Units,
    Params(SubjectsBefore { before }): Params<SubjectsBefore>,
) -> PageResult {
    show_list(&app, units, before, authorized.caller.may(Run::NEEDED), SubjectFields::default(), Vec::new()).await
}

/// `POST /subjects`: adds one, before it has a study.
pub(super) async fn add(
    authorized: Authorized<Run>,
    State(app): State<AppState>,
    units: Units,
    Form(fields): Form<SubjectFields>,
) -> Result<Response, PageError> {
    let added = async {
        let new = fields.read()?;
        let mut writer = app.write().await?;
        let subject = subject::add(&mut writer, &authorized.caller.actor, &new).await?;
        commit(writer).await?;
        Ok(subject.id)
    };
    let error = match added.await {
        Ok(id) => return Ok(Redirect::to(&format!("/subjects/{id}")).into_response()),
        Err(error @ (Error::Invalid(_) | Error::Conflict(_))) => error,
        Err(other) => return Err(other.into()),
    };
    let status = Problem::from(&error).status();
    let refused = match error {
        Error::Invalid(_) => faults(&fields),
        // The only possible conflict is a pseudonym that is taken.
        other => vec![FieldError::in_words("pseudonym", &other.to_string())],
    };
    Ok((status, show_list(&app, units, None, true, fields, refused).await?).into_response())
}

async fn show_list(
    app: &AppState,
    units: Units,
    before: Option<SubjectId>,
    may_run: bool,
    fields: SubjectFields,
    refused: Vec<FieldError>,
) -> PageResult {
    let mut reader = app.read().await?;
    let mut found = subjects::page(&mut reader, before, PAGE + 1).await?;
    let more = found.len() > PAGE as usize;
    found.truncate(PAGE as usize);
    let next = found.last().filter(|_| more).map(|subject| subject.id);
    let mut rows = Vec::with_capacity(found.len());
    for subject in found {
        let consents = consents::of_subject(&mut reader, subject.id).await?;
        let last = consents.last();
        let withdrawn = last.is_some_and(|last| last.kind == ConsentKind::Withdrawn);
        rows.push(SubjectRow { subject, consent: last.map_or("not on record", |last| last.kind.as_str()), withdrawn });
    }
    page(&SubjectsPage { units, subjects: rows, next, may_run, fields, refused })
}
