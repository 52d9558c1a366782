//! The study page, kept current by events.

mod answers;
mod recommended_walker;
mod time_left;
mod trials_table;
mod without_gait;

use self::answers::{AnswerRow, answers};
pub(super) use self::answers::{answer_in_words, assessment_in_words};
use self::recommended_walker::Walker;
use self::time_left::time_left;
use self::trials_table::{Choice, TrialRow, TrialsTable};
use self::without_gait::WithoutGait;
use super::certainty::certainty;
use super::page_chart::Drawn;
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::extractors::{Form, Params};
use crate::figures::{COURSE, Outcome, course, utility, warm_starts};
use crate::format::{self, Bound, words};
use crate::page_error::{Page, PageError, page};
use crate::units::Units;
use crate::visible::Visible;
use askama::Template;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Redirect, Response};
use gait_learner::LearnerError;
use gaitwright_charts::Figure;
use gaitwright_charts::gait_charts;
use gaitwright_compute::OnPool;
use gaitwright_service::access::{Administer, Caller, Permission, Read, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::belief::{Beliefs, MOST_ANSWERS};
use gaitwright_service::studies::certified_best::{self, CertificateState, Judged};
use gaitwright_service::studies::equal_actions::never_active;
use gaitwright_service::studies::execution;
use gaitwright_service::studies::lifecycle::{Act, acts_of_people};
use gaitwright_service::studies::safety_reports::ReportedGait;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_service::studies::study_change::{self, Extend};
use gaitwright_service::studies::trial_choice::MANY;
use gaitwright_service::studies::{command, lifecycle};
use gaitwright_service::workers::Track;
use gaitwright_store::assessments::{self};
use gaitwright_store::devices::{self, Device};
use gaitwright_store::feedback::{self};
use gaitwright_store::imports::{self, Import};
use gaitwright_store::studies::{FeedbackMode, Study, StudyState};
use gaitwright_store::subjects::{self, Subject};
use gaitwright_store::trials::{Trial, TrialCounts, TrialState};
use gaitwright_store::{
    Instant, LabSessionId, StudyId, TrialId, commit, consents, events, explanations, gaits, jobs, lab_sessions,
    reference_gaits, studies, trials,
};
use serde::Deserialize;
use std::sync::Arc;

#[derive(Template)]
#[template(path = "study.html")]
struct StudyPage {
    units: Units,
    study: Study,
    subject: Subject,
    device: Device,
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
    answers_by: &'static str,
    may_administer: bool,
    /// Imports; empty if the study was created here.
    imports: Vec<Import>,
}

/// The page of a study whose subject withdrew consent: its plan, without gaits, figures or answers.
#[derive(Template)]
#[template(path = "study_closed.html")]
struct ClosedPage {
    study: Study,
    subject: Subject,
    counts: TrialCounts,
    may_administer: bool,
}

/// The part that changes while the study runs.
#[derive(Template)]
#[template(path = "study_live.html")]
struct Live {
    study: Study,
    state: String,
    acts: Vec<ActButton>,
    /// Whether it can be stopped.
    may_stop: bool,
    /// Whether it has ended and can get more trials.
    may_extend: bool,
    counts: TrialCounts,
    /// Why trials have no gait.
    without_gait: Option<WithoutGait>,
    /// The bounds that were active in no gait so far; empty if none or unknown.
    never_active: String,
    /// Number of results, and number of planned trials.
    progress: [String; 2],
    /// Expected remaining time; empty unless the study runs.
    pace: String,
    /// Why the next solve has not started; empty if one runs.
    queued: String,
    running: Vec<RunningRow>,
    best: Option<Best>,
    /// How sure the recommendation is; `None` without one, and for a large study.
    certainty: Option<String>,
    /// The recommended gait, or its place.
    walker: Walker,
    unanswered: bool,
    /// Whether only people answer comparisons.
    people_answer: bool,
    /// The utility of the recommended gait over the answers of people.
    utility: Option<Drawn>,
    /// Gait RMSE of the best action by iteration.
    chart: Option<Drawn>,
    table: TrialsTable,
    /// Warm-start tree.
    tree: Option<Drawn>,
    answers: Vec<AnswerRow>,
    unsafe_gaits: Vec<UnsafeGait>,
    question: bool,
    /// The trial whose certificate the next comparison waits for.
    question_after: Option<(TrialId, u32)>,
    can_compare: bool,
}

impl Live {
    /// How many of the newest trials the warm-start tree shows.
    const BRANCHES: usize = 100;

    fn is_best(&self, row: &TrialRow) -> bool {
        self.best.as_ref().is_some_and(|best| best.id == row.id)
    }

    /// Whether the study has ended and nothing waits for a person, so that the recommended gait comes before the state.
    fn leads_with_outcome(&self) -> bool {
        self.unsafe_gaits.is_empty() && !self.question && self.study.state.has_ended()
    }

    /// Whether answers are missing from the list.
    fn has_more_answers(&self) -> bool {
        self.answers.len() >= ANSWERS
    }

    /// Whether the warm-start tree shows the newest trials only.
    fn has_more_branches(&self) -> bool {
        self.counts.total as usize > Self::BRANCHES
    }

    fn is_unsafe(&self, row: &TrialRow) -> bool {
        self.unsafe_gaits.iter().any(|gait| gait.id == row.id)
    }
}

struct ActButton {
    act: &'static str,
    label: &'static str,
}

struct RunningRow {
    id: TrialId,
    number: u32,
    text: String,
    chart: Option<Drawn>,
}

struct Best {
    id: TrialId,
    number: u32,
    rmse: String,
    cost: String,
    bounds: Vec<Bound>,
    has_gait: bool,
    /// Whether a script evaluated it and reported figures only.
    by_script: bool,
    /// The state of its certificate.
    judged: Judged,
    /// How many simulated walks with it were complete; `None` if none were simulated.
    simulated_walks: Option<String>,
    /// If it failed, the best trial whose gait passed.
    passing: Option<Passing>,
}

impl Best {
    fn failed(&self) -> bool {
        self.judged.certificate == CertificateState::Failed
    }

    fn passed(&self) -> bool {
        self.judged.certificate == CertificateState::Passed
    }

    fn is_being_certified(&self) -> bool {
        self.judged.certificate == CertificateState::BeingCertified
    }
}

/// A trial whose gait passed its certificate.
struct Passing {
    id: TrialId,
    number: u32,
    rmse: String,
}

/// A gait that was reported as unsafe.
struct UnsafeGait {
    id: TrialId,
    number: u32,
    by: String,
    at: Instant,
    /// Whether staff reviewed the report and kept the gait unsafe.
    reviewed: bool,
}

/// How many of the newest trials of a large study the chart shows.
const SHOWN: u32 = 200;
/// How many of the newest answers the list shows.
const ANSWERS: usize = 50;

/// `GET /studies/{id}`.
pub(super) async fn get(
    authorized: Authorized<Read>,
    State(mut app): State<AppState>,
    units: Units,
    Id(id, _): Id<StudyId, Read>,
    Params(choice): Params<Choice>,
) -> Page {
    let mut reader = app.read().await?;
    let study = studies::get(&mut reader, id).await?;
    let subject = subjects::get(&mut reader, study.plan.subject_id).await?;
    if consents::is_withdrawn(&mut reader, id).await? {
        let counts = trials::counts(&mut reader, id).await?;
        let may_administer = authorized.caller.may(Administer::NEEDED);
        return page(&ClosedPage { study, subject, counts, may_administer });
    }
    let last_event = events::last(&mut reader, id).await?;
    let device = devices::get(&mut reader, study.plan.device_id).await?;
    let reference = reference_gaits::get(&mut reader, study.plan.reference_gait_id).await?.name;
    let imports = imports::of_study(&mut reader, id).await?;
    let sessions = lab_sessions::of_study(&mut reader, id).await?;
    drop(reader);
    let live = read_live(&mut app, &authorized.caller, id, choice).await?;
    let (walks, trials) = (live.walker.has_place(), live.counts.total);
    let live = live.render().map_err(|e| Error::Internal(e.to_string()))?;
    let may_administer = authorized.caller.may(Administer::NEEDED);
    let (variant, answers_by) = (format::variant(study.plan.muscles), format::answers_by(study.plan.feedback_mode));
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
        answers_by,
        may_administer,
        imports,
    })
}

