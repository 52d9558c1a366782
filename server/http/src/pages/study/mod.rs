//! The study page, kept current by events.

mod answers_table;
mod best_gait;
mod live_part;
mod recommended_walker;
mod state_buttons;
mod time_left;
mod trials_table;
mod without_gait;

pub(super) use self::answers_table::{AnswerRow, answer_in_words, answers, assessment_in_words};
pub(super) use self::best_gait::preferred;
use self::live_part::{RunningRow, read_live, running_row};
use self::state_buttons::{TransitionForm, press};
use self::trials_table::TrialsQuery;
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::extractors::{Form, Params};
use crate::format;
use crate::page_error::{PageError, PageResult, page};
use crate::refused_fields::{FormCheck, RefusedFields};
use crate::units::Units;
use crate::visible::Visible;
use askama::Template;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Redirect, Response};
use gaitwright_service::access::{Administer, Caller, Read, RequiredRight, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::lifecycle;
use gaitwright_store::devices::{self, DeviceRow};
use gaitwright_store::imports::{self, Import};
use gaitwright_store::studies::Study;
use gaitwright_store::subjects::{self, SubjectRow};
use gaitwright_store::trials::TrialCounts;
use gaitwright_store::{
    LabSessionId, StudyId, TrialId, commit, consents, events, lab_sessions, reference_gaits, studies, trials,
};
use std::ops::ControlFlow;

#[derive(Template)]
#[template(path = "study.html")]
struct StudyPage {
    units: Units,
    study: Study,
    subject: SubjectRow,
    device: DeviceRow,
    reference: String,
    live: String,
    /// Number of trials.
    trials: u32,
    /// Whether a recommended gait walks, or will.
    walks: bool,
    /// The lab sessions, by number.
    sessions: Vec<(LabSessionId, u32)>,
    last_event: i64,
    variant: &'static str,
    answer_source: &'static str,
    /// Effect of simulated walks, in words; `None` without any.
    simulated_walks: Option<String>,
    may_administer: bool,
    /// Imports; empty if the study was created here.
    imports: Vec<Import>,
}

/// The page of a study whose subject withdrew consent: its plan, without gaits, figures or answers.
#[derive(Template)]
#[template(path = "study_closed.html")]
struct ClosedPage {
    study: Study,
    subject: SubjectRow,
    counts: TrialCounts,
    may_run: bool,
}

impl ClosedPage {
    fn state_in_words(&self) -> &'static str {
        lifecycle::in_words(self.study.state)
    }
}

/// `GET /studies/{id}`.
pub(super) async fn get(
    authorized: Authorized<Read>,
    State(mut app): State<AppState>,
    units: Units,
    Id(id, _): Id<StudyId, Read>,
    Params(choice): Params<TrialsQuery>,
) -> PageResult {
    show(&mut app, &authorized.caller, units, id, choice, None).await
}

/// `POST /studies/{id}/do`.
pub(super) async fn post(
    authorized: Authorized<Run>,
    State(mut app): State<AppState>,
    units: Units,
    Id(id, _): Id<StudyId, Run>,
    Form(form): Form<TransitionForm>,
) -> Result<Response, PageError> {
    let mut check = FormCheck::new(&form);
    let pressed = async {
        let mut writer = app.write().await?;
        let cancelled = press(&mut writer, &authorized.caller, id, &form).await?;
        commit(writer).await?;
        Ok(cancelled)
    };
    let pressed = pressed.await;
    if let ControlFlow::Break(Some(cancelled)) = check.step(pressed)? {
        for trial in cancelled {
            app.scheduler.cancel_solve(trial).await;
        }
        app.scheduler.changed();
        return Ok(Redirect::to(&format!("/studies/{id}")).into_response());
    }
    let refused = check.into_refused();
    let status = refused.status();
    let shown = show(&mut app, &authorized.caller, units, id, TrialsQuery::default(), Some((form, refused))).await?;
    Ok((status, shown).into_response())
}

async fn show(
    app: &mut AppState,
    caller: &Caller,
    units: Units,
    id: StudyId,
    choice: TrialsQuery,
    refusal: Option<(TransitionForm, RefusedFields)>,
) -> PageResult {
    let mut reader = app.read().await?;
    let study = studies::get(&mut reader, id).await?;
    let subject = subjects::get(&mut reader, study.plan.subject_id).await?;
    if consents::is_withdrawn(&mut reader, id).await? {
        let counts = trials::counts(&mut reader, id).await?;
        let may_run = caller.may(Run::NEEDED);
        return page(&ClosedPage { study, subject, counts, may_run });
    }
    let last_event = events::last(&mut reader, id).await?;
    let device = devices::get(&mut reader, study.plan.device_id).await?;
    let reference = reference_gaits::get(&mut reader, study.plan.reference_gait_id).await?.name;
    let imports = imports::of_study(&mut reader, id).await?;
    let sessions = lab_sessions::of_study(&mut reader, id).await?;
    drop(reader);
    let mut live = read_live(app, caller, id, choice).await?;
    if let Some((form, refused)) = refusal {
        (live.number_of_trials, live.refused) = (form.number_of_trials, refused);
    }
    let (walks, trials) = (live.walker.has_place(), live.counts.total);
    let live = live.render().map_err(|e| Error::Internal(e.to_string()))?;
    let may_administer = caller.may(Administer::NEEDED);
    let (variant, answer_source) =
        (format::variant(study.plan.muscles), format::answer_source(study.plan.answer_source));
    let simulated_walks = format::simulated_walks(&study.plan.simulated_walks);
    page(&StudyPage {
        units,
        study,
        subject,
        device,
        reference,
        live,
        trials,
        walks,
        sessions: sessions.iter().map(|session| (session.id, session.number)).collect(),
        last_event,
        variant,
        answer_source,
        simulated_walks,
        may_administer,
        imports,
    })
}

/// `GET /studies/{id}/live`: the changing part alone, for the script.
pub(super) async fn live(
    authorized: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
    Params(choice): Params<TrialsQuery>,
) -> PageResult {
    page(&read_live(&mut app, &authorized.caller, id, choice).await?)
}

/// The progress of a running solve.
#[derive(Template)]
#[template(path = "running.html")]
struct RunningPage {
    row: RunningRow,
}

/// `GET /trials/{id}/running`: one running solve, for the script; nothing once it has ended.
pub(super) async fn running(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<TrialId, Read>,
) -> Result<Response, PageError> {
    let trial = trials::get(&mut *app.read().await?, id).await?;
    let Some(track) = app.scheduler.running_solves().track(id) else {
        return Ok(StatusCode::NO_CONTENT.into_response());
    };
    Ok(page(&RunningPage { row: running_row(&trial, Some(&track)) })?.into_response())
}
