//! The description states the rules: every operation accepts bodies that are drawn from it, unless the state of the
//! record forbids them, and refuses bodies that violate it, with 422 if the description lists that status.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::Router;
use axum::body::Body;
use axum::http::{Request, StatusCode, header};
use gaitwright_http::openapi;
use gaitwright_service::studies::study_plan::NewStudy;
use gaitwright_store::studies::{AnswerSource, Evaluation, StudyState};
use gaitwright_store::{StudyId, SubjectId, TrialId};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::bodies_from_schema::Drawn;
use gaitwright_tests::measured::{electromyogram, four_strides, joint_angles};
use gaitwright_tests::service::{Answer, Service};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::time::Duration;
use tempfile::TempDir;
use tower::ServiceExt;

/// Bodies drawn for each operation.
const DRAWS: usize = 8;

/// Operations that hardly ever succeed with a drawn body, because a value must exist in the record.
const SELDOM_FIT: [&str; 2] = ["post /studies/{id}/suggestions", SIMULATE];

/// The service of this test simulates no walks, so that this operation ends with 503 after it has checked the body.
const SIMULATE: &str = "post /trials/{id}/execution-report";

/// A rater who can become a member.
const MEMBER: &str = "a drawn member";

struct Scene {
    service: Service,
    /// One router for all requests, because building one takes longer than answering.
    router: Router,
    finished: StudyId,
    human: StudyId,
    script: StudyId,
    trials: Vec<TrialId>,
    made: u32,
}

impl Scene {
    async fn set() -> (TempDir, Self) {
        let folder = tempfile::tempdir().unwrap();
        let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
        let finished = service.study(|new| (new.number_of_trials, new.answer_source) = (18, AnswerSource::Both)).await;
        service.wait_for(finished, &[StudyState::Finished]).await;
        // Another subject, so that safety reports there do not affect gaits here.
        let own = service.subject().await;
        let subjects = service.fetch("/api/v1/subjects").await.items();
        let ids = subjects.as_array().unwrap().iter().map(|subject| subject["id"].as_str().unwrap().parse().unwrap());
        let other: SubjectId = ids.into_iter().find(|id| *id != own).unwrap();
        let of_another = |new: &mut NewStudy| {
            (new.subject_id, new.number_of_trials, new.answer_source) = (other, 40, AnswerSource::People);
        };
        let human = service.study(of_another).await;
        service.wait_for(human, &[StudyState::Waiting]).await;
        let script = service.study(|new| (new.evaluation, new.number_of_trials) = (Evaluation::Script, 5000)).await;
        let converged = service.trials(finished).await.into_iter().filter(|trial| trial.gait_rmse_rad.is_some());
        let trials = converged.map(|trial| trial.id).collect();
        let router = service.router();
        (folder, Self { service, router, finished, human, script, trials, made: 0 })
    }

    async fn post(&self, path: &str, body: Value) -> Value {
        let answer = self.request("post", path, &body).await;
        assert!(answer.status.is_success(), "{path}: {}", answer.text);
        answer.json()
    }

    async fn request(&self, method: &str, path: &str, body: &Value) -> Answer {
        let request = Request::builder().method(method.to_uppercase().as_str()).uri(format!("/api/v1{path}"));
        let request = request.header(header::CONTENT_TYPE, "application/json");
        let request = request.body(Body::from(body.to_string())).unwrap();
        Answer::of(self.router.clone().oneshot(request).await.unwrap()).await
    }

    async fn id_of(&self, path: &str, body: Value) -> String {
        self.post(path, body).await["id"].as_str().unwrap().to_owned()
    }

    fn number(&mut self) -> u32 {
        self.made += 1;
        self.made
    }

    async fn subject(&mut self) -> String {
        let pseudonym = format!("drawn-{}", self.number());
        self.id_of("/subjects", json!({"pseudonym": pseudonym, "height_m": 1.8, "body_mass_kg": 70})).await
    }

