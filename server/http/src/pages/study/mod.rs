//! The study page, kept current by events.

mod trials_table;
mod without_gait;

use self::trials_table::{Choice, TrialRow, TrialsTable};
use self::without_gait::WithoutGait;
use super::format::{self, Bound, words};
use super::page_chart::Drawn;
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::extract::{Form, Params};
use crate::page_error::{Page, PageError, page};
use crate::visible::Visible;
use askama::Template;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Redirect, Response};
use gaitwright_charts::gait_charts;
use gaitwright_charts::{Chart, Figure, Node, Stroke, Tree};
use gaitwright_compute::OnPool;
use gaitwright_service::access::{Administer, Caller, Permission, Read, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::belief::{Beliefs, MOST_ANSWERS};
use gaitwright_service::studies::change::{self, Extend};
use gaitwright_service::studies::choice::{MANY, last_believed, ranking_to_show};
use gaitwright_service::studies::comparison::open_question;
use gaitwright_service::studies::history::{self, Milestone};
use gaitwright_service::studies::lifecycle::{Act, acts_of_people};
use gaitwright_service::studies::recommended::{self, CertificateState, Judged};
use gaitwright_service::studies::safety_reports::{Closed, SafetyReportSource};
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_service::studies::{command, lifecycle};
use gaitwright_service::workers::Track;
use gaitwright_store::assessments::{self, Assessment};
use gaitwright_store::devices::{self, Device};
use gaitwright_store::feedback::{self, FeedbackContent, FeedbackRow, Retraction, Source};
use gaitwright_store::imports::{self, Import};
use gaitwright_store::studies::{Evaluation, FeedbackMode, Study, StudyState};
use gaitwright_store::subjects::{self, Subject};
use gaitwright_store::trials::{Trial, TrialCounts, TrialState};
use gaitwright_store::{
    Instant, StudyId, TrialId, commit, consents, events, explanations, gaits, jobs, presentations, reference_gaits,
    studies, trials,
};
use serde::Deserialize;
use std::cmp::Reverse;
use std::collections::HashMap;
use std::sync::Arc;

#[derive(Template)]
#[template(path = "study.html")]
struct StudyPage {
    study: Study,
    subject: Subject,
    device: Device,
    reference: String,
    live: String,
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
    /// Number of results, and number of planned trials.
    progress: [String; 2],
    /// Expected remaining time; empty if unknown.
    pace: String,
    running: Vec<RunningRow>,
    best: Option<Best>,
    unanswered: bool,
    /// Whether only people answer comparisons.
    people_answer: bool,
    chart: Option<Drawn>,
    table: TrialsTable,
    /// Warm-start tree.
    tree: Option<Drawn>,
    answers: Vec<AnswerRow>,
    unsafe_gaits: Vec<UnsafeGait>,
    question: bool,
    can_compare: bool,
}

impl Live {
    fn is_best(&self, row: &TrialRow) -> bool {
        self.best.as_ref().is_some_and(|best| best.id == row.id)
    }

    /// Whether answers are missing from the list.
    fn has_more_answers(&self) -> bool {
        self.answers.len() >= SHOWN as usize
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

struct AnswerRow {
    text: String,
    /// Source and author.
    by: String,
    note: String,
    /// Why it no longer counts.
    undone: Option<String>,
    /// `saved` of the comparison page that can retract it.
    saved: Option<String>,
    at: Instant,
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

/// How many of the newest trials of a large study the chart shows, and how many of the newest answers the list shows.
const SHOWN: u32 = 200;

/// `GET /studies/{id}`.
pub(super) async fn get(
    authorized: Authorized<Read>,
    State(mut app): State<AppState>,
    Id(id, _): Id<StudyId, Read>,
    Params(choice): Params<Choice>,
) -> Page {
    let mut reader = app.read().await?;
    let study = studies::get(&mut reader, id).await?;
    let subject = subjects::get(&mut reader, study.plan.subject_id).await?;
    if consents::is_withdrawn(&mut reader, id).await? {
        let counts = trials::counts(&mut reader, id).await?;
        return page(&ClosedPage { study, subject, counts });
    }
    let last_event = events::last(&mut reader, id).await?;
    let device = devices::get(&mut reader, study.plan.device_id).await?;
    let reference = reference_gaits::get(&mut reader, study.plan.reference_gait_id).await?.name;
    let imports = imports::of_study(&mut reader, id).await?;
    drop(reader);
    let live = read_live(&mut app, &authorized.caller, id, choice)
        .await?
        .render()
        .map_err(|e| Error::Internal(e.to_string()))?;
    let may_administer = authorized.caller.may(Administer::NEEDED);
    let (variant, answers_by) = (format::variant(study.plan.muscles), format::answers_by(study.plan.feedback_mode));
    page(&StudyPage {
        study,
        subject,
        device,
        reference,
        live,
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
        change::extend(&mut writer, &authorized.caller.actor, id, &more).await?;
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

/// Figures that are computed from the snapshot on the thread pool.
#[derive(Default)]
pub(super) struct Figures {
    /// Whether people answer and nobody has yet, so that the posterior is only the prior.
    unanswered: bool,
    pub(super) best: Option<TrialId>,
    /// Whether the trajectory of the best gait is stored.
    has_gait: bool,
    /// The gaits from best to worst, and the states of their certificates.
    ranking: Vec<TrialId>,
    judged: Judged,
    /// Why trials have no gait.
    without_gait: Option<WithoutGait>,
    pub(super) history: Vec<Milestone>,
    question: bool,
}

impl Figures {
    /// Gait RMSE of the best action by iteration.
    pub(super) fn course(&self) -> Vec<(f64, f64)> {
        let point = |milestone: &Milestone| Some((f64::from(milestone.iteration), milestone.gait_rmse_rad?));
        self.history.iter().filter_map(point).collect()
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
    let table = TrialsTable::read(&mut reader, id, counts, choice).await?;
    let assessments = assessments::of_study(&mut reader, id).await?;
    drop(reader);
    let beliefs = Arc::clone(&app.beliefs);
    let draw = move |pool: &OnPool| {
        let figures = figures(pool, &snapshot, large, &beliefs);
        (snapshot, figures)
    };
    let (snapshot, figures) = app.compute(draw).await?;
    let mut figures = figures.map_err(Error::Learner)?;
    let mut reader = app.read().await?;
    figures.judged = recommended::judged(&mut reader, &figures.ranking).await?;
    figures.without_gait = WithoutGait::of(&snapshot.trials, &explanations::in_common(&mut reader, id).await?);
    if let Some(best) = figures.best {
        figures.has_gait = gaits::is_here(&mut reader, best).await?;
    }
    drop(reader);
    if let Some(next) = figures.judged.without_certificate {
        figures.judged.certified_by_service(app.scheduler.is_certifying(id, next));
    }
    let running = snapshot
        .trials
        .iter()
        .filter(|trial| trial.state == TrialState::Running)
        .map(|trial| running_row(trial, app.scheduler.board().track(trial.id).as_ref()))
        .collect();
    let mut answers = answers(&snapshot, &assessments);
    answers.truncate(SHOWN as usize);
    let is_queued = snapshot.trials.iter().any(|trial| trial.state == TrialState::Queued);
    let mut live = view(snapshot, counts, &figures, running, table, answers, caller.may(Run::NEEDED));
    if live.running.is_empty() && is_queued && live.study.state == StudyState::Running {
        live.pace = waits_for_a_worker(jobs::depth(&mut *app.read().await?).await?);
    }
    Ok(live)
}

pub(super) fn figures(
    pool: &OnPool,
    snapshot: &StudySnapshot,
    large: bool,
    beliefs: &Beliefs,
) -> Result<Figures, gait_learner::LearnerError> {
    if large {
        // A large study is not read completely, so the learner's last best action is used instead of the posterior.
        let best = last_believed(snapshot);
        let (ranking, history) = (best.into_iter().collect(), history::known(snapshot));
        let question = snapshot.study.state == StudyState::Waiting;
        return Ok(Figures { best, ranking, history, question, ..Figures::default() });
    }
    let question = snapshot.study.plan.feedback_mode != FeedbackMode::Automatic
        && open_question(pool, snapshot)?.trials().is_some();
    if snapshot.waits_for_first_answer() {
        return Ok(Figures { unanswered: true, question, ..Figures::default() });
    }
    let ranking = ranking_to_show(pool, snapshot, beliefs)?;
    let best = ranking.first().copied();
    let history = history::of(snapshot, best);
    Ok(Figures { best, ranking, history, question, ..Figures::default() })
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

fn view(
    snapshot: StudySnapshot,
    counts: TrialCounts,
    figures: &Figures,
    running: Vec<RunningRow>,
    table: TrialsTable,
    answers: Vec<AnswerRow>,
    may_run: bool,
) -> Live {
    let best = figures.best.and_then(|id| snapshot.trial(id)).map(|trial| Best {
        id: trial.id,
        number: trial.number,
        rmse: format::figure(trial.gait_rmse_rad),
        cost: format::figure(trial.cost_of_transport),
        bounds: format::bounds(&trial.action),
        has_gait: figures.has_gait,
        by_script: trial.asked_by.is_some(),
        passing: figures.judged.passing.and_then(|id| snapshot.trial(id)).map(|trial| Passing {
            id: trial.id,
            number: trial.number,
            rmse: format::figure(trial.gait_rmse_rad),
        }),
        judged: figures.judged.clone(),
    });
    let unsafe_gait = |closed: &Closed| {
        let number = snapshot.trial(closed.trial)?.number;
        let reviewed = closed.review.is_some();
        Some(UnsafeGait { id: closed.trial, number, by: closed.by.clone(), at: closed.at, reviewed })
    };
    let unsafe_gaits = snapshot.grounds.safety_reports.closed.iter().filter_map(unsafe_gait).collect();
    let converged = snapshot.trials.iter().filter(|trial| trial.state == TrialState::Converged).count();
    let files = format!("/api/v1/studies/{}/figures", snapshot.study.id);
    let acts = if may_run { acts_of_people(snapshot.study.state) } else { Vec::new() };
    Live {
        state: words(snapshot.study.state.as_str()),
        may_stop: acts.contains(&Act::Stop),
        may_extend: acts.contains(&Act::Extend),
        acts: acts.into_iter().filter_map(button).collect(),
        pace: pace(&snapshot, counts),
        without_gait: figures.without_gait.clone(),
        progress: [counts.results(), snapshot.study.plan.trial_budget].map(|trials| format::count(trials.into())),
        counts,
        running,
        best,
        unanswered: figures.unanswered,
        people_answer: snapshot.study.plan.feedback_mode == FeedbackMode::Human,
        chart: course(&[(&snapshot, figures)]).map(|chart| Drawn::of(&Figure::chart(COURSE, chart), &files, "")),
        table,
        tree: warm_starts(&snapshot, figures.best).map(|figure| Drawn::of(&figure, &files, "")),
        answers,
        unsafe_gaits,
        question: figures.question && snapshot.study.state != StudyState::Stopped,
        can_compare: converged >= 2,
        study: snapshot.study,
    }
}

/// Warm-start tree; `None` before the first warm start.
pub(super) fn warm_starts(snapshot: &StudySnapshot, best: Option<TrialId>) -> Option<Figure> {
    let places: HashMap<TrialId, usize> = snapshot.trials.iter().enumerate().map(|(i, trial)| (trial.id, i)).collect();
    let node = |trial: &Trial| Node {
        parent: trial.warm_started_from.and_then(|from| places.get(&from).copied()),
        label: format!("trial {}", trial.number),
        link: format!("/trials/{}", trial.id),
        class: if best == Some(trial.id) { "best" } else { trial.state.as_str() },
    };
    let nodes: Vec<Node> = snapshot.trials.iter().map(node).collect();
    let title = format!("Warm starts of {}", snapshot.study.plan.name);
    nodes.iter().any(|node| node.parent.is_some()).then(|| Figure::tree(Tree { title, nodes }))
}

/// Answers of users and subjects, newest first. Those of Gait RMSE follow from the table of trials.
fn answers(snapshot: &StudySnapshot, assessments: &[Assessment]) -> Vec<AnswerRow> {
    let of_assessment = |id| assessments.iter().any(|assessment| assessment.feedback_id == Some(id));
    let by_people = |row: &&FeedbackRow| !matches!(row.source, Source::GaitRmse | Source::Convergence);
    let why = |retraction: &Option<Retraction>| Some(format!("retracted: {}", retraction.as_ref()?.reason));
    let lifted = |id| {
        let of_it = |closed: &&Closed| closed.source == SafetyReportSource::Staff(id);
        let review = snapshot.grounds.safety_reports.lifted.iter().find(of_it)?.review.as_ref()?;
        Some(format!("cleared for walking by {}: {}", review.author, review.reason))
    };
    let preference = |row: &FeedbackRow| {
        Some(AnswerRow {
            text: answer_in_words(row, snapshot)?,
            by: format!("{}, {}", format::source(row), row.author),
            note: row.note.clone(),
            undone: why(&row.retraction),
            saved: (row.retraction.is_none() && !row.by_rater).then(|| row.id.to_string()),
            at: row.created_at,
        })
    };
    let assessment = |assessment: &Assessment| {
        Some(AnswerRow {
            text: assessment_in_words(assessment, snapshot)?,
            by: format!("{}, {}", format::source_name(assessment.source), assessment.author),
            note: assessment.note.clone(),
            undone: why(&assessment.retraction).or_else(|| lifted(assessment.id)),
            saved: (assessment.retraction.is_none() && !assessment.answer.is_about_safety())
                .then(|| format!("assessment-{}", assessment.id)),
            at: assessment.created_at,
        })
    };
    let preferences = snapshot.feedback.iter().filter(by_people).filter(|row| !of_assessment(row.id));
    let mut rows: Vec<AnswerRow> =
        preferences.filter_map(preference).chain(assessments.iter().filter_map(assessment)).collect();
    rows.reverse();
    rows.sort_by_key(|row| Reverse(row.at));
    rows
}

/// `trial 3 is better than trial 2`.
pub(super) fn answer_in_words(row: &FeedbackRow, snapshot: &StudySnapshot) -> Option<String> {
    let name = |id| snapshot.trial(id).map(|trial| format!("trial {}", trial.number));
    match row.content {
        FeedbackContent::Preference { winner, loser } => {
            Some(format!("{} is better than {}", name(winner)?, name(loser)?))
        }
        FeedbackContent::Tie { a, b } => Some(format!("no difference between {} and {}", name(a)?, name(b)?)),
        FeedbackContent::Label { .. } | FeedbackContent::Suggestion { .. } => None,
    }
}

/// `trial 3 is unsafe`.
pub(super) fn assessment_in_words(assessment: &Assessment, snapshot: &StudySnapshot) -> Option<String> {
    let name = |id| snapshot.trial(id).map(|trial| format!("trial {}", trial.number));
    let (first, second) = (name(assessment.first)?, name(assessment.second)?);
    Some(match assessment.answer {
        presentations::Judgement::UnsafeFirst => format!("{first} is unsafe (compared with {second})"),
        presentations::Judgement::UnsafeSecond => format!("{second} is unsafe (compared with {first})"),
        presentations::Judgement::UnsafeBoth => format!("{first} and {second} are unsafe"),
        _ => format!("cannot tell whether {first} or {second} is better"),
    })
}

/// Why the next solve of the study has not started, from the numbers of queued and running solves of all studies.
fn waits_for_a_worker((queued, running): (u32, u32)) -> String {
    let solves = |count: u32| if count == 1 { "1 solve".to_owned() } else { format!("{count} solves") };
    match (running, queued.saturating_sub(1)) {
        (0, _) => "The next solve is queued. No worker is running.".to_owned(),
        (_, 0) => format!("The next solve is queued. Running: {} of other studies.", solves(running)),
        (_, others) => {
            format!("The next solve is queued. Running: {} of other studies; queued: {} more.", solves(running), others)
        }
    }
}

/// The expected remaining time of the study, from the median of its own solves.
fn pace(snapshot: &StudySnapshot, counts: TrialCounts) -> String {
    let study = &snapshot.study;
    if study.state != StudyState::Running {
        return String::new();
    }
    let mut seconds: Vec<f64> = snapshot.trials.iter().filter_map(|trial| trial.seconds_total).collect();
    seconds.sort_by(f64::total_cmp);
    let Some(median) = seconds.get(seconds.len() / 2) else {
        if counts.results() > 0 || study.plan.evaluation == Evaluation::Script {
            return String::new();
        }
        return "The first trial has a cold start and takes the longest, up to a minute.".to_owned();
    };
    let left = study.plan.trial_budget.saturating_sub(counts.results());
    let people = format::besides_solves(study.plan.feedback_mode);
    format!("About {} left{people}.", format::duration(median * f64::from(left)))
}

/// Group of the figures that show the progress of a study.
pub(super) const COURSE: &str = "course";

/// Gait RMSE of the best action by iteration, for one study with its trials or for several studies; `None` before the first
/// converged trial.
pub(super) fn course(studies: &[(&StudySnapshot, &Figures)]) -> Option<Chart> {
    let title = "Gait RMSE of the best action by iteration";
    let mut chart = Chart::new(title, "iteration (in order of the results)", "Gait RMSE, rad");
    if let [(snapshot, figures)] = studies {
        chart = chart.with("trial", 7, Stroke::Points, converged(snapshot));
        chart = chart.with("best action so far", 0, Stroke::Steps, figures.course());
    } else {
        for (place, (snapshot, figures)) in studies.iter().enumerate() {
            let stroke = if place == 0 { Stroke::Steps } else { Stroke::DashedSteps };
            chart = chart.with(&snapshot.study.plan.name, place, stroke, figures.course());
        }
    }
    chart.whole_x = true;
    (!chart.legend().is_empty()).then_some(chart)
}

/// Gait RMSE of each converged trial by iteration.
fn converged(snapshot: &StudySnapshot) -> Vec<(f64, f64)> {
    history::results(snapshot)
        .into_iter()
        .zip(1_u32..)
        .filter(|(trial, _)| trial.state == TrialState::Converged)
        .filter_map(|(trial, iteration)| Some((f64::from(iteration), trial.gait_rmse_rad?)))
        .collect()
}
