//! The form for a preference between two gaits of a study.

use super::error::{Page, PageError, page};
use super::study::answer_in_words;
use crate::access::{self, Read};
use crate::error::Error;
use crate::http::AppState;
use crate::http::extract::{Form, Id, Params};
use crate::http::may::May;
use crate::store::feedback::Source;
use crate::store::idempotency::{self, Kept};
use crate::store::studies::Study;
use crate::store::trials::TrialState;
use crate::store::{FeedbackId, StudyId, TrialId, commit, feedback, studies, trials};
use crate::studies::answer::{self, Answer, Verdict};
use crate::studies::choice::MANY;
use crate::studies::comparison::open_question;
use crate::studies::standing::Standing;
use askama::Template;
use axum::extract::State;
use axum::response::Redirect;
use serde::Deserialize;

/// Which gaits to offer, and what was just saved.
#[derive(Debug, Deserialize)]
pub(super) struct Choice {
    a: Option<TrialId>,
    b: Option<TrialId>,
    saved: Option<FeedbackId>,
}

#[derive(Template)]
#[template(path = "compare.html")]
struct ComparePage {
    study: Study,
    trials: Vec<Offered>,
    key: FeedbackId,
    saved: Option<Saved>,
}

/// A gait that can be compared.
struct Offered {
    id: TrialId,
    number: u32,
    as_a: bool,
    as_b: bool,
}

/// An answer as read back from the record.
struct Saved {
    id: FeedbackId,
    text: String,
    at: String,
    retracted: bool,
}

/// So many trials of a large study are offered.
const OFFERED: u32 = 200;

/// `GET /studies/{id}/compare`.
pub(super) async fn get(
    _: May<Read>,
    State(app): State<AppState>,
    Id(id): Id<StudyId>,
    Params(choice): Params<Choice>,
) -> Page {
    let mut reader = app.read().await?;
    let study = studies::get(&mut reader, id).await?;
    let large = trials::counts(&mut reader, id).await?.total as usize >= MANY;
    let standing = if large {
        Standing::newest(&mut reader, study, OFFERED).await?
    } else {
        Standing::read(&mut reader, study).await?
    };
    let saved = match choice.saved {
        Some(saved) => Some(feedback::get(&mut reader, saved).await?),
        None => None,
    };
    drop(reader);
    let question = if large { None } else { open_question(&standing).map_err(Error::Learner)? };
    let mut trials: Vec<Offered> = standing
        .trials
        .iter()
        .filter(|trial| trial.state == TrialState::Converged)
        .map(|trial| Offered { id: trial.id, number: trial.number, as_a: false, as_b: false })
        .collect();
    let newest = |back: usize| trials.len().checked_sub(back).map(|i| trials[i].id);
    let (a, b) = match (choice.a, choice.b, question) {
        (Some(a), Some(b), _) => (Some(a), Some(b)),
        (_, _, Some((new, old))) => (Some(old), Some(new)),
        _ => (newest(2), newest(1)),
    };
    for trial in &mut trials {
        (trial.as_a, trial.as_b) = (a == Some(trial.id), b == Some(trial.id));
    }
    let saved = saved.and_then(|row| {
        Some(Saved {
            id: row.id,
            text: answer_in_words(&row, &standing)?,
            at: row.created_at.minute(),
            retracted: row.retraction.is_some(),
        })
    });
    page(&ComparePage { study: standing.study, trials, key: FeedbackId::fresh(), saved })
}

/// The form as submitted.
#[derive(Debug, Deserialize)]
pub(super) struct Submitted {
    a: TrialId,
    b: TrialId,
    answer: Verdict,
    source: Source,
    author: String,
    #[serde(default)]
    note: String,
    key: FeedbackId,
}

/// `POST /studies/{id}/compare`.
pub(super) async fn post(
    may: May<access::Answer>,
    State(app): State<AppState>,
    Id(id): Id<StudyId>,
    Form(form): Form<Submitted>,
) -> Result<Redirect, PageError> {
    let answer = Answer {
        trial_a: form.a,
        trial_b: form.b,
        answer: form.answer,
        source: Some(form.source),
        author: Some(form.author),
        note: form.note,
    };
    let mut writer = app.write().await?;
    // The key of the form: sent twice (double click, reload, two tabs), the answer counts once.
    let key = format!("form {}", form.key);
    let saved = if let Some(before) = idempotency::find(&mut writer, &may.caller.actor, &key).await? {
        before.body
    } else {
        let saved = answer::give(&mut writer, &may.caller, id, &answer).await?.to_string();
        let kept = Kept { request: key.clone(), status: 303, location: None, body: saved.clone() };
        idempotency::keep(&mut writer, &may.caller.actor, &key, &kept).await?;
        saved
    };
    commit(writer).await?;
    app.director.changed();
    Ok(Redirect::to(&format!("/studies/{id}/compare?saved={saved}")))
}

/// Taking an answer back.
#[derive(Debug, Deserialize)]
pub(super) struct Retract {
    feedback: FeedbackId,
    author: String,
    reason: String,
}

/// `POST /studies/{id}/retract`.
pub(super) async fn retract(
    may: May<access::Answer>,
    State(app): State<AppState>,
    Id(id): Id<StudyId>,
    Form(form): Form<Retract>,
) -> Result<Redirect, PageError> {
    let mut writer = app.write().await?;
    answer::retract(&mut writer, &may.caller, form.feedback, Some(&form.author), &form.reason).await?;
    commit(writer).await?;
    app.director.changed();
    Ok(Redirect::to(&format!("/studies/{id}/compare?saved={}", form.feedback)))
}
