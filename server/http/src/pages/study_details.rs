//! The page for the name, tags and notes of a study, which also archives and clones it.

use super::saved::{Saved, confirmed};
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::extractors::{Form, Params};
use crate::page_error::{PageError, PageResult, page};
use crate::refused_fields::{FieldLabels, FormCheck, RefusedFields, TypedForm};
use crate::visible::Visible;
use askama::Template;
use axum::extract::State;
use axum::response::{IntoResponse, Redirect, Response};
use gaitwright_service::access::{Caller, Read, RequiredRight, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::study_change::{self, StudyChange};
use gaitwright_store::studies::{Study, StudyState};
use gaitwright_store::{StudyId, commit, studies};
use serde::Deserialize;
use std::ops::ControlFlow;

#[derive(Template)]
#[template(path = "study_details.html")]
struct DetailsPage {
    study: Study,
    fields: StudyDetailsFields,
    may_run: bool,
    saved: bool,
    refused: RefusedFields,
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

impl TypedForm for StudyDetailsFields {
    const LABELS: FieldLabels = &[("name", "Name"), ("tags", "Tags"), ("notes", "Notes")];

    fn repair(&mut self, field: &str) -> bool {
        match field {
            // A name that no study has.
            "name" => self.name = StudyId::fresh().to_string(),
            "tags" => self.tags.clear(),
            "notes" => self.notes.clear(),
            _ => return false,
        }
        true
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
    refusal: Option<(Option<StudyDetailsFields>, RefusedFields)>,
) -> PageResult {
    let (typed, refused) = refusal.unwrap_or_default();
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
    let (caller, mut check) = (&authorized.caller, FormCheck::new(&fields));
    let mut writer = app.write().await?;
    let change = loop {
        let read = async {
            let change = check.form().change()?;
            study_change::check(&mut writer, caller.reach(), id, &change).await?;
            Ok(change)
        }
        .await;
        if let ControlFlow::Break(change) = check.step(read)? {
            break change;
        }
    };
    let refused = check.into_refused();
    if let Some(change) = change.filter(|_| refused.is_empty()) {
        study_change::change(&mut writer, &caller.actor, caller.reach(), id, &change).await?;
        commit(writer).await?;
        app.scheduler.changed();
        return Ok(Redirect::to(&confirmed(&format!("/studies/{id}/details"))).into_response());
    }
    drop(writer);
    let status = refused.status();
    let typed = Some(fields).filter(|fields| fields.button == "save");
    Ok((status, show(&app, caller, id, false, Some((typed, refused))).await?).into_response())
}
