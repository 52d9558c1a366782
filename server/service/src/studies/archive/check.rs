//! Checks an imported archive: every value by the rules that apply when people enter it, and every derived figure by
//! computing it again.

use super::file::refuse;
use crate::access::Reach;
use crate::error::Error;
use crate::printable;
use crate::studies::comparison::by_gait_rmse;
use crate::studies::lab::EmgResult;
use crate::studies::{device, lab, reference_import, search_space, solve_input, study_plan, subject, trial_state};
use gait_optimizer::solve::CONVERGED_VIOLATION;
use gait_optimizer::walking::progress_error_m;
use gait_optimizer::{Gait, GaitFigures, ReferenceGait, WarmStart};
use gaitwright_compute::{OnPool, Pool};
use gaitwright_store::archive::Definition;
use gaitwright_store::archived_row::{Cell, Row};
use gaitwright_store::feedback::{FeedbackContent, FeedbackRow, Source};
use gaitwright_store::lab_sessions::LabSession;
use gaitwright_store::quarantine::Quarantine;
use gaitwright_store::studies::{Chosen, FeedbackMode, Study, StudyPlan};
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{
    Connection, FeedbackId, Instant, SafetyReportId, StoreError, StudyId, TrialId, archive, assessments, devices,
    feedback, gaits, lab_sessions, measurement_files, now, presentations, reference_gaits, results, safety_reports,
    safety_reviews, studies, subjects, trials,
};
use std::collections::{HashMap, HashSet};
use std::sync::Arc;
use uuid::Uuid;

/// Columns that the modules of their tables parse and check.
const READ_BY_NOUN: [&str; 12] = [
    "definition",
    "gait_settings",
    "solve_options",
    "base_bounds",
    "search_space",
    "learner",
    "action",
    "report",
    "violations",
    "reading",
    "document",
    "status",
];
/// Maximum length of any other text, characters. Longer than any note.
const LONGEST_TEXT: usize = 20_000;
/// Tolerance for the difference between the clocks of two machines, s.
const CLOCKS_DIFFER_S: i64 = 600;
/// Tolerance for the hip position that follows from the durations of a converged gait, m: ten times that of a row. The
/// certificate cannot check the duration of SS1, because the closed loop has no clock there.
const HIP_PROGRESS_M: f64 = 1e-5;

/// Checks a row by itself: text is printable, times have passed, identifiers are well-formed.
pub(super) fn cells(table: &str, row: &Row) -> Result<(), Error> {
    for (column, cell) in row.cells() {
        let Cell::Text(text) = cell else { continue };
        let field = format!("{table}.{column}");
        if READ_BY_NOUN.contains(&column) {
            continue;
        }
        printable::note(&field, text, LONGEST_TEXT).map_err(refuse)?;
        if matches!(column, "author" | "rater") && printable::name(&field, text, 80).map_err(refuse)? != text {
            return Err(refuse(format!("{field} is {text:?}, which has leading or trailing spaces")));
        }
        if column == "id" || column.ends_with("_id") {
            let is_written_so = Uuid::parse_str(text).is_ok_and(|id| id.hyphenated().to_string() == *text);
            if !is_written_so {
                return Err(refuse(format!("{field} is {text:?}, which is not an identifier")));
            }
        } else if column.ends_with("_at") || column.ends_with("_until") {
            let at: Instant = text.parse().map_err(|_| refuse(format!("{field} is {text:?}, which is not a time")))?;
            if at > now().plus_seconds(CLOCKS_DIFFER_S) && column != "lease_until" {
                return Err(refuse(format!(
                    "{field} is {text}, which is in the future. Correct the clock of this machine, or import the archive after \
                     that time"
                )));
            }
        }
    }
    Ok(())
}

/// The result of the checks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Checked {
    /// The study.
    pub(super) study: StudyId,
    /// Number of trials whose Gait RMSE could not be computed again.
    pub(super) unchecked_rmse: u32,
}

/// The study data that trials must agree with.
struct Context {
    study: Study,
    body: gait_optimizer::Subject,
    device: gait_optimizer::Device,
    reference: ReferenceGait,
}

/// Adds to an error where it occurred.
fn at<T, E: std::fmt::Display>(what: impl std::fmt::Display, result: Result<T, E>) -> Result<T, Error> {
    result.map_err(|error| refuse(format!("{what}: {error}")))
}