/// `GET /studies/{id}/live`: the changing part alone, for the script.
pub(super) async fn live(
    authorized: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
    Params(choice): Params<Choice>,
) -> Page {
    page(&read_live(&mut app, &authorized.caller, id, choice).await?)
}

/// The progress of a running solve.
#[derive(Template)]
#[template(path = "running.html")]
struct Running {
    row: RunningRow,
}

/// `GET /trials/{id}/running`: one running solve, for the script; nothing once it has ended.
pub(super) async fn running(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<TrialId, Read>,
) -> Result<Response, PageError> {
    let trial = trials::get(&mut *app.read().await?, id).await?;
    let Some(track) = app.scheduler.board().track(id) else { return Ok(StatusCode::NO_CONTENT.into_response()) };
    Ok(page(&Running { row: running_row(&trial, Some(&track)) })?.into_response())
}

/// The form of a button.
#[derive(Debug, Deserialize)]
pub(super) struct Do {
    act: String,
    /// The new total number of trials, for an extension.
    #[serde(default)]
    trial_budget: String,
}

/// `POST /studies/{id}/do`.
pub(super) async fn post(
    authorized: Authorized<Run>,
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    Form(form): Form<Do>,
) -> Result<Redirect, PageError> {
    let act = lifecycle::Act::ALL
        .into_iter()
        .find(|act| act.as_str() == form.act && acts_for_pages(*act))
        .ok_or_else(|| Error::invalid("act", form.act, "start, pause, resume, stop or extend"))?;
    let mut writer = app.write().await?;
    let cancelled = if act == Act::Extend {
        let refused =
            || Error::invalid("trial_budget", form.trial_budget.as_str(), "a whole number, the total number of trials");
        let more = Extend { trial_budget: form.trial_budget.trim().parse().map_err(|_| refused())? };
        study_change::extend(&mut writer, &authorized.caller.actor, id, &more).await?;
        Vec::new()
    } else {
        command::act(&mut writer, &authorized.caller.actor, id, act, "").await?.cancelled
    };
    commit(writer).await?;
    for trial in cancelled {
        app.scheduler.cancel_solve(trial).await;
    }
    app.scheduler.changed();
    Ok(Redirect::to(&format!("/studies/{id}")))
}

