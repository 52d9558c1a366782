//! The page on which staff and subjects compare two gaits of a study.

use super::page_chart::{Drawn, shared_legend};
use super::study::{answer_in_words, assessment_in_words};
use super::undo::undo_seconds;
use super::walking_pair::{WalkingGait, walking_pair};
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::extractors::{Form, Params};
use crate::figures::trial;
use crate::form_errors;
use crate::format::source_name;
use crate::page_error::{Page, PageError, page};
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
use gaitwright_service::printable;
use gaitwright_service::studies::answer::{self, Answer, PairAnswer};
use gaitwright_service::studies::assessment::{self, NewAssessment};
use gaitwright_service::studies::comparison::{Question, open_question};
use gaitwright_service::studies::preference::{self, CurrentAnswer};
use gaitwright_service::studies::safety_reports::SafetyReports;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_service::studies::trial_choice::MANY;
use gaitwright_service::studies::walkable;
use gaitwright_store::assessments::AssessmentAnswer;
use gaitwright_store::feedback::{FeedbackContent, FeedbackRow, Source};
use gaitwright_store::idempotency::{self, Kept, fingerprint};
use gaitwright_store::presentations::Judgement;
use gaitwright_store::studies::{Study, StudyState};
use gaitwright_store::{
    AssessmentId, Connection, FeedbackId, Instant, StudyId, TrialId, assessments, commit, events, feedback, gaits,
    reference_gaits, studies, trials,
};
use serde::Deserialize;
use std::fmt;
use std::str::FromStr;

/// The gaits to compare, and the answer that was just saved.
#[derive(Debug, Default, Deserialize)]
pub(super) struct Choice {
    a: Option<TrialId>,
    b: Option<TrialId>,
    saved: Option<Recorded>,
}

/// The row of an answer in the record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
enum Recorded {
    Preference(FeedbackId),
    Assessment(AssessmentId),
}

impl fmt::Display for Recorded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Preference(id) => id.fmt(f),
            Self::Assessment(id) => write!(f, "{ASSESSMENT}{id}"),
        }
    }
}

impl TryFrom<String> for Recorded {
    type Error = Error;
    fn try_from(text: String) -> Result<Self, Error> {
        match text.strip_prefix(ASSESSMENT) {
            Some(id) => Ok(Self::Assessment(identifier("saved", id)?)),
            None => Ok(Self::Preference(identifier("saved", &text)?)),
        }
    }
}

/// Before the identifier of an assessment.
const ASSESSMENT: &str = "assessment-";

#[derive(Template)]
#[template(path = "compare.html")]
struct ComparePage {
    study: Study,
    trials: Vec<Offered>,
    /// The gaits shown: identifier and number.
    a: Option<(TrialId, u32)>,
    b: Option<(TrialId, u32)>,
    charts: Vec<Drawn>,
    /// The legend of all charts.
    legend: Vec<(String, String)>,
    /// Both gaits; empty if they cannot be drawn.
    walking: Vec<WalkingGait>,
    key: FeedbackId,
    saved: Option<Saved>,
    /// Whether the study waits for an answer.
    waits: bool,
    /// How many gaits can be compared once they are certified.
    being_certified: usize,
    /// Whether the study computes another gait.
    is_going_on: bool,
    last_event: i64,
    typed: Submitted,
    /// The signed-in user; empty without sign-in.
    user: String,
    refused: Option<String>,
}

impl ComparePage {
    /// Answers under a gait: value, label, keys, and the key that the button shows.
    const BETTER: [(&str, &str, &str, &str); 2] =
        [("a", "Gait A is better", "ArrowLeft 1", "←"), ("b", "Gait B is better", "ArrowRight 3", "→")];
    /// Answers between the gaits.
    const BETWEEN: [(&str, &str, &str, &str); 2] =
        [("no_difference", "No difference", "2", "2"), ("cannot_tell", "Cannot tell", "", "")];
    /// Safety reports.
    const UNSAFE: [(&str, &str); 3] =
        [("unsafe_a", "Gait A is unsafe"), ("unsafe_b", "Gait B is unsafe"), ("unsafe_both", "Both gaits are unsafe")];