/// Checks everything in quarantine.
pub(super) async fn study(quarantine: &mut Quarantine, pool: &Pool) -> Result<Checked, Error> {
    if let Some(parent) = quarantine.forked_from() {
        at("studies.forked_from", parent.parse::<StudyId>().map_err(|_| format!("{parent:?} is not an identifier")))?;
    }
    let db = quarantine.db();
    let found = at("studies", studies::page(db, Reach::Every, Chosen::newest(2)).await)?;
    let [study] = &found[..] else { return Err(refuse(format!("it has {} studies instead of one", found.len()))) };
    let study = study.clone();
    at(format!("study {}", study.id), study_plan::check_plan(&study.plan))?;

    let subject = at("subject", subjects::get(db, study.plan.subject_id).await)?;
    if at("subjects", subjects::all(db).await)?.len() != 1 {
        return Err(refuse("it has subjects that do not belong to its study"));
    }
    at(
        format!("subject {}", subject.id),
        subject::check(&subject.pseudonym, subject.height_m, subject.body_mass_kg, &subject.notes),
    )?;
    let device = at("device", devices::get(db, study.plan.device_id).await)?.definition;
    at("device", device::check(&device))?;
    of_definition("devices", &device.name, &at("devices", archive::definition(db, "devices").await)?)?;
    let reference = at("reference gait", reference_gaits::get(db, study.plan.reference_gait_id).await)?.definition;
    at("reference gait", reference_import::check(&reference))?;
    let written = at("reference_gaits", archive::definition(db, "reference_gaits").await)?;
    of_definition("reference_gaits", &reference.name, &written)?;

    let id = study.id;
    let body = at("subject", solve_input::body_of(db, &study.plan).await)?;
    let context = Arc::new(Context { study, body, device, reference });
    let trials = at("trials", trials::of_study(db, id).await)?;
    let mut unchecked_rmse = 0;
    let mut earlier = HashSet::new();
    for (place, trial) in trials.iter().enumerate() {
        let what = format!("trial {} ({})", trial.number, trial.id);
        if trial.number as usize != place + 1 {
            return Err(refuse(format!("{what} should have number {}", place + 1)));
        }
        for (column, other) in [("best_before", trial.best_before), ("warm_started_from", trial.warm_started_from)] {
            if other.is_some_and(|other| !earlier.contains(&other)) {
                return Err(refuse(format!("{what}: {column} is not an earlier trial")));
            }
        }
        earlier.insert(trial.id);
        at(&what, figures(trial, &context.study.plan))?;
        let has_gait = at(&what, gait(db, pool, trial, &context).await)?;
        unchecked_rmse += u32::from(trial.gait_rmse_rad.is_some() && !has_gait);
        at(&what, brought(db, trial).await)?;
    }
    if let Some(number) = at("jobs", archive::trial_unlike_its_job(db).await)? {
        return Err(refuse(format!("trial {number}: its state contradicts its job")));
    }
    let by_id: HashMap<TrialId, &Trial> = trials.iter().map(|trial| (trial.id, trial)).collect();
    let sessions = lab(db, pool, id, &by_id).await?;
    answers(db, &context.study, &by_id, (subject.pseudonym.as_str(), &sessions[..])).await?;
    Ok(Checked { study: id, unchecked_rmse })
}

/// Checks a definition against its stored name and hash.
fn of_definition(table: &str, name: &str, written: &Definition) -> Result<(), Error> {
    if written.name != name || written.sha256 != gaitwright_store::sha256(written.text.as_bytes()) {
        return Err(refuse(format!("{table}: name, definition and hash do not match")));
    }
    Ok(())
}