/// Whether the page has a button for it.
fn acts_for_pages(act: Act) -> bool {
    matches!(act, Act::Start | Act::Pause | Act::Resume | Act::Stop | Act::Extend)
}

/// Acts that need no confirmation.
fn button(act: Act) -> Option<ActButton> {
    match act {
        Act::Start => Some(ActButton { act: "start", label: "Start" }),
        Act::Pause => Some(ActButton { act: "pause", label: "Pause" }),
        Act::Resume => Some(ActButton { act: "resume", label: "Resume" }),
        _ => None,
    }
}

async fn read_live(app: &mut AppState, caller: &Caller, id: StudyId, choice: Choice) -> Result<Live, Error> {
    let mut reader = app.read().await?;
    let study = studies::get(&mut reader, id).await?;
    let counts = trials::counts(&mut reader, id).await?;
    // The computing time of the learner also grows with the answers.
    let heard = feedback::count(&mut reader, id).await? as usize;
    let large = counts.total as usize >= MANY || heard > MOST_ANSWERS;
    let snapshot = if large {
        StudySnapshot::newest(&mut reader, study, SHOWN).await?
    } else {
        StudySnapshot::read(&mut reader, study).await?
    };
    let shown = choice.shown.clone();
    let table = TrialsTable::read(&mut reader, id, counts, choice).await?;
    let assessments = assessments::of_study(&mut reader, id).await?;
    drop(reader);
    let beliefs = Arc::clone(&app.beliefs);
    let draw = move |pool: &OnPool| {
        let outcome = learned(pool, &snapshot, large, &beliefs);
        (snapshot, outcome)
    };
    let (snapshot, learned) = app.compute(draw).await?;
    let Learned { outcome, certainty, utility } = learned.map_err(Error::Learner)?;
    let mut reader = app.read().await?;
    let mut judged = certified_best::judged(&mut reader, &outcome.ranking).await?;
    let without_gait = WithoutGait::of(&snapshot.trials, &explanations::in_common(&mut reader, id).await?);
    let has_gait = match outcome.best {
        Some(best) => gaits::is_here(&mut reader, best).await?,
        None => false,
    };
    let simulated_walks = match outcome.best {
        Some(best) => execution::newest(&mut reader, best).await?.map(|kept| kept.simulated.report.sentence()),
        None => None,
    };
    drop(reader);
    if let Some(next) = judged.without_certificate {
        judged.certified_by_service(app.scheduler.is_certifying(id, next));
    }
    let running = snapshot
        .trials
        .iter()
        .filter(|trial| trial.state == TrialState::Running)
        .map(|trial| running_row(trial, app.scheduler.board().track(trial.id).as_ref()))
        .collect();
    let mut answers = answers(&snapshot, &assessments);
    answers.truncate(ANSWERS);
    let is_queued = snapshot.trials.iter().any(|trial| trial.state == TrialState::Queued);
    let found = Found { outcome, certainty, utility, judged, simulated_walks, has_gait, without_gait };
    let pace = time_left(&snapshot, counts.results(), app.scheduler.workers());
    // The newest trials do not say it of all.
    let inactive = if large { Vec::new() } else { never_active(&snapshot) };
    let mut live = view(snapshot, counts, found, running, table, answers, caller.may(Run::NEEDED));
    live.never_active = inactive.join(", ");
    live.pace = pace;
    let best = live.best.as_ref().map(|best| (best.id, best.number, best.has_gait));
    live.walker = Walker::read(app, &live.study, best, &shown).await?;
    if live.running.is_empty() && is_queued && live.study.state == StudyState::Running {
        live.queued = waits_for_a_worker(jobs::depth_of_others(&mut *app.read().await?, id).await?);
    }
    Ok(live)
}