    /// The gait at a place, if it can be drawn.
    #[allow(clippy::trivially_copy_pass_by_ref)] // templates pass references
    fn gait(&self, place: &usize) -> Option<&WalkingGait> {
        self.walking.get(*place)
    }

    /// Whether a refused form had this answer.
    fn is_given(&self, value: &str) -> bool {
        self.typed.answer == value
    }

    /// Who answers, in words; empty if nobody is named yet.
    fn person(&self) -> String {
        let source = Source::from_str(&self.typed.source).unwrap_or(Source::Subject);
        match self.typed.author.trim() {
            "" => String::new(),
            author => format!("{}, {author}", source_name(source)),
        }
    }

    /// Who retracts an answer: the signed-in user, or else its author.
    fn retractor<'a>(&'a self, saved: &'a Saved) -> &'a str {
        if self.user.is_empty() { &saved.author } else { &self.user }
    }
}

/// A gait that can be compared.
struct Offered {
    id: TrialId,
    number: u32,
    as_a: bool,
    as_b: bool,
}

/// An answer, read from the record.
struct Saved {
    id: Recorded,
    text: String,
    author: String,
    at: Instant,
    retracted: bool,
    is_safety_report: bool,
    /// The gaits of the comparison.
    pair: Option<(TrialId, TrialId)>,
    /// Answers of others to the same comparison: author and text.
    other_answers: Vec<(String, String)>,
}

impl Saved {
    /// Seconds for which the page offers *Undo*, if the answer is new.
    fn undo(&self) -> Option<f64> {
        undo_seconds(self.at).filter(|_| !self.retracted && !self.is_safety_report)
    }
}

/// How many trials of a large study are offered.
const OFFERED: u32 = 200;

/// How many of the newest gaits without a certificate are certified when the page is opened.
const CERTIFIED_AT_ONCE: usize = 10;

/// `GET /studies/{id}/compare`.
pub(super) async fn get(
    authorized: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
    Params(choice): Params<Choice>,
) -> Page {
    // The default author is the signed-in user, and the default source is a clinician.
    let mut typed = Submitted::default();
    let user = user_of(&authorized.caller);
    if !user.is_empty() {
        (typed.author, typed.source) = (user.clone(), Source::Clinician.as_str().to_owned());
    }
    if choice.a.is_some() && choice.a == choice.b {
        let refused = "Gait A and gait B are the same. Choose two different gaits.".to_owned();
        return Box::pin(show(&mut app, id, Choice { a: None, b: None, ..choice }, (user, typed), Some(refused))).await;
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
    choice: Choice,
    (user, typed): (String, Submitted),
    refused: Option<String>,
) -> Page {
    let mut reader = app.read().await?;
    let last_event = events::last(&mut reader, id).await?;
    let study = studies::get(&mut reader, id).await?;
    let is_going_on = matches!(study.state, StudyState::Running | StudyState::Waiting);
    let reference = reference_gaits::get(&mut reader, study.plan.reference_gait_id).await?.definition;
    let large = trials::counts(&mut reader, id).await?.total as usize >= MANY;
    let snapshot = if large {
        StudySnapshot::newest(&mut reader, study, OFFERED).await?
    } else {
        StudySnapshot::read(&mut reader, study).await?
    };
    let saved = match choice.saved {
        Some(saved) => read_back(&mut reader, &snapshot, saved).await?,
        None => None,
    };
    drop(reader);
    let ask = move |pool: &OnPool| {
        let question = if large { Ok(Question::None) } else { open_question(pool, &snapshot) };
        (snapshot, question)
    };
    let (snapshot, question) = app.compute(ask).await.map_err(Error::from)?;
    let question = question.map_err(Error::Learner)?.trials();
    let mut reader = app.read().await?;
    let waits = question.is_some();
    let mut being_certified = 0;
    for trial in
        snapshot.trials.iter().rev().filter(|trial| snapshot.waits_for_certificate(trial)).take(CERTIFIED_AT_ONCE)
    {
        being_certified += usize::from(app.scheduler.certify(trial.id));
    }
    let mut trials: Vec<Offered> = snapshot
        .trials
        .iter()
        .filter(|trial| snapshot.walkable(trial).is_ok())
        .map(|trial| Offered { id: trial.id, number: trial.number, as_a: false, as_b: false })
        .collect();
    if refused.is_none()
        && let (Some(a), Some(b)) = (choice.a, choice.b)
    {
        walkable::admit_pair(&mut reader, id, ("a", "b"), (a, b)).await?;
    }
    let newest = |back: usize| trials.len().checked_sub(back).map(|i| trials[i].id);
    let (a, b) = match (choice.a, choice.b, question) {
        (Some(a), Some(b), _) => (Some(a), Some(b)),
        (_, _, Some((new, old))) => (Some(old), Some(new)),
        _ => (newest(2), newest(1)),
    };
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
        let drawn = |figure: &Figure| Drawn::of(figure, &files, &query);
        let charts = trial::pair((of_a, &gait_a), (of_b, &gait_b), &reference).iter().map(drawn).collect();
        let walking = walking_pair([(a, of_a, "Gait A".to_owned(), &gait_a), (b, of_b, "Gait B".to_owned(), &gait_b)]);
        Ok::<_, Error>((charts, walking.into_iter().flatten().collect()))
    };
    let (mut charts, walking): (Vec<Drawn>, _) = app.compute(draw).await.map_err(Error::from)??;
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
        waits,
        being_certified,
        is_going_on,
        last_event,
        typed,
        user,
        refused,
    })
}