/// Checks an action, and the figures of a trial against its state and its report.
fn figures(trial: &Trial, plan: &StudyPlan) -> Result<(), String> {
    if trial.action_index.0 >= plan.search_space.len() {
        return Err(format!("action_index {} is not in the search space", trial.action_index.0));
    }
    let action = search_space::bounds_of(&plan.search_space, plan.base_bounds, trial.action_index);
    if action.map_err(|e| e.to_string())? != trial.action {
        return Err("the action does not match its index".to_owned());
    }
    let figures = [trial.gait_rmse_rad, trial.cost_of_transport, trial.max_violation, trial.seconds_total];
    if figures.iter().flatten().any(|figure| !figure.is_finite() || *figure < 0.0) {
        return Err("a figure is negative or not finite".to_owned());
    }
    if trial.asked_by.is_some() || !trial.state.is_result() {
        let none = trial.report.is_none() && trial.status.is_none();
        return if none { Ok(()) } else { Err("a trial without a solve has a solve report".to_owned()) };
    }
    let state = trial.status.and_then(trial_state::result_of);
    if state != Some(trial.state) {
        return Err(format!("status {:?} contradicts the state {}", trial.status, trial.state.as_str()));
    }
    let Some(report) = &trial.report else {
        return if trial.state == TrialState::Converged {
            Err("the solve report is missing".to_owned())
        } else {
            Ok(())
        };
    };
    let converged = trial.state == TrialState::Converged;
    let of_gait = |figure: f64| converged.then_some(figure);
    let same = Some(report.status) == trial.status
        && trial.gait_rmse_rad == of_gait(report.gait_rmse_rad)
        && trial.cost_of_transport == of_gait(report.cost_of_transport)
        && trial.objective == Some(report.objective)
        && trial.max_violation == Some(report.max_violation)
        && trial.iterations.is_some_and(|count| count as usize == report.iterations)
        && trial.seconds_total == Some(report.seconds_total);
    if !same {
        return Err("its figures differ from its solve report".to_owned());
    }
    if converged && report.max_violation > CONVERGED_VIOLATION {
        return Err(format!("it is converged, but its violation is {}", report.max_violation));
    }
    Ok(())
}

/// Checks the gait of a trial and computes its Gait RMSE again. Returns whether the trial has a gait.
async fn gait(db: &mut Connection, pool: &Pool, trial: &Trial, context: &Arc<Context>) -> Result<bool, String> {
    let text = |error: StoreError| error.to_string();
    if !gaits::is_here(db, trial.id).await.map_err(text)? {
        return Ok(false);
    }
    if trial.asked_by.is_some() || !trial.state.is_result() {
        return Err("it has a gait but no solve".to_owned());
    }
    let gait = gaits::get(db, trial.id).await.map_err(text)?;
    let warm_start = gaits::warm_start(db, trial.id).await.map_err(text)?;
    let iterations = gaits::iterations(db, trial.id).await.map_err(text)?;
    let (trial, context) = (trial.clone(), Arc::clone(context));
    let id = trial.id;
    let checked = move |pool: &OnPool| {
        let gait = gait.unpack(pool).map_err(text)?;
        let warm_start = warm_start.unpack(pool).map_err(text)?;
        iterations.unpack(pool).map_err(text)?;
        solved(&trial, &context, &gait, &warm_start)?;
        Ok::<_, String>(gait)
    };
    let gait = pool.run(checked).await.map_err(|e| e.to_string())??;
    if !gaits::is_described(db, id, &gait).await.map_err(text)? {
        return Err("its gait does not match its row".to_owned());
    }
    Ok(true)
}

/// Checks the stored outcome of a solve against its trial.
fn solved(trial: &Trial, context: &Context, gait: &Gait, warm_start: &WarmStart) -> Result<(), String> {
    gait.validate().map_err(|e| e.to_string())?;
    if gait.subject != context.body {
        return Err("its gait belongs to a subject with a different height or body mass".to_owned());
    }
    let plan = &context.study.plan;
    if gait.device != context.device
        || gait.muscles != plan.muscles
        || gait.settings != *plan.gait_settings
        || gait.bounds != trial.action
    {
        return Err("its gait belongs to another device, problem or action".to_owned());
    }
    if warm_start.muscles != plan.muscles || warm_start.mesh != plan.gait_settings.mesh {
        return Err("its warm start belongs to another problem".to_owned());
    }
    same_figures(trial, gait, &context.reference)?;
    if trial.state == TrialState::Converged {
        let error = progress_error_m(gait).map_err(|e| e.to_string())?;
        let follows = error <= HIP_PROGRESS_M;
        if !follows {
            return Err(format!("the durations of its gait do not match its motion: the hip is off by {error:.1e} m"));
        }
    }
    Ok(())
}

/// Checks every stated figure that the gait determines. Safety reports recognise a motion by these figures.
fn same_figures(trial: &Trial, gait: &Gait, reference: &ReferenceGait) -> Result<(), String> {
    let Some(report) = &trial.report else { return Ok(()) };
    let anew = GaitFigures::of(gait, reference).map_err(|e| e.to_string())?;
    match GaitFigures::stated_in(report).difference(&anew) {
        Some((name, stated, anew)) => {
            Err(format!("its stated {name} is {stated}, but computed from its gait it is {anew}"))
        }
        None => Ok(()),
    }
}

