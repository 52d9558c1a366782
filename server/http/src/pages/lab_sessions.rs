//! The page of all lab sessions of a study, with the form that plans one.

use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::extractors::Form;
use crate::format::{self, words};
use crate::page_error::{PageError, PageResult, page};
use crate::refused_fields::{FieldLabels, FormCheck, RefusedFields, TypedForm};
use crate::visible::Visible;
use askama::Template;
use axum::extract::State;
use axum::response::{IntoResponse, Redirect, Response};
use gaitwright_compute::OnPool;
use gaitwright_service::access::{Read, RequiredRight, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::lab::{self, GaitsToPlanWith, LabSessionView, NewLabSession};
use gaitwright_service::studies::recommended_trial::ranking_to_show;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::studies::{AnswerSource, Study};
use gaitwright_store::trial_list::ListedTrial;
use gaitwright_store::{LabSessionId, StudyId, TrialId, commit, lab_sessions, studies};
use serde::Deserialize;
use std::sync::Arc;

/// How many converged trials the form considers, lowest Gait RMSE first.
const OFFERED: u32 = 200;
/// How many gaits without a certificate are named.
const NAMED: usize = 3;

#[derive(Template)]
#[template(path = "lab_sessions.html")]
struct SessionsPage {
    study: Study,
    /// The sessions, with name in the lab and state.
    sessions: Vec<(LabSessionView, String, String)>,
    /// Different walkable gaits of the study, best first, with their labels.
    gaits: Vec<(TrialId, String)>,
    /// The best gaits that lack nothing but a certificate, with their labels.
    without_certificate: Vec<(TrialId, String)>,
    may_run: bool,
    fields: LabSessionFields,
    refused: RefusedFields,
}

impl SessionsPage {
    fn is(chosen: &str, gait: &TrialId) -> bool {
        chosen == gait.to_string()
    }
}

/// The fields as typed, to show a refused form again.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct LabSessionFields {
    trial_a: String,
    trial_b: String,
    notes: String,
}

impl LabSessionFields {
    fn read(&self) -> Result<NewLabSession, Error> {
        let gait = |field, text: &str| text.parse().map_err(|_| Error::invalid(field, text, "a gait from the list"));
        Ok(NewLabSession {
            trial_a: gait("trial_a", &self.trial_a)?,
            trial_b: gait("trial_b", &self.trial_b)?,
            notes: self.notes.clone(),
        })
    }
}

impl TypedForm for LabSessionFields {
    const LABELS: FieldLabels = &[("trial_a", "Gait A"), ("trial_b", "Gait B"), ("notes", "Notes")];

    /// Only the list has acceptable gaits.
    fn repair(&mut self, _: &str) -> bool {
        false
    }
}

/// `GET /studies/{id}/lab`.
pub(super) async fn list(
    authorized: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
) -> PageResult {
    let may_run = authorized.caller.may(Run::NEEDED);
    show(&mut app, id, may_run, LabSessionFields::default(), RefusedFields::default()).await
}

async fn show(
    app: &mut AppState,
    id: StudyId,
    may_run: bool,
    fields: LabSessionFields,
    refused: RefusedFields,
) -> PageResult {
    let mut reader = app.read().await?;
    let study = studies::get(&mut reader, id).await?;
    let sessions = lab_sessions::of_study(&mut reader, id).await?;
    let GaitsToPlanWith { mut walkable, mut without_certificate } =
        lab::gaits_to_plan_with(&mut reader, id, OFFERED).await?;
    let snapshot = StudySnapshot::read(&mut reader, study.clone()).await?;
    drop(reader);
    let analyses = Arc::clone(&app.analyses);
    let ranked = app.compute(move |pool: &OnPool| ranking_to_show(pool, &snapshot, &analyses)).await;
    let ranked = ranked.map_err(Error::from)?.map_err(Error::Learner)?;
    let place = |trial: &ListedTrial| ranked.iter().position(|ranked| *ranked == trial.id).unwrap_or(usize::MAX);
    walkable.sort_by_key(place);
    without_certificate.sort_by_key(place);
    without_certificate.truncate(NAMED);
    let best = ranked.first().copied();
    let named = |trial: ListedTrial| (trial.id, label(&trial, best, study.plan.answer_source));
    let shown = |session| {
        let view = LabSessionView::from(&session);
        let (name_in_lab, state) = (lab::name_in_lab(view.id), words(view.state.as_str()));
        (view, name_in_lab, state)
    };
    page(&SessionsPage {
        sessions: sessions.into_iter().map(shown).collect(),
        gaits: walkable.into_iter().map(named).collect(),
        without_certificate: without_certificate.into_iter().map(named).collect(),
        study,
        may_run,
        fields,
        refused,
    })
}

/// `trial 3 (recommended)`. Where people decide, Gait RMSE does not rank gaits.
fn label(trial: &ListedTrial, best: Option<TrialId>, answers: AnswerSource) -> String {
    let recommended = (best == Some(trial.id)).then(|| "recommended".to_owned());
    let rmse = || format!("Gait RMSE {} rad", format::decimal(trial.gait_rmse_rad));
    let rmse = (answers == AnswerSource::GaitRmse).then(rmse);
    let facts: Vec<String> = recommended.into_iter().chain(rmse).collect();
    let number = trial.number;
    if facts.is_empty() { format!("trial {number}") } else { format!("trial {number} ({})", facts.join(", ")) }
}

/// `POST /studies/{id}/lab`.
pub(super) async fn plan(
    authorized: Authorized<Run>,
    State(mut app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    Form(fields): Form<LabSessionFields>,
) -> Result<Response, PageError> {
    let planned = async {
        let new = fields.read()?;
        let mut writer = app.write().await?;
        let session = lab::plan(&mut writer, &authorized.caller.actor, id, &new).await?;
        commit(writer).await?;
        Ok::<LabSessionId, Error>(session.id)
    };
    let error = match planned.await {
        Ok(session) => return Ok(Redirect::to(&format!("/lab-sessions/{session}")).into_response()),
        Err(error) => error,
    };
    let mut check = FormCheck::new(&fields);
    check.refuse(error)?;
    let refused = check.into_refused();
    Ok((refused.status(), show(&mut app, id, true, fields, refused).await?).into_response())
}
