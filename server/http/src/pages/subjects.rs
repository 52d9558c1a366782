//! The list of subjects, with the form that adds one.

use crate::AppState;
use crate::authorization::Authorized;
use crate::extractors::{Form, Params};
use crate::page_error::{PageError, PageResult, page};
use crate::refused_fields::{FieldLabels, FormCheck, RefusedFields, TypedForm};
use crate::units::Units;
use askama::Template;
use axum::extract::State;
use axum::response::{IntoResponse, Redirect, Response};
use gaitwright_service::access::{Read, RequiredRight, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::subject::{self, NewSubject};
use gaitwright_store::consents::{self, ConsentKind};
use gaitwright_store::subjects::{self, SubjectRow};
use gaitwright_store::{StudyId, SubjectId, commit};
use serde::Deserialize;
use std::ops::ControlFlow;

/// How many subjects the list shows.
const PAGE: u32 = 100;

#[derive(Template)]
#[template(path = "subjects.html")]
struct SubjectsPage {
    units: Units,
    subjects: Vec<ListedSubject>,
    /// The last subject of this page, if more follow.
    next: Option<SubjectId>,
    may_run: bool,
    fields: SubjectFields,
    refused: RefusedFields,
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

impl TypedForm for SubjectFields {
    const LABELS: FieldLabels =
        &[("pseudonym", "Pseudonym"), ("height_m", "Height"), ("body_mass_kg", "Body mass"), ("notes", "Notes")];

    fn labels(&self) -> Vec<(String, String)> {
        self.units.with_headings(Self::LABELS)
    }

    fn repair(&mut self, field: &str) -> bool {
        match field {
            "pseudonym" => self.pseudonym = unused_pseudonym(),
            "height_m" => "1.75 m".clone_into(&mut self.height_m),
            "body_mass_kg" => "70 kg".clone_into(&mut self.body_mass_kg),
            "notes" => self.notes.clear(),
            _ => return false,
        }
        true
    }

    /// The only possible conflict is a pseudonym that is taken.
    fn field_in_conflict(&self) -> Option<&'static str> {
        Some("pseudonym")
    }
}

/// A pseudonym that nobody uses: the letters of a fresh identifier.
pub(super) fn unused_pseudonym() -> String {
    let hex = StudyId::fresh().to_string();
    let letter = |c: char| char::from_digit(c.to_digit(16)? + 10, 36);
    hex.chars().filter_map(letter).collect()
}

struct ListedSubject {
    subject: SubjectRow,
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
    show_list(
        &app,
        units,
        before,
        authorized.caller.may(Run::NEEDED),
        SubjectFields::default(),
        RefusedFields::default(),
    )
    .await
}

/// `POST /subjects`: adds one, before it has a study.
pub(super) async fn add(
    authorized: Authorized<Run>,
    State(app): State<AppState>,
    units: Units,
    Form(fields): Form<SubjectFields>,
) -> Result<Response, PageError> {
    let mut check = FormCheck::new(&fields);
    let mut writer = app.write().await?;
    let new = loop {
        let read = async {
            let new = check.form().read()?;
            subject::checked(&mut writer, &new).await?;
            Ok(new)
        }
        .await;
        if let ControlFlow::Break(new) = check.step(read)? {
            break new;
        }
    };
    let refused = check.into_refused();
    if let Some(new) = new.filter(|_| refused.is_empty()) {
        let subject = subject::add(&mut writer, &authorized.caller.actor, &new).await?;
        commit(writer).await?;
        return Ok(Redirect::to(&format!("/subjects/{}", subject.id)).into_response());
    }
    drop(writer);
    Ok((refused.status(), show_list(&app, units, None, true, fields, refused).await?).into_response())
}

async fn show_list(
    app: &AppState,
    units: Units,
    before: Option<SubjectId>,
    may_run: bool,
    fields: SubjectFields,
    refused: RefusedFields,
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
        rows.push(ListedSubject {
            subject,
            consent: last.map_or("not on record", |last| last.kind.as_str()),
            withdrawn,
        });
    }
    page(&SubjectsPage { units, subjects: rows, next, may_run, fields, refused })
}