/// Checks the results that workers delivered for a trial.
async fn brought(db: &mut Connection, trial: &Trial) -> Result<(), String> {
    let results = results::of_trial(db, trial.id).await.map_err(|e| e.to_string())?;
    let mut taken = results.iter().filter(|result| result.taken);
    let Some(result) = taken.next() else { return Ok(()) };
    if taken.next().is_some() {
        return Err("two results were accepted".to_owned());
    }
    if Some(result.status) != trial.status || result.report != trial.report {
        return Err("its result differs from the accepted one".to_owned());
    }
    Ok(())
}

/// Checks the feedback log, assessments, presentations and safety reviews. The subject answers each lab session.
async fn answers(
    db: &mut Connection,
    study: &Study,
    trials: &HashMap<TrialId, &Trial>,
    (subject, sessions): (&str, &[LabSession]),
) -> Result<(), Error> {
    let id = study.id;
    let rows = at("feedback", feedback::of_study(db, id, 0).await)?;
    let noted = at("assessments", assessments::of_study(db, id).await)?;
    // Whoever has answered may still report a gait as unsafe.
    let of_reports: HashSet<FeedbackId> = noted.iter().filter_map(|assessment| assessment.feedback_id).collect();
    let mut labelled = 0;
    let mut answered: HashMap<_, usize> = HashMap::new();
    for row in &rows {
        let what = format!("feedback {} ({})", row.seq, row.id);
        at(&what, heard(row, study, trials))?;
        labelled += usize::from(matches!(row.content, FeedbackContent::Label { .. }));
        let Some(compared) = pair(&row.content).filter(|_| is_of_person(row) && !of_reports.contains(&row.id)) else {
            continue;
        };
        let author = printable::person(&row.author);
        let walked = sessions.iter().filter(|session| sorted(session.gait_one, session.gait_two) == compared).count();
        let most = if author == printable::person(subject) { 1 + walked } else { 1 };
        let count = answered.entry((compared, author)).or_default();
        *count += 1;
        if *count > most {
            return Err(refuse(format!("{what}: {} has answered this comparison already", row.author)));
        }
    }
    let results = trials.values().filter(|trial| trial.state.is_result()).count();
    if labelled != results {
        return Err(refuse(format!("{results} trials have a result, but {labelled} have a label")));
    }
    let pairs: HashMap<_, _> = rows.iter().filter_map(|row| Some((row.id, pair(&row.content)?))).collect();
    for assessment in &noted {
        let what = format!("assessment {}", assessment.id);
        at(&what, of_gaits(trials, [assessment.first, assessment.second]))?;
        let compared = [assessment.first, assessment.second].map(|id| trials.get(&id).copied());
        if let [Some(first), Some(second)] = compared {
            at(&what, after_both(assessment.created_at, [first, second]))?;
        }
        let wanted = sorted(assessment.first, assessment.second);
        if assessment.feedback_id.is_some_and(|heard| pairs.get(&heard) != Some(&wanted)) {
            return Err(refuse(format!("{what}: the preference derived from it is about other trials")));
        }
    }
    let mut reports: HashSet<SafetyReportId> = HashSet::new();
    reports.extend(
        noted.iter().filter(|assessment| assessment.answer.is_about_safety()).map(|a| SafetyReportId::from(a.id)),
    );
    for shown in at("presentations", presentations::of_study(db, id).await)? {
        at(format!("presentation {}", shown.id), of_gaits(trials, [shown.one, shown.other]))?;
        reports.extend(
            shown.answer.filter(|judgement| judgement.is_about_safety()).map(|_| SafetyReportId::from(shown.id)),
        );
    }
    reports.extend(at("safety_reports", safety_reports::of_study(db, id).await)?.iter().map(|report| report.id));
    let has_report = |session: &&LabSession| session.answers.iter().any(|answer| answer.judgement.is_about_safety());
    reports.extend(sessions.iter().filter(has_report).map(|session| SafetyReportId::from(session.id)));
    for review in at("safety_reviews", safety_reviews::of_study(db, id).await)? {
        let what = format!("safety review {}", review.id);
        at(&what, of_gaits(trials, [review.trial_id]))?;
        if let Some(unknown) = review.reports.iter().find(|report| !reports.contains(report)) {
            return Err(refuse(format!("{what}: the archive has no safety report {unknown}")));
        }
    }
    Ok(())
}

/// A standing answer that a person gave once: raters are asked again.
fn is_of_person(row: &FeedbackRow) -> bool {
    matches!(row.source, Source::Subject | Source::Clinician | Source::Script)
        && !row.by_rater
        && row.retraction.is_none()
}

