//! The page on which staff and subjects compare two gaits of a study.

use super::compare_answer::{self, AnswerForm, AnswerOutcome, LABELS, RETRACT_LABELS, RetractForm, give};
use super::page_chart::{PageChart, shared_legend};
use super::saved_answer::SavedAnswer;
use super::study::{AnswerRow, answers};
use super::walking_pair::{WalkingGait, walking_pair};
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::extractors::{Form, Params};
use crate::figures::trial;
use crate::form_errors;
use crate::format::source_name;
use crate::page_error::{PageError, PageResult, page};
use crate::problem_details::Problem;
use crate::visible::Visible;
use askama::Template;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Redirect, Response};
use gaitwright_charts::Figure;
use gaitwright_compute::OnPool;
use gaitwright_service::access::{self, Caller, Read};
use gaitwright_service::error::Error;
use gaitwright_service::studies::analysis::MAX_TRIALS_TO_WAIT_FOR;
use gaitwright_service::studies::pending_comparison::{PendingComparison, awaited_comparison};
use gaitwright_service::studies::recorded_answer::RecordedAnswer;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_service::studies::unanswered_pair::{first_without_answer, unanswered_pairs};
use gaitwright_service::studies::undo;
use gaitwright_service::studies::walkable;
use gaitwright_store::feedback::Source;
use gaitwright_store::studies::{Study, StudyState};
use gaitwright_store::{
    AnswerId, Connection, FeedbackId, StudyId, TrialId, assessments, commit, events, gaits, reference_gaits, studies,
    trials,
};
use serde::Deserialize;
use std::str::FromStr;

/// The gaits to compare, and the answer that was just saved.
#[derive(Debug, Default, Deserialize)]
pub(super) struct GaitsQuery {
    a: Option<TrialId>,
    b: Option<TrialId>,
    saved: Option<AnswerId>,
    /// The answer to change; the page shows its comparison.
    change: Option<AnswerId>,
}

#[derive(Template)]
#[template(path = "compare.html")]
struct ComparePage {
    study: Study,
    trials: Vec<OfferedGait>,
    /// The gaits shown: identifier and number.
    a: Option<(TrialId, u32)>,
    b: Option<(TrialId, u32)>,
    charts: Vec<PageChart>,
    /// The legend of all charts.
    legend: Vec<(String, String)>,
    /// Both gaits; empty if they cannot be drawn.
    walking: Vec<WalkingGait>,
    key: FeedbackId,
    saved: Option<SavedAnswer>,
    /// Whether the form changes the saved answer.
    changes: bool,
    /// Whether the study waits for an answer.
    waits: bool,
    /// Whether the visitor chose the gaits.
    is_chosen: bool,
    /// How many gaits can be compared once they are certified.
    being_certified: usize,
    /// Whether the study computes another gait.
    is_going_on: bool,
    last_event: i64,
    typed: AnswerForm,
    /// The signed-in user; empty without sign-in.
    user: String,
    refused: Option<RefusedPair>,
    /// The answers so far, if every pair has one.
    answers: Vec<AnswerRow>,
}

/// Why a form was refused.
struct RefusedPair {
    why: String,
    /// Whether the same answer would be refused again, so that the page does not offer it.
    is_final: bool,
}

impl RefusedPair {
    fn correctable(why: String) -> Self {
        Self { why, is_final: false }
    }
}

impl ComparePage {
    /// Answers under a gait: value, label, keys, and the key that the button shows.
    const BETTER: [(&str, &str, &str, &str); 2] =
        [("a", "First is better", "ArrowLeft 1", "←"), ("b", "Second is better", "ArrowRight 3", "→")];
    /// Answers between the gaits.
    const BETWEEN: [(&str, &str, &str, &str); 2] =
        [("no_difference", "No difference", "2", "2"), ("cannot_tell", "Cannot tell", "", "")];
    /// Safety reports.
    const UNSAFE: [(&str, &str); 3] = [
        ("unsafe_a", "The first gait is unsafe"),
        ("unsafe_b", "The second gait is unsafe"),
        ("unsafe_both", "Both gaits are unsafe"),
    ];

    /// Whether the page asks about its gaits, and does not only say what was saved.
    fn asks(&self) -> bool {
        match &self.refused {
            Some(refused) => !refused.is_final,
            None => self.saved.is_none() || self.changes || self.waits || self.is_chosen,
        }
    }