    /// A study that waits for scripts: started, or not.
    async fn study(&self, start: bool) -> String {
        let body = json!({"subject_id": self.service.subject().await, "evaluation": "script", "start": start});
        self.id_of("/studies", body).await
    }

    /// A preference, a note or a suggestion about the first two gaits, by somebody new.
    async fn said(&mut self, what: &str) -> String {
        let (one, other) = (self.trials[0], self.trials[1]);
        let author = format!("author {}", self.number());
        let body = match what {
            "preferences" => json!({"trial_a": one, "trial_b": other, "answer": "a", "author": author}),
            "suggestions" => {
                let trials = self.service.trials(self.finished).await;
                let bounds = trials.into_iter().find(|trial| trial.id == other).map(|trial| trial.action);
                json!({"over": one, "bounds": bounds, "author": author})
            }
            _ => json!({"trial_a": one, "trial_b": other, "answer": "cannot_tell", "author": author}),
        };
        self.id_of(&format!("/studies/{}/{what}", self.finished), body).await
    }

    /// A lab session in which every walk was recorded.
    async fn session(&mut self, walked: bool) -> String {
        // An answer in an earlier session may have called either gait unsafe.
        for trial in &self.trials[..2] {
            let review = json!({"decision": "cleared", "reason": "seen on the treadmill"});
            let reviewed = self.request("post", &format!("/trials/{trial}/safety-reviews"), &review).await;
            assert!(reviewed.status.is_success() || reviewed.status == StatusCode::CONFLICT, "{}", reviewed.text);
        }
        let gaits = json!({"trial_a": self.trials[0], "trial_b": self.trials[1]});
        let id = self.id_of(&format!("/studies/{}/lab-sessions", self.finished), gaits).await;
        for walk in 1..=if walked { 3 } else { 0 } {
            self.post(&format!("/lab-sessions/{id}/walks"), json!({"walk": walk})).await;
        }
        id
    }

    /// The value of the path parameter of an operation: an object in a suitable state.
    async fn target(&mut self, path: &str) -> Option<String> {
        Some(match path {
            "/blind-pairs/{code}/answer" => {
                // After an answer, no comparison is pending until the study has chosen the next one.
                let mut code = None;
                for _ in 0..100 {
                    let next = self.post(&format!("/studies/{}/blind-pairs/next", self.human), json!({})).await;
                    code = next["pair"]["code"].as_str().map(str::to_owned);
                    if code.is_some() || self.service.get(self.human).await.state == StudyState::Finished {
                        break;
                    }
                    tokio::time::sleep(Duration::from_millis(50)).await;
                }
                code?
            }
            "/studies/{id}/start" => self.study(false).await,
            "/studies/{id}/pause" | "/studies/{id}/stop" => self.study(true).await,
            "/studies/{id}/resume" => {
                let id = self.study(true).await;
                self.post(&format!("/studies/{id}/pause"), json!({})).await;
                id
            }
            "/studies/{id}/ask" | "/studies/{id}/extend" => self.script.to_string(),
            "/studies/{id}/raters/unblind" => self.human.to_string(),
            path if path.starts_with("/studies/{id}") => self.finished.to_string(),
            path if path.starts_with("/subjects/{id}") => self.subject().await,
            "/trials/{id}/tell" => {
                let open = self.service.trials(self.script).await.into_iter().find(|trial| trial.state.is_open());
                match open {
                    Some(open) => open.id.to_string(),
                    None => self.id_of(&format!("/studies/{}/ask", self.script), json!({})).await,
                }
            }
            path if path.starts_with("/trials/{id}") => {
                let trial = self.trials[4];
                let body = json!({"trial_a": trial, "trial_b": self.trials[5], "answer": "unsafe_a"});
                self.post(&format!("/studies/{}/assessments", self.finished), body).await;
                trial.to_string()
            }
            path if path.starts_with("/preferences/{id}") => self.said("preferences").await,
            path if path.starts_with("/assessments/{id}") => self.said("assessments").await,
            path if path.starts_with("/suggestions/{id}") => self.said("suggestions").await,
            "/lab-sessions/{id}/emg-results" => {
                let id = self.session(true).await;
                let emg =
                    json!({"walk": 1, "recording": electromyogram(1.0), "reading": {"heel_strike_column": "heel"}});
                self.post(&format!("/lab-sessions/{id}/measurement-files/emg"), emg).await;
                id
            }
            path if path.starts_with("/lab-sessions/{id}/walks") => self.session(false).await,
            path if path.starts_with("/lab") => self.session(true).await,
            path if path.starts_with("/users/{id}") => {
                let name = format!("user {}", self.number());
                self.id_of("/users", json!({"name": name, "role": "rater"})).await
            }
            path if path.contains('{') => panic!("{path}: nothing stands for its parameter"),
            _ => String::new(),
        })
    }

