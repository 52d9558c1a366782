//! The form for a new study.

use super::error::{Page, PageError, page};
use crate::access::{Caller, Run};
use crate::error::{Error, FieldError};
use crate::http::AppState;
use crate::http::extract::Form;
use crate::http::may::May;
use crate::store::studies::FeedbackMode;
use crate::store::subjects::{self, Subject};
use crate::store::{StudyId, SubjectId, commit};
use crate::studies::person::{self, NewSubject};
use crate::studies::plan::{self, NewStudy};
use askama::Template;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Redirect, Response};
use serde::Deserialize;
use std::str::FromStr;

/// The fields as typed, so that a refused form comes back as it was.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Fields {
    #[serde(default)]
    name: String,
    subject: String,
    #[serde(default)]
    pseudonym: String,
    #[serde(default)]
    height_m: String,
    #[serde(default)]
    body_mass_kg: String,
    muscles: String,
    feedback_mode: String,
    trial_budget: String,
    parallel_trials: String,
    seed: String,
}

impl Default for Fields {
    fn default() -> Self {
        let text = str::to_owned;
        Self {
            name: String::new(),
            subject: String::new(),
            pseudonym: String::new(),
            height_m: String::new(),
            body_mass_kg: String::new(),
            muscles: text("on"),
            feedback_mode: text("automatic"),
            trial_budget: text("15"),
            parallel_trials: text("1"),
            seed: text("1"),
        }
    }
}

/// The subject option that means: the person described below it.
const NEW_SUBJECT: &str = "new";

#[derive(Template)]
#[template(path = "study_new.html")]
struct NewStudyPage {
    subjects: Vec<Subject>,
    fields: Fields,
    refused: Option<FieldError>,
}

impl NewStudyPage {
    fn selected(&self, subject: &Subject) -> bool {
        self.fields.subject == subject.id.to_string()
            || (self.fields.subject.is_empty() && subject.pseudonym == "paper-1")
    }

    fn refuses(&self, field: &str) -> bool {
        self.refused.as_ref().is_some_and(|refused| refused.field == field)
    }
}

/// `GET /studies/new`.
pub(super) async fn get(_: May<Run>, State(app): State<AppState>) -> Page {
    let subjects = subjects::all(&mut *app.read().await?).await?;
    page(&NewStudyPage { subjects, fields: Fields::default(), refused: None })
}

/// `POST /studies/new`.
pub(super) async fn post(
    may: May<Run>,
    State(app): State<AppState>,
    Form(fields): Form<Fields>,
) -> Result<Response, PageError> {
    let refused = match create(&app, &may.caller, &fields).await {
        Ok(id) => return Ok(Redirect::to(&format!("/studies/{id}")).into_response()),
        Err(Error::Invalid(field)) => *field,
        Err(Error::Conflict(reason)) => FieldError {
            field: "pseudonym".to_owned(),
            value: fields.pseudonym.clone().into(),
            allowed: "another pseudonym".to_owned(),
            message: reason,
        },
        Err(other) => return Err(other.into()),
    };
    let subjects = subjects::all(&mut *app.read().await?).await?;
    let form = page(&NewStudyPage { subjects, fields, refused: Some(refused) })?;
    Ok((StatusCode::UNPROCESSABLE_ENTITY, form).into_response())
}

async fn create(app: &AppState, caller: &Caller, fields: &Fields) -> Result<StudyId, Error> {
    let mut writer = app.write().await?;
    let subject = if fields.subject == NEW_SUBJECT {
        let new = NewSubject {
            pseudonym: fields.pseudonym.clone(),
            height_m: number("height_m", &fields.height_m, "a number of metres")?,
            body_mass_kg: number("body_mass_kg", &fields.body_mass_kg, "a number of kilograms")?,
            notes: String::new(),
        };
        person::add(&mut writer, &caller.actor, &new).await?.id
    } else {
        nothing_described(fields)?;
        number::<SubjectId>("subject", &fields.subject, "a subject of the list")?
    };
    let new = NewStudy {
        name: Some(fields.name.clone()),
        muscles: match fields.muscles.as_str() {
            "on" => true,
            "off" => false,
            other => return Err(Error::invalid("muscles", other, "on, off")),
        },
        feedback_mode: FeedbackMode::from_str(&fields.feedback_mode)
            .map_err(|_| Error::invalid("feedback_mode", fields.feedback_mode.as_str(), "automatic, human, mixed"))?,
        trial_budget: number("trial_budget", &fields.trial_budget, "1 to 10000")?,
        parallel_trials: number("parallel_trials", &fields.parallel_trials, "1 to 64")?,
        seed: number("seed", &fields.seed, &format!("0 to {}", plan::LARGEST_SEED))?,
        ..NewStudy::of(subject)
    };
    let study = plan::create(&mut writer, &caller.actor, new).await?;
    commit(writer).await?;
    app.director.changed();
    Ok(study.id)
}

/// A person who is described but not chosen would be left out without a word.
fn nothing_described(fields: &Fields) -> Result<(), Error> {
    for (field, text) in
        [("pseudonym", &fields.pseudonym), ("height_m", &fields.height_m), ("body_mass_kg", &fields.body_mass_kg)]
    {
        if !text.trim().is_empty() {
            let allowed = "nothing, as a subject of the list is chosen; or choose \"A new subject\"";
            return Err(Error::invalid(field, text.as_str(), allowed));
        }
    }
    Ok(())
}

fn number<T: FromStr>(field: &str, text: &str, allowed: &str) -> Result<T, Error> {
    text.trim().parse().map_err(|_| Error::invalid(field, text, allowed))
}
