//! The page for the name, tags and notes of a study, which also archives and clones it.

use super::saved::{Saved, confirmed};
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::extractors::{Form, Params};
use crate::form_errors;
use crate::page_error::{PageError, PageResult, page};
use crate::problem_details::Problem;
use crate::visible::Visible;
use askama::Template;
use axum::extract::State;
use axum::response::{IntoResponse, Redirect, Response};
use gaitwright_service::access::{Caller, Read, RequiredRight, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::study_change::{self, StudyChange};
use gaitwright_service::studies::study_plan;
use gaitwright_store::studies::{Study, StudyState};
use gaitwright_store::{StudyId, Writer, commit, studies};
use serde::Deserialize;

/// Labels of the fields.
const LABELS: &[(&str, &str)] = &[("name", "Name"), ("tags", "Tags"), ("notes", "Notes")];

#[derive(Template)]
#[template(path = "study_details.html")]
struct DetailsPage {
    study: Study,
    fields: StudyDetailsFields,
    may_run: bool,
    saved: bool,
    refused: Option<String>,
}

impl DetailsPage {
    /// Whether the study can be archived now.
    fn may_be_archived(&self) -> bool {
        self.study.archived_at.is_none() && (self.study.state.has_ended() || self.study.state == StudyState::NotStarted)
    }
}

/// The fields as typed, to show a refused form again.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StudyDetailsFields {
    button: String,
    #[serde(default)]
    name: String,
    /// Separated by commas.
    #[serde(default)]
    tags: String,
    #[serde(default)]
    notes: String,
}

impl StudyDetailsFields {
    fn of(study: &Study) -> Self {
        Self {
            button: String::new(),
            name: study.plan.name.clone(),
            tags: study.tags.join(", "),
            notes: study.notes.clone(),
        }
    }

    fn change(&self) -> Result<StudyChange, Error> {
        let tags = self.tags.split(',').map(str::trim).filter(|tag| !tag.is_empty()).map(str::to_owned);
        Ok(match self.button.as_str() {
            "save" => StudyChange {
                name: Some(self.name.clone()),
                tags: Some(tags.collect()),
                // A browser sends line ends as CR LF.
                notes: Some(self.notes.replace("\r\n", "\n")),
                ..StudyChange::default()
            },
            "archive" => StudyChange { archived: Some(true), ..StudyChange::default() },
            "restore" => StudyChange { archived: Some(false), ..StudyChange::default() },
            other => return Err(Error::invalid("button", other, "save, archive or restore")),
        })
    }
}

/// `GET /studies/{id}/details`.
pub(super) async fn get(
    authorized: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
    Params(Saved { saved }): Params<Saved>,
) -> PageResult {
    show(&app, &authorized.caller, id, saved, None).await
}

async fn show(
    app: &AppState,
    caller: &Caller,
    id: StudyId,
    saved: bool,
    refusal: Option<(Option<StudyDetailsFields>, String)>,
) -> PageResult {
    let (typed, refused) = refusal.map_or((None, None), |(typed, refused)| (typed, Some(refused)));
    let study = studies::get(&mut *app.read().await?, id).await?;
    let fields = typed.unwrap_or_else(|| StudyDetailsFields::of(&study));
    page(&DetailsPage { study, fields, may_run: caller.may(Run::NEEDED), saved, refused })
}

/// `POST /studies/{id}/details`.
pub(super) async fn post(
    authorized: Authorized<Run>,
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    Form(fields): Form<StudyDetailsFields>,
) -> Result<Response, PageError> {
    let mut writer = app.write().await?;
    match change(&mut writer, &authorized.caller, id, &fields).await {
        Ok(()) => {
            commit(writer).await?;
            app.scheduler.changed();
            let to =
                if fields.button == "archive" { "/".to_owned() } else { confirmed(&format!("/studies/{id}/details")) };
            Ok(Redirect::to(&to).into_response())
        }
        Err(error @ (Error::Invalid(_) | Error::Conflict(_))) => {
            drop(writer);
            let status = Problem::from(&error).status();
            let refused = form_errors::of_form(&error, LABELS);
            let typed = Some(fields).filter(|fields| fields.button == "save");
            Ok((status, show(&app, &authorized.caller, id, false, Some((typed, refused))).await?).into_response())
        }
        Err(error) => Err(error.into()),
    }
}

async fn change(writer: &mut Writer, caller: &Caller, id: StudyId, fields: &StudyDetailsFields) -> Result<(), Error> {
    let change = fields.change()?;
    if let Some(name) = change.name.as_deref().map(str::trim)
        && studies::is_named(writer, caller.reach(), name, Some(id)).await?
    {
        let free = study_plan::free_name(writer, caller.reach(), name).await?;
        return Err(study_plan::name_is_taken(name, &free));
    }
    study_change::change(writer, &caller.actor, id, &change).await?;
    Ok(())
}