/// What the learner says of a study.
struct Learned {
    outcome: Outcome,
    certainty: Option<String>,
    utility: Option<Figure>,
}

fn learned(pool: &OnPool, snapshot: &StudySnapshot, large: bool, beliefs: &Beliefs) -> Result<Learned, LearnerError> {
    let outcome = Outcome::of(pool, snapshot, large, beliefs)?;
    if large || outcome.best.is_none() {
        return Ok(Learned { outcome, certainty: None, utility: None });
    }
    let certainty = certainty(snapshot, &*beliefs.of(pool, snapshot)?);
    Ok(Learned { outcome, certainty, utility: utility(pool, snapshot, beliefs)? })
}

fn running_row(trial: &Trial, track: Option<&Track>) -> RunningRow {
    let records = track.map_or(&[][..], |track| &track.records);
    let text = records.last().map_or_else(
        || "starting".to_owned(),
        |r| {
            let violation = format::number(r.constraint_violation);
            // Counts all iterations, like the chart.
            let iteration = records.len() - 1;
            format!("iteration {iteration}, objective {:.4}, violation {violation}", r.objective)
        },
    );
    RunningRow {
        id: trial.id,
        number: trial.number,
        text,
        chart: gait_charts::solve(records)
            .map(|figure| Drawn::of(&figure, &format!("/api/v1/trials/{}/figures", trial.id), "")),
    }
}

