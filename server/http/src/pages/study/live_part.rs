//! The part of the study page that changes while the study runs.

use super::answers_table::{AnswerRow, answers};
use super::best_gait::{BestFindings, BestGait};
use super::recommended_walker::RecommendedGait;
use super::state_buttons::{TransitionButton, TransitionForm, button};
use super::time_left::time_left;
use super::trials_table::{TrialRow, TrialsQuery, TrialsTable};
use super::without_gait::TrialsWithoutGait;
use crate::AppState;
use crate::bound_units::ANGLES;
use crate::figures::{PROGRESS, StudyOutcome, progress_chart, utility, warm_starts};
use crate::format;
use crate::pages::certainty::certainty;
use crate::pages::page_chart::PageChart;
use crate::refused_fields::{RefusedFields, TypedForm};
use askama::Template;
use gait_learner::LearnerError;
use gaitwright_charts::Figure;
use gaitwright_charts::gait_charts;
use gaitwright_compute::OnPool;
use gaitwright_service::access::{Caller, RequiredRight, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::actions_with_known_gait::never_active;
use gaitwright_service::studies::analysis::{Analyses, too_large_to_wait};
use gaitwright_service::studies::certified_best;
use gaitwright_service::studies::lifecycle::{self, StudyTransition, transitions_for_people};
use gaitwright_service::studies::reported_gait::ReportedGait;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_service::workers::Track;
use gaitwright_store::studies::{AnswerSource, Study, StudyState};
use gaitwright_store::trials::{Trial, TrialCounts, TrialState};
use gaitwright_store::{Instant, StudyId, TrialId, assessments, explanations, feedback, solve_jobs, studies, trials};
use std::sync::Arc;

/// The part that changes while the study runs.
#[derive(Template)]
#[template(path = "study_live.html")]
pub(super) struct Live {
    study: Study,
    state: String,
    transitions: Vec<TransitionButton>,
    /// Whether it can be stopped.
    may_run: bool,
    may_stop: bool,
    /// Whether it has ended and can get more trials.
    may_extend: bool,
    /// The number of trials in the form that extends the study: as typed, or a suggestion.
    pub(super) number_of_trials: String,
    /// Why that form or a button was refused.
    pub(super) refused: RefusedFields,
    pub(super) counts: TrialCounts,
    /// Why trials have no gait.
    without_gait: Option<TrialsWithoutGait>,
    /// The bounds that were active in no gait so far; empty if none or unknown.
    never_active: String,
    /// Number of results, and number of planned trials.
    progress: [String; 2],
    /// Expected remaining time; empty unless the study runs.
    pace: String,
    /// Why the next solve has not started; empty if one runs.
    queued: String,
    running: Vec<RunningRow>,
    best: Option<BestGait>,
    /// How sure the recommendation is; `None` without one, and for a large study.
    certainty: Option<String>,
    /// The recommended gait, or its place.
    pub(super) walker: RecommendedGait,
    unanswered: bool,
    /// Whether only people answer comparisons.
    people_answer: bool,
    /// The utility of the recommended gait over the answers of people.
    utility: Option<PageChart>,
    /// Gait RMSE of the best action by iteration.
    chart: Option<PageChart>,
    table: TrialsTable,
    /// Warm-start tree.
    tree: Option<PageChart>,
    answers: Vec<AnswerRow>,
    unsafe_gaits: Vec<UnsafeGait>,
    comparison_pending: bool,
    /// The trial whose certificate the next comparison waits for.
    comparison_after: Option<(TrialId, u32)>,
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
        self.unsafe_gaits.is_empty() && !self.comparison_pending && self.study.state.has_ended()
    }

    /// Whether the study finished with all its trials, as the numbers of trials say already.
    fn has_every_result(&self) -> bool {
        self.study.state == StudyState::Finished && self.counts.results() >= self.study.plan.number_of_trials
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

pub(super) struct RunningRow {
    pub(super) id: TrialId,
    pub(super) number: u32,
    pub(super) text: String,
    pub(super) chart: Option<PageChart>,
}

/// A gait that was reported as unsafe.
struct UnsafeGait {
    id: TrialId,
    number: u32,
    by: String,
    at: Instant,
    note: String,
    /// Whether staff reviewed the report and kept the gait unsafe.
    reviewed: bool,
}

/// How many of the newest trials of a large study the chart shows.
const SHOWN: u32 = 200;
/// How many of the newest answers the list shows.
const ANSWERS: usize = 50;

pub(super) async fn read_live(
    app: &mut AppState,
    caller: &Caller,
    id: StudyId,
    choice: TrialsQuery,
) -> Result<Live, Error> {
    let mut reader = app.read().await?;
    let study = studies::get(&mut reader, id).await?;
    let counts = trials::counts(&mut reader, id).await?;
    let answer_count = feedback::count(&mut reader, id).await? as usize;
    let large = too_large_to_wait(counts.total as usize, answer_count).is_some();
    let snapshot = if large {
        StudySnapshot::newest(&mut reader, study, SHOWN).await?
    } else {
        StudySnapshot::read(&mut reader, study).await?
    };
    let shown = choice.shown.clone();
    let table = TrialsTable::read(&mut reader, id, counts, choice).await?;
    let assessments = assessments::of_study(&mut reader, id).await?;
    drop(reader);
    let analyses = Arc::clone(&app.analyses);
    let draw = move |pool: &OnPool| {
        let outcome = learned(pool, &snapshot, large, &analyses);
        (snapshot, outcome)
    };
    let (snapshot, learned) = app.compute(draw).await?;
    let Learned { outcome, certainty, utility } = learned.map_err(Error::Learner)?;
    let mut reader = app.read().await?;
    let certification = certified_best::of_ranking(&mut reader, &outcome.ranking).await?;
    let mut without_gait = TrialsWithoutGait::of(&snapshot.trials, &explanations::in_common(&mut reader, id).await?);
    if let Some(without) = without_gait.as_mut().filter(|_| counts.converged == 0) {
        let explained = explanations::find(&mut reader, without.instance.0).await?;
        without.conflict = explained.and_then(|made| made.explanation.headline(ANGLES)).unwrap_or_default();
    }
    let mut best = BestFindings::read(&mut reader, outcome.best, certification).await?;
    let earlier = trials::measured(&mut reader, snapshot.study.plan.muscles).await?;
    drop(reader);
    if let Some(next) = best.certification.without_certificate {
        best.certification.certified_by_service(app.scheduler.is_certifying(id, next));
    }
    let running = snapshot
        .trials
        .iter()
        .filter(|trial| trial.state == TrialState::Running)
        .map(|trial| running_row(trial, app.scheduler.running_solves().track(trial.id).as_ref()))
        .collect();
    let mut answers = answers(&snapshot, &assessments);
    answers.truncate(ANSWERS);
    let is_queued = snapshot.trials.iter().any(|trial| trial.state == TrialState::Queued);
    let found = StudyFindings { outcome, certainty, utility, best, without_gait };
    let pace = time_left(&snapshot, counts.results(), app.scheduler.workers(), earlier);
    // A large study shows only its newest trials, so whether a bound was ever active is unknown.
    let inactive = if large { Vec::new() } else { never_active(&snapshot) };
    let mut live = view(snapshot, counts, found, running, table, answers, caller.may(Run::NEEDED));
    live.never_active = inactive.join(", ");
    live.pace = pace;
    let best = live.best.as_ref().map(|best| (best.id, best.number, best.has_gait));
    live.walker = RecommendedGait::read(app, &live.study, best, &shown).await?;
    if live.running.is_empty() && is_queued && live.study.state == StudyState::Running {
        live.queued = waits_for_a_worker(solve_jobs::depth_of_others(&mut *app.read().await?, id).await?);
    }
    Ok(live)
}

/// Results of the learner for a study.
struct Learned {
    outcome: StudyOutcome,
    certainty: Option<String>,
    utility: Option<Figure>,
}

fn learned(pool: &OnPool, snapshot: &StudySnapshot, large: bool, analyses: &Analyses) -> Result<Learned, LearnerError> {
    let outcome = StudyOutcome::of(pool, snapshot, large, analyses)?;
    if large || outcome.best.is_none() {
        return Ok(Learned { outcome, certainty: None, utility: None });
    }
    let certainty = certainty(snapshot, &*analyses.of(pool, snapshot)?);
    Ok(Learned { outcome, certainty, utility: utility(pool, snapshot, analyses)? })
}

pub(super) fn running_row(trial: &Trial, track: Option<&Track>) -> RunningRow {
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
            .map(|figure| PageChart::of(&figure, &format!("/api/v1/trials/{}/figures", trial.id), "")),
    }
}

/// The results of a study, and what is known of its best gait.
struct StudyFindings {
    outcome: StudyOutcome,
    certainty: Option<String>,
    utility: Option<Figure>,
    best: BestFindings,
    without_gait: Option<TrialsWithoutGait>,
}

fn view(
    snapshot: StudySnapshot,
    counts: TrialCounts,
    found: StudyFindings,
    running: Vec<RunningRow>,
    table: TrialsTable,
    answers: Vec<AnswerRow>,
    may_run: bool,
) -> Live {
    let StudyFindings { outcome, certainty, utility, best, without_gait } = found;
    let best = outcome.best.and_then(|id| snapshot.trial(id)).map(|trial| best.of(trial, &snapshot));
    let unsafe_gait = |report: &ReportedGait| {
        let number = snapshot.trial(report.trial)?.number;
        let reviewed = report.review.is_some();
        Some(UnsafeGait {
            id: report.trial,
            number,
            by: report.by.clone(),
            at: report.at,
            note: report.note.clone(),
            reviewed,
        })
    };
    let unsafe_gaits = snapshot.grounds.safety_reports.in_force.iter().filter_map(unsafe_gait).collect();
    let converged = snapshot.trials.iter().filter(|trial| trial.state == TrialState::Converged).count();
    let files = format!("/api/v1/studies/{}/figures", snapshot.study.id);
    let transitions = if may_run { transitions_for_people(snapshot.study.state) } else { Vec::new() };
    Live {
        state: lifecycle::in_words(snapshot.study.state).to_owned(),
        may_run,
        may_stop: transitions.contains(&StudyTransition::Stop),
        may_extend: transitions.contains(&StudyTransition::Extend),
        number_of_trials: (snapshot.study.plan.number_of_trials + 5).to_string(),
        refused: RefusedFields::default(),
        transitions: transitions.into_iter().filter_map(button).collect(),
        pace: String::new(),
        queued: String::new(),
        without_gait,
        never_active: String::new(),
        progress: [counts.results(), snapshot.study.plan.number_of_trials].map(format::count),
        counts,
        running,
        best,
        certainty,
        walker: RecommendedGait::None,
        unanswered: outcome.unanswered,
        people_answer: snapshot.study.plan.answer_source == AnswerSource::People,
        utility: utility.map(|figure| PageChart::of(&figure, &files, "")),
        chart: progress_chart(&[(&snapshot, &outcome)])
            .map(|chart| PageChart::of(&Figure::chart(PROGRESS, chart), &files, "")),
        table,
        tree: warm_starts(&snapshot, outcome.best, Live::BRANCHES).map(|figure| PageChart::of(&figure, &files, "")),
        answers,
        unsafe_gaits,
        comparison_pending: outcome.comparison_pending,
        comparison_after: outcome
            .comparison_after
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
        (_, 0) => format!("The next solve is queued. Other studies have {} running.", solves(running)),
        (_, others) => {
            format!("The next solve is queued. Other studies have {} running and {others} queued.", solves(running))
        }
    }
}