    /// The response to a body. A target that was not changed is used for the next body.
    async fn send(&mut self, method: &str, path: &str, body: &Value, target: &mut Option<String>) -> Option<Answer> {
        if target.is_none() {
            *target = self.target(path).await;
        }
        let known = target.as_ref()?;
        let address = path.replace("{id}", known).replace("{code}", known);
        let answer = self.request(method, &address, body).await;
        if answer.status.is_success() {
            *target = None;
        }
        Some(answer)
    }
}

/// Valid values of fields that refer to objects of the record.
async fn known(scene: &Scene) -> BTreeMap<&'static str, Vec<Value>> {
    let trials: Vec<Value> = scene.trials.iter().take(4).map(|id| json!(id)).collect();
    let devices = scene.service.fetch("/api/v1/devices").await.items();
    let rater = scene.service.fetch(&format!("/api/v1/studies/{}/raters", scene.human)).await.items();
    let mut known: BTreeMap<&'static str, Vec<Value>> =
        ["trial_a", "over"].map(|field| (field, trials[..2].to_vec())).into();
    known.insert("trial_b", trials[2..].to_vec());
    known.insert("subject_id", vec![json!(scene.service.subject().await)]);
    known.insert("device_id", vec![devices[0]["id"].clone()]);
    known.insert("reference_gait_id", vec![json!(scene.service.reference().await)]);
    known.insert("rater", vec![rater[0]["rater"].clone()]);
    known.insert("replaces", vec![Value::Null]);
    // Studies that are created here must not start.
    known.insert("start", vec![json!(false)]);
    known
}

/// Valid values for single operations, such as files, whose content the description does not define.
fn known_to(path: &str, trials: &[TrialId]) -> BTreeMap<&'static str, Vec<Value>> {
    let reading = |kind: Value| ("reading", vec![kind]);
    let gaits = |trials: &[TrialId]| trials.iter().map(|id| json!(id)).collect();
    match path {
        // These gaits may be reported as unsafe, so no other operation uses them.
        path if path.ends_with("/assessments") => {
            BTreeMap::from([("trial_a", gaits(&trials[6..8])), ("trial_b", gaits(&trials[8..10]))])
        }
        path if path.ends_with("/members") => BTreeMap::from([("name", vec![json!(MEMBER)])]),
        path if path.ends_with("/measurement-files/emg") => BTreeMap::from([
            ("recording", vec![json!(electromyogram(1.0))]),
            reading(json!({"heel_strike_column": "heel"})),
        ]),
        path if path.ends_with("/measurement-files/joint-angles") => {
            BTreeMap::from([("recording", vec![json!(joint_angles())]), reading(json!({}))])
        }
        path if path.ends_with("/reference-gaits") => BTreeMap::from([
            ("recording", vec![json!(four_strides(100))]),
            ("format", vec![json!("csv")]),
            // Names of columns are those of the file.
            ("columns", vec![json!({})]),
            ("strikes", vec![json!("kinematics")]),
            ("forces", vec![Value::Null]),
            ("force_column", vec![Value::Null]),
            ("heel_strikes_s", vec![json!([])]),
            ("unit", vec![Value::Null]),
        ]),
        _ => BTreeMap::new(),
    }
}

