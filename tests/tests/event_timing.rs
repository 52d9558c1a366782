//! Event streams before unblinding: neither content nor timing reveals an allocation.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::body::{Body, BodyDataStream};
use axum::http::{Method, Request, StatusCode, header};
use futures_util::StreamExt;
use gaitwright_service::access::Role;
use gaitwright_store::studies::StudyState;
use gaitwright_store::trials::TrialState;
use gaitwright_tests::callers::{As, rater_of, send, service, signed_in};
use gaitwright_tests::read_allocations::gait_a_first;
use gaitwright_tests::service::{Answer, Service};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use tower::ServiceExt;

/// Sessions that are watched.
const SESSIONS: usize = 200;

/// Events with their times of arrival.
type ReceivedEvents = Arc<Mutex<Vec<(Instant, String)>>>;

async fn post(service: &Service, who: &As, path: &str, body: &Value) -> Answer {
    let answer = send(service, who, &Method::POST, path, "application/json", &body.to_string()).await;
    assert!(answer.status.is_success(), "{path}: {}", answer.text);
    answer
}

async fn listen(service: &Service, who: &As, path: &str) -> BodyDataStream {
    let As::Session(secret) = who else { panic!("nobody is signed in") };
    let request = Request::get(path).header(header::COOKIE, format!("gaitwright_session={secret}"));
    let answer = service.router().oneshot(request.body(Body::empty()).unwrap()).await.unwrap();
    assert_eq!(answer.status(), StatusCode::OK);
    answer.into_body().into_data_stream()
}

fn collect_events(mut stream: BodyDataStream) -> ReceivedEvents {
    let received = ReceivedEvents::default();
    let kept = Arc::clone(&received);
    tokio::spawn(async move {
        while let Some(Ok(bytes)) = stream.next().await {
            let text = String::from_utf8(bytes.to_vec()).unwrap();
            if text.starts_with("event: ") && !text.starts_with("event: study_state") {
                kept.lock().unwrap().push((Instant::now(), text));
            }
        }
    });
    received
}

/// An event without identifiers, numbers and instants, all of which differ from session to session.
fn masked(event: &str) -> String {
    let words = event.split_inclusive(|c: char| !c.is_ascii_alphanumeric() && c != '-');
    words
        .map(|word| if word.starts_with(|c: char| c.is_ascii_digit()) || word.len() > 30 { "N" } else { word })
        .collect()
}

/// Guesses by whether a duration is above the middle of all of them.
fn right_guesses(durations: &[Duration], truth: &[bool]) -> usize {
    let mut sorted = durations.to_vec();
    sorted.sort();
    let middle = sorted[durations.len() / 2];
    durations.iter().zip(truth).filter(|(duration, first)| (**duration >= middle) == **first).count()
}

#[tokio::test]
async fn event_streams_reveal_no_allocation_by_content_or_timing() {
    let (_folder, service) = service().await;
    let study = service.study(|new| new.number_of_trials = 6).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let mut gaits = service.trials(study).await;
    gaits.retain(|trial| trial.state == TrialState::Converged);
    let (reader, rater) = (signed_in(&service, Role::Clinician).await, rater_of(&service, &[study]).await);
    let received = collect_events(listen(&service, &reader, &format!("/api/v1/studies/{study}/events")).await);
    let mut truth = Vec::new();
    let mut looks = BTreeSet::new();
    let (mut until_event, mut until_answer, mut walks) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..SESSIONS {
        let plan = json!({"trial_a": gaits[0].id, "trial_b": gaits[1].id});
        let planned = post(&service, &reader, &format!("/api/v1/studies/{study}/lab-sessions"), &plan).await.json();
        let id = planned["id"].as_str().unwrap();
        received.lock().unwrap().clear();
        let begun = Instant::now();
        for walk in 1..=3 {
            post(&service, &rater, &format!("/api/v1/lab-sessions/{id}/walks"), &json!({"walk": walk})).await;
        }
        walks.push(begun.elapsed());
        let asked = Instant::now();
        let said = json!({"number": 1, "answer": "first"});
        post(&service, &rater, &format!("/api/v1/lab-sessions/{id}/answers"), &said).await;
        until_answer.push(asked.elapsed());
        let event = loop {
            let answered = |(_, text): &&(Instant, String)| text.starts_with("event: lab_session_answered");
            if let Some((at, _)) = received.lock().unwrap().iter().find(answered) {
                break *at;
            }
            assert!(asked.elapsed() < Duration::from_secs(10), "{:?}", received.lock().unwrap());
            tokio::time::sleep(Duration::from_micros(200)).await;
        };
        until_event.push(event.saturating_duration_since(asked));
        looks.insert(received.lock().unwrap().iter().map(|(_, text)| masked(text)).collect::<String>());
        truth.push(gait_a_first(&service.store, id.parse().unwrap()).await);
    }
    assert_eq!(looks.len(), 1, "{looks:#?}");
    // Five standard deviations, which chance exceeds less than once in a million.
    let limit = 2.5 * (SESSIONS as f64).sqrt();
    for (what, durations) in [("event", &until_event), ("answer", &until_answer), ("walks", &walks)] {
        let right = right_guesses(durations, &truth);
        println!("by the time until the {what}: {right} of {SESSIONS} orders guessed");
        assert!(right.abs_diff(SESSIONS / 2) as f64 <= limit, "{what}: {right} of {SESSIONS}");
    }
    service.stop().await;
}