    /// The gait at a place, if it can be drawn.
    #[allow(clippy::trivially_copy_pass_by_ref)] // templates pass references
    fn gait(&self, place: &usize) -> Option<&WalkingGait> {
        self.walking.get(*place)
    }

    /// Whether a refused form had this answer.
    fn is_given(&self, value: &str) -> bool {
        self.typed.answer == value
    }

    /// The person who answers, in words; empty if nobody is named yet.
    fn person(&self) -> String {
        let source = Source::from_str(&self.typed.source).unwrap_or(Source::Subject);
        match self.typed.author.trim() {
            "" => String::new(),
            author => format!("{}, {author}", source_name(source)),
        }
    }

    /// The person who retracts an answer: the signed-in user, or else its author.
    fn retractor<'a>(&'a self, saved: &'a SavedAnswer) -> &'a str {
        if self.user.is_empty() { &saved.author } else { &self.user }
    }
}

/// A gait that can be compared.
struct OfferedGait {
    id: TrialId,
    number: u32,
    as_a: bool,
    as_b: bool,
}

/// How many trials of a large study are offered.
const OFFERED: u32 = 200;

/// How many of the newest gaits without a certificate are certified when the page is opened.
const CERTIFIED_ON_OPENING: usize = 10;

/// `GET /studies/{id}/compare`.
pub(super) async fn get(
    authorized: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
    Params(choice): Params<GaitsQuery>,
) -> PageResult {
    // The default author is the signed-in user, and the default source is a clinician.
    let mut typed = AnswerForm::default();
    let user = user_of(&authorized.caller);
    if !user.is_empty() {
        (typed.author, typed.source) = (user.clone(), Source::Clinician.as_str().to_owned());
    }
    if choice.a.is_some() && choice.a == choice.b {
        let refused = RefusedPair::correctable(
            "The first and the second gait are the same. Choose two different gaits.".to_owned(),
        );
        return Box::pin(show(&mut app, id, GaitsQuery { a: None, b: None, ..choice }, (user, typed), Some(refused)))
            .await;
    }
    Box::pin(show(&mut app, id, choice, (user, typed), None)).await
}

/// The name of the signed-in user; empty without sign-in.
fn user_of(caller: &Caller) -> String {
    if caller.user.is_some() { caller.name.clone() } else { String::new() }
}