/// Reads an answer from the record; `None` if its trials are not in the snapshot.
async fn read_back(db: &mut Connection, snapshot: &StudySnapshot, saved: Recorded) -> Result<Option<Saved>, Error> {
    Ok(match saved {
        Recorded::Preference(id) => {
            let row = feedback::get(db, id).await?;
            if row.study_id != snapshot.study.id {
                return Err(Error::NotFound { what: "preference".to_owned(), id: id.to_string() });
            }
            let in_words = |other: FeedbackRow| Some((other.author.clone(), answer_in_words(&other, snapshot)?));
            let other_answers = answer::other_answers(db, &row).await?.into_iter().filter_map(in_words).collect();
            answer_in_words(&row, snapshot).map(|text| Saved {
                id: saved,
                text,
                author: row.author.clone(),
                at: row.created_at,
                retracted: row.retraction.is_some(),
                is_safety_report: false,
                pair: compared(&row.content),
                other_answers,
            })
        }
        Recorded::Assessment(id) => {
            let assessment = assessments::get(db, id).await?;
            if assessment.study_id != snapshot.study.id {
                return Err(Error::NotFound { what: "assessment".to_owned(), id: id.to_string() });
            }
            assessment_in_words(&assessment, snapshot).map(|text| Saved {
                id: saved,
                text,
                author: assessment.author.clone(),
                at: assessment.created_at,
                retracted: assessment.retraction.is_some(),
                is_safety_report: assessment.answer.is_about_safety(),
                pair: Some(assessment.pair()),
                other_answers: Vec::new(),
            })
        }
    })
}

/// The fields as typed, to show a refused form again.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Submitted {
    a: String,
    b: String,
    #[serde(default)]
    answer: String,
    source: String,
    author: String,
    #[serde(default)]
    note: String,
    key: String,
}

/// An answer as given in the form.
enum GivenAnswer {
    Preference(Answer),
    Assessment(NewAssessment),
}

impl GivenAnswer {
    fn is_about_safety(&self) -> bool {
        matches!(self, Self::Assessment(assessment) if assessment.answer.is_about_safety())
    }

    /// Whether every gait that this answer calls unsafe still has a report in force.
    async fn is_still_in_force(&self, db: &mut Connection, study: StudyId) -> Result<bool, Error> {
        match self {
            Self::Assessment(given) if self.is_about_safety() => {
                let gaits = Judgement::from(given.answer).unsafe_of((given.trial_a, given.trial_b));
                Ok(SafetyReports::read(db, study).await?.are_all_in_force(&gaits))
            }
            _ => Ok(true),
        }
    }
}

