//! Every byte that a rater can fetch: no response, for any identifier, reveals anything about the rated gaits, and new
//! and repeated pairs look the same.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::{HeaderMap, Method, StatusCode};
use gaitwright_http::openapi;
use gaitwright_service::access::{Right, Role};
use gaitwright_store::blind_pairs::{self, BlindPair, BlindPairKind};
use gaitwright_store::members::MemberKind;
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_store::trials::TrialState;
use gaitwright_store::{StudyId, studies};
use gaitwright_tests::callers::{As, FORM, member, rater_of, send, service, signed_in, token};
use gaitwright_tests::page_routes;
use gaitwright_tests::service::{Answer, Service};
use serde_json::{Value, json};
use std::collections::BTreeSet;

const JSON: &str = "application/json";
/// Headers that are allowed in every response. Any other header needs a review, because it may reveal something.
const HEADERS: [&str; 17] = [
    "allow",
    "cache-control",
    "content-length",
    "content-security-policy",
    "content-type",
    "cross-origin-opener-policy",
    "cross-origin-resource-policy",
    "idempotency-replayed",
    "location",
    "permissions-policy",
    "referrer-policy",
    "set-cookie",
    "vary",
    "www-authenticate",
    "x-content-type-options",
    "x-frame-options",
    "x-request-id",
];

async fn post(service: &Service, who: &As, path: &str, body: &Value) -> Answer {
    send(service, who, &Method::POST, path, JSON, &body.to_string()).await
}

async fn get(service: &Service, who: &As, path: &str) -> Answer {
    send(service, who, &Method::GET, path, "", "").await
}

/// A study that asks people, with its first question.
async fn waiting(service: &Service, trials: u32) -> StudyId {
    let study = service.study(|new| (new.answer_source, new.number_of_trials) = (AnswerSource::People, trials)).await;
    service.wait_for(study, &[StudyState::Waiting]).await;
    study
}

/// Data that a response to a rater must not contain: identifiers, names and values of what is rated.
async fn secrets(service: &Service, studies_of: &[StudyId]) -> BTreeSet<String> {
    let mut secrets = BTreeSet::new();
    let mut reader = service.store.read().await.unwrap();
    for &id in studies_of {
        let study = studies::get(&mut reader, id).await.unwrap();
        secrets.extend([study.plan.name.clone(), study.plan.subject_id.to_string()]);
        for trial in service.trials(id).await {
            secrets.extend([trial.id.to_string(), trial.id.short()]);
            secrets.insert(serde_json::to_string(&trial.action).unwrap());
            for figure in [trial.gait_rmse_rad, trial.cost_of_transport, trial.objective].into_iter().flatten() {
                secrets.extend([figure.to_string(), format!("{figure:.4}")]);
            }
        }
        secrets.extend(service.feedback(id).await.iter().map(|row| row.id.to_string()));
        secrets.extend(blind_pairs::of_study(&mut reader, id).await.unwrap().iter().map(|shown| shown.id.to_string()));
    }
    secrets.insert("paper-1".to_owned());
    secrets
}

/// Every address that the service knows, as (method, path with placeholders).
fn addresses() -> Vec<(Method, String)> {
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let mut all = Vec::new();
    for (path, item) in document["paths"].as_object().unwrap() {
        all.extend(item.as_object().unwrap().keys().map(|m| (m.to_uppercase().parse().unwrap(), path.clone())));
    }
    all.extend(page_routes::all().into_iter().filter(|(_, path)| path != "/sign-out"));
    all
}