async fn show(
    app: &mut AppState,
    id: StudyId,
    choice: GaitsQuery,
    (user, typed): (String, AnswerForm),
    refused: Option<RefusedPair>,
) -> PageResult {
    let mut reader = app.read().await?;
    let last_event = events::last(&mut reader, id).await?;
    let study = studies::get(&mut reader, id).await?;
    let is_going_on = matches!(study.state, StudyState::Running | StudyState::Waiting);
    let reference = reference_gaits::get(&mut reader, study.plan.reference_gait_id).await?.definition;
    let large = trials::counts(&mut reader, id).await?.total as usize >= MAX_TRIALS_TO_WAIT_FOR;
    let snapshot = if large {
        StudySnapshot::newest(&mut reader, study, OFFERED).await?
    } else {
        StudySnapshot::read(&mut reader, study).await?
    };
    let saved = match choice.change.or(choice.saved) {
        Some(saved) => SavedAnswer::read(&mut reader, &snapshot, saved).await?,
        None => None,
    };
    let (changes, choice, typed) =
        match saved.as_ref().filter(|saved| choice.change.is_some() && saved.may_be_changed()) {
            Some(saved) => {
                let (a, b) = saved.pair.unzip();
                let typed = if refused.is_none() { saved.form() } else { typed };
                (true, GaitsQuery { a, b, ..choice }, typed)
            }
            None => (false, choice, typed),
        };
    let assessments = assessments::of_study(&mut reader, id).await?;
    drop(reader);
    let person = Some(typed.author.trim().to_owned()).filter(|author| !author.is_empty());
    let ask = move |pool: &OnPool| {
        let pending = if large { Ok(PendingComparison::None) } else { awaited_comparison(pool, &snapshot) };
        let unanswered = unanswered_pairs(pool, &snapshot, &assessments, person.as_deref());
        (snapshot, assessments, pending, unanswered, person)
    };
    let (snapshot, assessments, pending, unanswered, person) = app.compute(ask).await.map_err(Error::from)?;
    let pending = pending.map_err(Error::Learner)?.trials();
    let mut reader = app.read().await?;
    let waits = pending.is_some();
    let mut being_certified = 0;
    for trial in
        snapshot.trials.iter().rev().filter(|trial| snapshot.waits_for_certificate(trial)).take(CERTIFIED_ON_OPENING)
    {
        being_certified += usize::from(app.scheduler.certify(trial.id));
    }
    let mut trials: Vec<OfferedGait> = snapshot
        .trials
        .iter()
        .filter(|trial| snapshot.walkable(trial).is_ok())
        .map(|trial| OfferedGait { id: trial.id, number: trial.number, as_a: false, as_b: false })
        .collect();
    // After an undo the gaits come from the answer, and may have been reported as unsafe since.
    if refused.is_none()
        && saved.is_none()
        && let (Some(a), Some(b)) = (choice.a, choice.b)
    {
        walkable::admit_pair(&mut reader, id, ("a", "b"), (a, b)).await?;
    }
    let (a, b) = match (choice.a, choice.b, pending) {
        (Some(a), Some(b), _) => (Some(a), Some(b)),
        (_, _, Some((new, old))) => (Some(old), Some(new)),
        _ => {
            let found = first_without_answer(&mut reader, &snapshot, &unanswered, person.as_deref()).await?;
            found.map(|pair| pair.trials()).unzip()
        }
    };
    let answers = if a.is_none() { answers(&snapshot, &assessments) } else { Vec::new() };
    for trial in &mut trials {
        (trial.as_a, trial.as_b) = (a == Some(trial.id), b == Some(trial.id));
    }
    let a = trials.iter().find(|trial| trial.as_a).map(|trial| (trial.id, trial.number));
    let b = trials.iter().find(|trial| trial.as_b).map(|trial| (trial.id, trial.number));
    let pair = match (a, b) {
        (Some((a, of_a)), Some((b, of_b))) if a != b => {
            let gaits = gaits::find(&mut reader, a).await?.zip(gaits::find(&mut reader, b).await?);
            gaits.map(|(gait_a, gait_b)| ((a, of_a, gait_a), (b, of_b, gait_b)))
        }
        _ => None,
    };
    drop(reader);
    let draw = move |pool: &OnPool| {
        let Some(((a, of_a, gait_a), (b, of_b, gait_b))) = pair else { return Ok((Vec::new(), Vec::new())) };
        let (gait_a, gait_b) = (gait_a.unpack(pool)?, gait_b.unpack(pool)?);
        let (files, query) = (format!("/api/v1/trials/{a}/figures"), format!("?other={b}"));
        let drawn = |figure: &Figure| PageChart::of(figure, &files, &query);
        let charts = trial::pair((of_a, &gait_a), (of_b, &gait_b), &reference).iter().map(drawn).collect();
        let walking = walking_pair([(a, of_a, "First".to_owned(), &gait_a), (b, of_b, "Second".to_owned(), &gait_b)]);
        Ok::<_, Error>((charts, walking.into_iter().flatten().collect()))
    };
    let (mut charts, walking): (Vec<PageChart>, _) = app.compute(draw).await.map_err(Error::from)??;
    page(&ComparePage {
        study: snapshot.study,
        trials,
        a,
        b,
        legend: shared_legend(&mut charts),
        charts,
        walking,
        key: FeedbackId::fresh(),
        saved,
        changes,
        waits,
        is_chosen: choice.a.is_some() && choice.b.is_some(),
        being_certified,
        is_going_on,
        last_event,
        typed,
        user,
        refused,
        answers,
    })
}