impl Submitted {
    fn read(&self) -> Result<(GivenAnswer, FeedbackId), Error> {
        let source = Source::from_str(&self.source)
            .map_err(|_| Error::invalid("source", self.source.as_str(), "subject, clinician or script"))?;
        let (a, b) = (identifier("trial_a", &self.a)?, identifier("trial_b", &self.b)?);
        let (source, author, note) = (Some(source), Some(self.author.clone()), self.note.clone());
        let preference = |answer| {
            let (author, note) = (author.clone(), note.clone());
            GivenAnswer::Preference(Answer { trial_a: a, trial_b: b, answer, source, author, note })
        };
        let assessment = |answer| {
            let (author, note) = (author.clone(), note.clone());
            GivenAnswer::Assessment(NewAssessment { trial_a: a, trial_b: b, answer, source, author, note })
        };
        let judgement = match self.answer.as_str() {
            "a" => preference(PairAnswer::A),
            "b" => preference(PairAnswer::B),
            "no_difference" => preference(PairAnswer::NoDifference),
            "cannot_tell" => assessment(AssessmentAnswer::CannotTell),
            "unsafe_a" => assessment(AssessmentAnswer::UnsafeA),
            "unsafe_b" => assessment(AssessmentAnswer::UnsafeB),
            "unsafe_both" => assessment(AssessmentAnswer::UnsafeBoth),
            other => {
                return Err(Error::invalid("answer", other, "one of the answers on the form"));
            }
        };
        Ok((judgement, identifier("key", &self.key)?))
    }

    /// A digest that distinguishes this answer from another one with the same key.
    fn fingerprint(&self, study: StudyId) -> String {
        let Self { a, b, answer, source, author, note, key } = self;
        let sent = [a, b, answer, source, author, note, key].map(|part| format!("{}:{part}", part.len())).join(" ");
        fingerprint("form", &format!("/studies/{study}/compare"), sent.as_bytes())
    }
}

fn identifier<T: FromStr>(field: &str, text: &str) -> Result<T, Error> {
    text.parse().map_err(|_| Error::invalid(field, text, "an identifier from this form"))
}

/// The outcome of a submitted form.
enum Given {
    /// The answer is recorded, now or before.
    Saved(Recorded),
    /// The same form was sent before with another answer, which is the recorded one.
    Before(Recorded),
    /// The same author answered this comparison before; that answer is the recorded one.
    Elsewhere(Recorded),
}

/// The labels of the form.
const LABELS: [(&str, &str); 6] = [
    ("a", "Gait A"),
    ("b", "Gait B"),
    ("answer", "Answer"),
    ("source", "This person is"),
    ("author", "Name or code"),
    ("note", "Note"),
];

/// `POST /studies/{id}/compare`.
pub(super) async fn post(
    authorized: Authorized<access::Answer>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<StudyId, access::Answer>,
    Form(form): Form<Submitted>,
) -> Result<Response, PageError> {
    let (saved, status, why) = match give(&app, &authorized.caller, id, &form).await {
        Ok(Given::Saved(saved)) => {
            return Ok(Redirect::to(&format!("/studies/{id}/compare?saved={saved}")).into_response());
        }
        Ok(Given::Before(saved)) => {
            let why = "This form was already sent with another answer, shown above. That answer counts; this one was not \
                       saved. To change the answer, retract the first one and save again.";
            (Some(saved), StatusCode::CONFLICT, why.to_owned())
        }
        Ok(Given::Elsewhere(saved)) => {
            let why = "You have already answered this comparison, perhaps in another tab or window. Your first answer, shown \
                       above, counts; this one was not saved. To change the answer, retract the first one and save \
                       again.";
            (Some(saved), StatusCode::CONFLICT, why.to_owned())
        }
        Err(error @ (Error::Invalid(_) | Error::Conflict(_))) => {
            (None, Problem::from(&error).status(), form_errors::of_form(&error, &LABELS))
        }
        Err(other) => return Err(other.into()),
    };
    let choice = Choice { a: form.a.parse().ok(), b: form.b.parse().ok(), saved };
    let typed = (user_of(&authorized.caller), form);
    Ok((status, Box::pin(show(&mut app, id, choice, typed, Some(why))).await?).into_response())
}