/// Whether the description has a rule in `x-depends` for the refused field or for a field that contains it.
fn is_said_in_words(drawn: &Drawn, schema: &Value, field: &str) -> bool {
    let mut here = drawn.resolved(schema);
    let mut said = here["x-depends"].is_string();
    for name in field.split('.') {
        let name = name.split('[').next().unwrap();
        // An error in a file names a property of the file, not a field of the body.
        let Some(next) = here["properties"].get(name).cloned() else { continue };
        said |= next["x-depends"].is_string();
        here = drawn.resolved(&next);
        said |= here["x-depends"].is_string();
    }
    said
}

#[tokio::test]
async fn bodies_are_accepted_if_and_only_if_they_match_the_description() {
    let (_folder, mut scene) = Scene::set().await;
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let mut drawn = Drawn::from(document.clone());
    scene.post("/users", json!({"name": MEMBER, "role": "rater"})).await;
    // A rater exists once a pair was drawn.
    scene.target("/blind-pairs/{code}/answer").await;
    let common = known(&scene).await;
    let (mut faults, mut never, mut accepted, mut refused) = (Vec::new(), Vec::new(), 0, 0);
    for (path, item) in document["paths"].as_object().unwrap() {
        let path = path.trim_start_matches("/api/v1");
        for (method, operation) in item.as_object().unwrap() {
            let schema = &operation["requestBody"]["content"]["application/json"]["schema"];
            if schema.is_null() {
                continue;
            }
            drawn.known = common.clone();
            drawn.known.extend(known_to(path, &scene.trials));
            let (before, mut target) = (accepted, None);
            for _ in 0..DRAWS {
                let body = drawn.body(schema);
                let Some(answer) = scene.send(method, path, &body, &mut target).await else { break };
                let state = [StatusCode::CONFLICT, StatusCode::NOT_FOUND].contains(&answer.status);
                let field = serde_json::from_str::<Value>(&answer.text).unwrap_or_default()["field"].clone();
                let in_words = answer.status == StatusCode::UNPROCESSABLE_ENTITY
                    && is_said_in_words(&drawn, schema, field.as_str().unwrap_or_default());
                let without_simulator =
                    answer.status == StatusCode::SERVICE_UNAVAILABLE && format!("{method} {path}") == SIMULATE;
                if !(answer.status.is_success() || state || in_words || without_simulator) {
                    faults.push(format!("{method} {path}: {body} is refused: {}", answer.text));
                }
                accepted += usize::from(answer.status.is_success());
            }
            if accepted == before {
                never.push(format!("{method} {path}"));
            }
            let mut statuses = Vec::new();
            for (why, body) in drawn.beyond(schema) {
                let Some(answer) = scene.send(method, path, &body, &mut target).await else { break };
                if [StatusCode::BAD_REQUEST, StatusCode::UNPROCESSABLE_ENTITY].contains(&answer.status) {
                    refused += 1;
                } else {
                    faults.push(format!("{method} {path}: {why}: {}: {body}: {:.300}", answer.status, answer.text));
                }
                statuses.push(answer.status);
            }
            if operation["responses"].get("422").is_some() && !statuses.contains(&StatusCode::UNPROCESSABLE_ENTITY) {
                faults.push(format!("{method} {path} is described to answer 422: {statuses:?}"));
            }
        }
    }
    println!("{accepted} drawn bodies accepted, {refused} bodies beyond the description refused");
    never.retain(|operation| !SELDOM_FIT.contains(&operation.as_str()));
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
    assert!(never.is_empty(), "no drawn body was accepted by {never:?}");
    assert!(accepted > 200 && refused > 150, "{accepted} accepted, {refused} refused");
    scene.service.stop().await;
}