#[tokio::test]
async fn no_address_reveals_rated_gaits_to_a_rater() {
    let (_folder, service) = service().await;
    let automatic = service.study(|new| (new.name, new.number_of_trials) = (Some("stiff ankle".to_owned()), 12)).await;
    service.wait_for(automatic, &[StudyState::Finished]).await;
    let study = waiting(&service, 6).await;
    let clinician = signed_in(&service, Role::Clinician).await;
    let gaits: Vec<_> =
        service.trials(automatic).await.into_iter().filter(|trial| trial.state == TrialState::Converged).collect();
    let plan = json!({"trial_a": gaits[0].id, "trial_b": gaits[1].id, "notes": "treadmill"});
    let session = post(&service, &clinician, &format!("/api/v1/studies/{automatic}/lab-sessions"), &plan).await.json();
    let rater = rater_of(&service, &[automatic, study]).await;
    let program = token(&service, &[Right::Rate]).await;
    member(&service, study, MemberKind::Token, "[Rate]").await;
    // Another rater's pair, which this one must not see.
    let other = post(&service, &program, &format!("/api/v1/studies/{study}/blind-pairs/next"), &json!({})).await.json();
    let own = post(&service, &rater, &format!("/api/v1/studies/{study}/blind-pairs/next"), &json!({})).await.json();
    let (other, own) = (other["pair"]["code"].as_str().unwrap(), own["pair"]["code"].as_str().unwrap());
    let pairs = [own, other];
    let secrets = secrets(&service, &[automatic, study]).await;
    let (session, subject) = (session["id"].as_str().unwrap().to_owned(), service.subject().await.to_string());
    let ids = [study.to_string(), session, gaits[0].id.to_string(), subject];

    let mut seen = 0;
    for (method, path) in addresses() {
        for id in if path.contains("{id}") { &ids[..] } else { &ids[..1] } {
            for code in &pairs[..if path.contains("{code}") { 2 } else { 1 }] {
                let address = path
                    .replace("{id}", id)
                    .replace("{code}", code)
                    .replace("{side}", "first")
                    .replace("{file}", "rmse.csv");
                let (kind, bodies): (&str, &[&str]) = match (&method, path.starts_with("/api/")) {
                    (&Method::GET, _) => ("", &[""]),
                    (_, true) => (JSON, &["{}", "{\"walk\": 9}"]),
                    (_, false) => (FORM, &["walk=9"]),
                };
                for body in bodies {
                    let answer = send(&service, &rater, &method, &address, kind, body).await;
                    check(&format!("{method} {address} {body}"), &answer, id, code, &secrets);
                    seen += 1;
                }
            }
        }
    }
    assert!(seen > 500, "{seen}");
    service.stop().await;
}

/// Checks a response against the secrets, except those that the rater has sent.
fn check(what: &str, answer: &Answer, id: &str, code: &str, secrets: &BTreeSet<String>) {
    assert!(!answer.status.is_server_error(), "{what}: {}", answer.text);
    let mut bytes = answer.text.clone();
    for (name, value) in &answer.headers {
        assert!(HEADERS.contains(&name.as_str()), "{what}: {name}: {value:?}");
        bytes.push_str(value.to_str().unwrap());
    }
    let bytes = bytes.replace(id, "").replace(code, "");
    // A motion is positions to the millimetre, and nothing else.
    if answer.status == StatusCode::OK && what.contains("/motions/") {
        let stick_figures =
            answer.text.strip_prefix("{\"stick_figures\":").and_then(|rest| rest.strip_suffix('}')).unwrap();
        assert!(stick_figures.chars().all(|c| "[]-.,0123456789".contains(c)), "{what}");
        let digits = stick_figures.split(|c: char| !c.is_ascii_digit() && c != '.').filter_map(|n| n.split_once('.'));
        assert!(digits.into_iter().all(|(_, decimals)| decimals.len() <= 3), "{what}");
        return;
    }
    for secret in secrets.iter().filter(|secret| !id.ends_with(secret.as_str())) {
        assert!(!bytes.contains(secret.as_str()), "{what}: {secret} in {bytes}");
    }
}

/// The response with the code and the number of its pair masked, and without the pictures and the duration of the strides.
fn masked(answer: &Answer, pair: &Value) -> (StatusCode, String, Vec<(String, String)>) {
    let code = pair["code"].as_str().unwrap();
    let mut text = answer.text.replace(code, "TOKEN");
    if let Some((before, rest)) = text.clone().split_once("<noscript data-strips>") {
        text = format!("{before}{}", rest.split_once("</noscript>").unwrap().1);
    }
    // How long a stride takes is drawn, too.
    let mut parts = text.split("data-seconds=\"");
    let first = parts.next().unwrap_or_default().to_owned();
    text = parts.fold(first, |kept, part| kept + part.split_once('"').unwrap().1);
    let number = pair["number"].to_string();
    for (before, after) in [("Pair ", ""), ("\"number\":", ""), ("answer ", ":")] {
        text = text.replace(&format!("{before}{number}{after}"), &format!("{before}N{after}"));
    }
    let headers = named(&answer.headers).into_iter().map(|(name, value)| (name, value.replace(code, "TOKEN")));
    (answer.status, text, headers.collect())
}

/// Headers but the length of the body, which follows from the motion, and the identifier of the request.
fn named(headers: &HeaderMap) -> Vec<(String, String)> {
    let token = |value: &str| value.split("saved=").next().unwrap_or_default().to_owned();
    let kept = headers.iter().filter(|(name, _)| !["content-length", "x-request-id"].contains(&name.as_str()));
    kept.map(|(name, value)| (name.to_string(), token(value.to_str().unwrap()))).collect()
}