async fn give(app: &AppState, caller: &Caller, id: StudyId, form: &Submitted) -> Result<Given, Error> {
    let (judgement, key) = form.read()?;
    let mut writer = app.write().await?;
    // The key of the form makes a repeated form (double click, reload, two tabs) count once.
    let request = form.fingerprint(id);
    // A safety report has a key of its own, because it is recorded even if the form was sent before with another answer.
    let key = if judgement.is_about_safety() { format!("form {key} {request}") } else { format!("form {key}") };
    let before = idempotency::find(&mut writer, &caller.actor, &key).await?;
    // A report that staff have reviewed since is a new one.
    let is_reviewed = before.is_some() && !judgement.is_still_in_force(&mut writer, id).await?;
    if let Some(before) = before.filter(|_| !is_reviewed) {
        let same = before.request == request;
        let recorded = Recorded::try_from(before.body)?;
        return Ok(if same { Given::Saved(recorded) } else { Given::Before(recorded) });
    }
    // A second answer is refused, and the page shows the first one. A safety report is always accepted.
    if !judgement.is_about_safety()
        && let Some(saved) = answered_elsewhere(&mut writer, id, form).await?
    {
        return Ok(Given::Elsewhere(saved));
    }
    let saved = match judgement {
        GivenAnswer::Preference(answer) => Recorded::Preference(answer::give(&mut writer, caller, id, &answer).await?),
        GivenAnswer::Assessment(new) => Recorded::Assessment(assessment::give(&mut writer, caller, id, &new).await?),
    };
    if !is_reviewed {
        let kept = Kept { request, status: 303, location: None, body: saved.to_string() };
        idempotency::keep(&mut writer, &caller.actor, &key, &kept).await?;
    }
    commit(writer).await?;
    app.scheduler.changed();
    Ok(Given::Saved(saved))
}

/// The answer in force of the same author to the same comparison, given in another tab or elsewhere.
async fn answered_elsewhere(db: &mut Connection, study: StudyId, form: &Submitted) -> Result<Option<Recorded>, Error> {
    let pair = (identifier("trial_a", &form.a)?, identifier("trial_b", &form.b)?);
    let author = printable::name("author", &form.author, 80)?;
    Ok(preference::current_answer(db, study, pair, author).await?.and_then(|answer| match answer {
        CurrentAnswer::Preference(id) => Some(Recorded::Preference(id)),
        CurrentAnswer::Assessment(id) => Some(Recorded::Assessment(id)),
        // The page shows no blinded answer, and no suggestion as an answer: the refusal says that there is one.
        CurrentAnswer::Blind(_) | CurrentAnswer::Suggestion(_) => None,
    }))
}

/// The two trials of an answer, the earlier one first, so that the order does not repeat the answer.
fn compared(content: &FeedbackContent) -> Option<(TrialId, TrialId)> {
    match *content {
        FeedbackContent::Preference { winner: one, loser: other } | FeedbackContent::Tie { a: one, b: other } => {
            Some((one.min(other), one.max(other)))
        }
        FeedbackContent::Label { .. } | FeedbackContent::Suggestion { .. } => None,
    }
}

/// The form to retract an answer.
#[derive(Debug, Deserialize)]
pub(super) struct Retract {
    saved: Recorded,
    author: String,
    reason: String,
}

/// `POST /studies/{id}/retract`.
pub(super) async fn retract(
    authorized: Authorized<access::Answer>,
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, access::Answer>,
    Form(form): Form<Retract>,
) -> Result<Redirect, PageError> {
    let mut writer = app.write().await?;
    let author = Some(form.author.as_str());
    match form.saved {
        Recorded::Preference(given) => {
            answer::retract(&mut writer, &authorized.caller, Some(id), given, author, &form.reason).await?;
        }
        Recorded::Assessment(made) => {
            assessment::retract(&mut writer, &authorized.caller, Some(id), made, (author, &form.reason)).await?;
        }
    }
    commit(writer).await?;
    app.scheduler.changed();
    Ok(Redirect::to(&format!("/studies/{id}/compare?saved={}", form.saved)))
}