/// `POST /studies/{id}/compare`.
pub(super) async fn post(
    authorized: Authorized<access::Answer>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<StudyId, access::Answer>,
    Form(form): Form<AnswerForm>,
) -> Result<Response, PageError> {
    let (saved, status, why) = match give(&app, &authorized.caller, id, &form).await {
        Ok(AnswerOutcome::Saved(saved)) => {
            return Ok(Redirect::to(&format!("/studies/{id}/compare?saved={saved}")).into_response());
        }
        Ok(AnswerOutcome::SameForm(saved)) => {
            let why = "This form was already sent with another answer, shown above. That answer counts; this one was not \
                       saved.";
            (Some(saved), StatusCode::CONFLICT, why.to_owned())
        }
        Ok(AnswerOutcome::AnsweredBefore(saved)) => {
            let why = "You have already answered this comparison, perhaps in another tab or window. Your first answer, shown \
                       above, counts; this one was not saved.";
            (Some(saved), StatusCode::CONFLICT, why.to_owned())
        }
        Err(error @ (Error::Invalid(_) | Error::Conflict(_))) => {
            (None, Problem::from(&error).status(), form_errors::of_form(&error, LABELS))
        }
        Err(other) => return Err(other.into()),
    };
    let change = form.changed().ok().flatten();
    let choice = GaitsQuery { a: form.a.parse().ok(), b: form.b.parse().ok(), saved, change };
    let typed = (user_of(&authorized.caller), form);
    let refused = RefusedPair { why, is_final: status == StatusCode::CONFLICT };
    Ok((status, Box::pin(show(&mut app, id, choice, typed, Some(refused))).await?).into_response())
}

/// `POST /studies/{id}/retract`.
pub(super) async fn retract(
    authorized: Authorized<access::Answer>,
    State(mut app): State<AppState>,
    Id(id, _): Id<StudyId, access::Answer>,
    Form(form): Form<RetractForm>,
) -> Result<Response, PageError> {
    match compare_answer::retract(&app, &authorized.caller, id, &form).await {
        Ok(()) => Ok(Redirect::to(&format!("/studies/{id}/compare?saved={}", form.saved)).into_response()),
        Err(error @ (Error::Invalid(_) | Error::Conflict(_))) => {
            let choice = GaitsQuery { saved: Some(form.saved), ..GaitsQuery::default() };
            let typed = (user_of(&authorized.caller), AnswerForm::default());
            let refused = RefusedPair::correctable(form_errors::of_form(&error, RETRACT_LABELS));
            let shown = Box::pin(show(&mut app, id, choice, typed, Some(refused))).await?;
            Ok((Problem::from(&error).status(), shown).into_response())
        }
        Err(other) => Err(other.into()),
    }
}

/// The form to undo an answer.
#[derive(Debug, Deserialize)]
pub(super) struct UndoForm {
    saved: AnswerId,
    author: String,
}

/// `POST /studies/{id}/undo`.
pub(super) async fn undo(
    authorized: Authorized<access::Answer>,
    State(mut app): State<AppState>,
    Id(id, _): Id<StudyId, access::Answer>,
    Form(form): Form<UndoForm>,
) -> Result<Response, PageError> {
    let (caller, saved) = (&authorized.caller, form.saved);
    let mut writer = app.write().await?;
    // A form that is sent twice (double click, lost response) counts once.
    if let Some(shown) = undo::outcome(&mut writer, id, saved).await? {
        return after_undo(&mut writer, id, saved, shown).await;
    }
    match undo::undo(&mut writer, caller, Some(id), saved, Some(&form.author)).await {
        Ok(restored) => {
            let next = after_undo(&mut writer, id, saved, restored.unwrap_or(saved)).await?;
            commit(writer).await?;
            app.scheduler.changed();
            Ok(next)
        }
        Err(error @ Error::CannotBeUndone(_)) => {
            drop(writer);
            let choice = GaitsQuery { saved: Some(saved), ..GaitsQuery::default() };
            let typed = (user_of(caller), AnswerForm::default());
            let refused = RefusedPair::correctable(error.to_string());
            let shown = Box::pin(show(&mut app, id, choice, typed, Some(refused))).await?;
            Ok((Problem::from(&error).status(), shown).into_response())
        }
        Err(other) => Err(other.into()),
    }
}

/// Where an undo leads: back to the two gaits, unless an earlier answer about them counts again.
async fn after_undo(
    db: &mut Connection,
    study: StudyId,
    undone: AnswerId,
    shown: AnswerId,
) -> Result<Response, PageError> {
    let pair = RecordedAnswer::get(db, Some(study), undone).await?.pair().filter(|_| shown == undone);
    let gaits = pair.map_or_else(String::new, |(a, b)| format!("&a={a}&b={b}"));
    Ok(Redirect::to(&format!("/studies/{study}/compare?saved={shown}{gaits}")).into_response())
}