/// What a study has found, and what the record says of it.
struct Found {
    outcome: Outcome,
    certainty: Option<String>,
    utility: Option<Figure>,
    /// The states of the certificates.
    judged: Judged,
    /// How many simulated walks with the best gait were complete.
    simulated_walks: Option<String>,
    /// Whether the trajectory of the best gait is stored.
    has_gait: bool,
    without_gait: Option<WithoutGait>,
}

fn view(
    snapshot: StudySnapshot,
    counts: TrialCounts,
    found: Found,
    running: Vec<RunningRow>,
    table: TrialsTable,
    answers: Vec<AnswerRow>,
    may_run: bool,
) -> Live {
    let Found { outcome, certainty, utility, judged, simulated_walks, has_gait, without_gait } = found;
    let best = outcome.best.and_then(|id| snapshot.trial(id)).map(|trial| Best {
        id: trial.id,
        number: trial.number,
        rmse: format::figure(trial.gait_rmse_rad),
        cost: format::figure(trial.cost_of_transport),
        bounds: format::bounds(&trial.action),
        has_gait,
        by_script: trial.asked_by.is_some(),
        passing: judged.passing.and_then(|id| snapshot.trial(id)).map(|trial| Passing {
            id: trial.id,
            number: trial.number,
            rmse: format::figure(trial.gait_rmse_rad),
        }),
        judged: judged.clone(),
        simulated_walks,
    });
    let unsafe_gait = |report: &ReportedGait| {
        let number = snapshot.trial(report.trial)?.number;
        let reviewed = report.review.is_some();
        Some(UnsafeGait { id: report.trial, number, by: report.by.clone(), at: report.at, reviewed })
    };
    let unsafe_gaits = snapshot.grounds.safety_reports.in_force.iter().filter_map(unsafe_gait).collect();
    let converged = snapshot.trials.iter().filter(|trial| trial.state == TrialState::Converged).count();
    let files = format!("/api/v1/studies/{}/figures", snapshot.study.id);
    let acts = if may_run { acts_of_people(snapshot.study.state) } else { Vec::new() };
    Live {
        state: words(snapshot.study.state.as_str()),
        may_stop: acts.contains(&Act::Stop),
        may_extend: acts.contains(&Act::Extend),
        acts: acts.into_iter().filter_map(button).collect(),
        pace: String::new(),
        queued: String::new(),
        without_gait,
        never_active: String::new(),
        progress: [counts.results(), snapshot.study.plan.trial_budget].map(|trials| format::count(trials.into())),
        counts,
        running,
        best,
        certainty,
        walker: Walker::None,
        unanswered: outcome.unanswered,
        people_answer: snapshot.study.plan.feedback_mode == FeedbackMode::Human,
        utility: utility.map(|figure| Drawn::of(&figure, &files, "")),
        chart: course(&[(&snapshot, &outcome)]).map(|chart| Drawn::of(&Figure::chart(COURSE, chart), &files, "")),
        table,
        tree: warm_starts(&snapshot, outcome.best, Live::BRANCHES).map(|figure| Drawn::of(&figure, &files, "")),
        answers,
        unsafe_gaits,
        question: outcome.question && snapshot.study.state != StudyState::Stopped,
        question_after: outcome
            .question_after
            .filter(|_| !snapshot.study.state.has_ended())
            .and_then(|id| snapshot.trial(id))
            .map(|trial| (trial.id, trial.number)),
        can_compare: converged >= 2,
        study: snapshot.study,
    }
}

/// Why the next solve of the study has not started, from the numbers of queued and running solves of other studies.
fn waits_for_a_worker((queued, running): (u32, u32)) -> String {
    let solves = |count: u32| if count == 1 { "1 solve".to_owned() } else { format!("{count} solves") };
    match (running, queued) {
        (0, _) => "The next solve is queued.".to_owned(),
        (_, 0) => format!("The next solve is queued. Running: {} of other studies.", solves(running)),
        (_, others) => {
            format!("The next solve is queued. Running: {} of other studies; queued: {} more.", solves(running), others)
        }
    }
}