/// Answers every pair of a study and says of what kind each was, provided that all of them looked the same.
async fn kinds_of_pairs_that_look_the_same(service: &Service) -> Vec<BlindPairKind> {
    let study = waiting(service, 40).await;
    let (rater, clinician) = (rater_of(service, &[study]).await, signed_in(service, Role::Clinician).await);
    let mut looks = BTreeSet::new();
    let mut kinds = Vec::new();
    for turn in 0..4000 {
        let present = service.wait_for(study, &[StudyState::Waiting, StudyState::Finished]).await;
        if present.state == StudyState::Finished {
            break;
        }
        let next = post(service, &rater, &format!("/api/v1/studies/{study}/blind-pairs/next"), &json!({})).await;
        let pair = next.json()["pair"].clone();
        if pair.is_null() {
            // The study is still processing the answer.
            tokio::time::sleep(std::time::Duration::from_millis(5)).await;
            continue;
        }
        let shown = blind_pairs::of_study(&mut service.store.read().await.unwrap(), study).await.unwrap();
        let shown = shown.last().unwrap().clone();
        if shown.kind == BlindPairKind::New {
            answer_too(service, &clinician, study, &shown).await;
        }
        kinds.push(shown.kind);
        let code = pair["code"].as_str().unwrap();
        let page = get(service, &rater, &format!("/rate/pair/{code}")).await;
        let motion = get(service, &rater, &format!("/api/v1/blind-pairs/{code}/motions/first")).await;
        let path = format!("/rate/pair/{code}");
        let answered = if turn % 2 == 0 {
            let path = format!("/api/v1/blind-pairs/{code}/answer");
            post(service, &rater, &path, &json!({"answer": "first"})).await
        } else {
            send(service, &rater, &Method::POST, &path, FORM, "answer=first").await
        };
        let again = get(service, &rater, &path).await;
        let saved = get(service, &rater, &format!("/rate?saved={code}")).await;
        let saved = saved.text.split_once("Saved ").unwrap().1.split_once("UTC").unwrap().1;
        let saved = saved.split_once("</div>").unwrap().0.replace(code, "TOKEN");
        looks.insert(format!(
            "{:?} {:?} {:?} {:?} {:?}",
            masked(&next, &pair),
            masked(&page, &pair),
            (motion.status, named(&motion.headers)),
            masked(&again, &pair),
            saved.replace(&format!("answer {}:", pair["number"]), "answer N:"),
        ));
        looks.insert(format!("{} {:?}", turn % 2, masked(&answered, &pair)));
    }
    // One look of a pair, and one of an answer for each way of giving it.
    assert_eq!(looks.len(), 3, "{looks:#?}");
    kinds
}

#[tokio::test]
async fn repeated_pair_looks_like_a_new_one_even_after_answers_of_others() {
    // The operating system draws which pairs are repeats, one in ten. How many pairs a study shows varies, because
    // nobody is asked twice about the same two gaits. Among 300 pairs there is no repeat with a chance of 2e-14.
    let mut shown = 0;
    while shown < 300 {
        let (_folder, service) = service().await;
        let kinds = kinds_of_pairs_that_look_the_same(&service).await;
        service.stop().await;
        assert!(!kinds.is_empty(), "a study of forty trials has pairs");
        if kinds.contains(&BlindPairKind::Repeat) {
            return;
        }
        shown += kinds.len();
    }
    panic!("none of {shown} pairs was a repeat");
}

/// A clinician answers the comparison that a rater was shown.
async fn answer_too(service: &Service, clinician: &As, study: StudyId, shown: &BlindPair) {
    let body = json!({"trial_a": shown.trial_a, "trial_b": shown.trial_b, "answer": "b"});
    let given = post(service, clinician, &format!("/api/v1/studies/{study}/preferences"), &body).await;
    assert_eq!(given.status, StatusCode::CREATED, "{}", given.text);
}

#[tokio::test]
async fn rater_retracts_an_answer_that_a_clinician_retracted_and_sees_no_difference() {
    let (_folder, service) = service().await;
    let study = waiting(&service, 6).await;
    let (rater, clinician) = (rater_of(&service, &[study]).await, signed_in(&service, Role::Clinician).await);
    let pair = post(&service, &rater, &format!("/api/v1/studies/{study}/blind-pairs/next"), &json!({})).await.json();
    let code = pair["pair"]["code"].as_str().unwrap().to_owned();
    post(&service, &rater, &format!("/api/v1/blind-pairs/{code}/answer"), &json!({"answer": "first"})).await;
    let preference = service.feedback(study).await.into_iter().find(|row| row.source.as_str() == "subject").unwrap();
    let path = format!("/api/v1/preferences/{}/retract", preference.id);
    let retracted = post(&service, &clinician, &path, &json!({"reason": "wrong person"})).await;
    assert!(retracted.status.is_success(), "{}", retracted.text);
    let back = send(&service, &rater, &Method::POST, &format!("/rate/pair/{code}/retract"), FORM, "").await;
    assert_eq!(back.status, StatusCode::SEE_OTHER, "{}", back.text);
    let page = get(&service, &rater, back.headers["location"].to_str().unwrap()).await;
    assert!(page.text.contains("was retracted"), "{}", page.text);
    service.stop().await;
}