/// Checks that comparisons are about gaits of the study.
fn of_gaits<const N: usize>(trials: &HashMap<TrialId, &Trial>, asked: [TrialId; N]) -> Result<(), String> {
    match asked.iter().find(|id| trials.get(*id).is_none_or(|trial| trial.state != TrialState::Converged)) {
        Some(id) => Err(format!("trial {id} is not a converged trial of this study")),
        None => Ok(()),
    }
}

fn sorted(a: TrialId, b: TrialId) -> (TrialId, TrialId) {
    if a < b { (a, b) } else { (b, a) }
}

fn pair(content: &FeedbackContent) -> Option<(TrialId, TrialId)> {
    match *content {
        FeedbackContent::Preference { winner, loser } => Some(sorted(winner, loser)),
        FeedbackContent::Tie { a, b } => Some(sorted(a, b)),
        FeedbackContent::Label { .. } | FeedbackContent::Suggestion { .. } => None,
    }
}

/// Checks that an answer is not older than what it compares.
fn after_both(answered_at: Instant, compared: [&Trial; 2]) -> Result<(), String> {
    match compared.iter().find(|trial| trial.created_at > answered_at) {
        Some(trial) => Err(format!("it is from {answered_at}, before trial {} was planned", trial.number)),
        None => Ok(()),
    }
}

/// Checks a row of the feedback log against the trials that it names.
fn heard(row: &FeedbackRow, study: &Study, trials: &HashMap<TrialId, &Trial>) -> Result<(), String> {
    let trial =
        |id: TrialId| trials.get(&id).copied().ok_or_else(|| format!("trial {id} does not belong to this study"));
    match row.content {
        FeedbackContent::Label { trial: id, category } => {
            let state = trial(id)?.state;
            let converged = state == TrialState::Converged;
            if !state.is_result() || category != u32::from(converged) {
                return Err(format!("category {category} does not match the trial state {}", state.as_str()));
            }
            if !matches!(row.source, Source::Convergence | Source::Script) {
                return Err(format!("the source of a label is {}", row.source.as_str()));
            }
        }
        FeedbackContent::Preference { winner: a, loser: b } | FeedbackContent::Tie { a, b } => {
            let (a, b) = (trial(a)?, trial(b)?);
            after_both(row.created_at, [a, b])?;
            if a.state != TrialState::Converged || b.state != TrialState::Converged {
                return Err("it compares a trial that did not converge".to_owned());
            }
            match row.source {
                Source::Convergence => return Err("the source of a preference is convergence".to_owned()),
                Source::GaitRmse => {
                    if study.plan.feedback_mode == FeedbackMode::Human {
                        return Err("Gait RMSE answers a comparison in a study where people answer".to_owned());
                    }
                    let (Some(one), Some(other)) = (a.gait_rmse_rad, b.gait_rmse_rad) else {
                        return Err("Gait RMSE compares a trial without a Gait RMSE".to_owned());
                    };
                    let expected = by_gait_rmse((a.id, one), (b.id, other));
                    if pair(&expected) != pair(&row.content)
                        || std::mem::discriminant(&expected) != std::mem::discriminant(&row.content)
                        || matches!((expected, row.content), (FeedbackContent::Preference { winner, .. }, FeedbackContent::Preference { winner: told, .. }) if winner != told)
                    {
                        return Err("the preference contradicts Gait RMSE".to_owned());
                    }
                }
                Source::Subject | Source::Clinician | Source::Script => {}
            }
        }
        FeedbackContent::Suggestion { suggested, over } => {
            trial(over)?;
            if suggested.0 >= study.plan.search_space.len() {
                return Err(format!("action {} is not in the search space", suggested.0));
            }
        }
    }
    Ok(())
}

/// Checks lab sessions and their measurement files.
async fn lab(
    db: &mut Connection,
    pool: &Pool,
    study: StudyId,
    trials: &HashMap<TrialId, &Trial>,
) -> Result<Vec<LabSession>, Error> {
    let sessions = at("lab_sessions", lab_sessions::of_study(db, study).await)?;
    for session in &sessions {
        at(format!("lab session {}", session.id), of_gaits(trials, [session.gait_one, session.gait_two]))?;
        for found in at("measurement_files", measurement_files::of_session(db, session.id).await)? {
            at(format!("measurement file {}", found.id), lab::check_kept(db, pool, &found).await)?;
        }
        let results = measurement_files::results::<EmgResult>(db, session.id).await;
        at(format!("EMG results of lab session {}", session.id), results)?;
    }
    Ok(sessions)
}
