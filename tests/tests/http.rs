//! The REST interface and the pages, through the router.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::body::Body;
use axum::http::{Request, StatusCode};
use gait_optimizer::TunedBounds;
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_store::trials::TrialState;
use gaitwright_store::{StudyId, events};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::{Answer, Service};
use http_body_util::BodyExt;
use serde_json::{Value, json};
use std::time::Duration;
use tempfile::TempDir;
use tower::ServiceExt;

const PROBLEM: &str = "application/problem+json";

async fn service() -> (TempDir, Service) {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    (folder, service)
}

async fn finished(service: &Service, trials: u32) -> StudyId {
    let study = service.study(|new| new.number_of_trials = trials).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    study
}

#[track_caller]
fn is_problem(answer: &Answer, status: StatusCode, kind: &str, detail: &str) {
    assert_eq!(answer.status, status, "{}", answer.text);
    assert_eq!(answer.content_type(), PROBLEM);
    let body = answer.json();
    assert_eq!(body["type"], kind);
    assert_eq!(body["status"], status.as_u16());
    assert!(body["detail"].as_str().unwrap().contains(detail), "{body}");
}

#[tokio::test]
async fn health_is_ready() {
    let (_folder, service) = service().await;
    let answer = service.fetch("/health").await;
    assert_eq!(answer.status, StatusCode::OK);
    assert_eq!(answer.json()["status"], "healthy");
    service.stop().await;
}

#[tokio::test]
async fn subjects_are_created_listed_and_refused() {
    let (_folder, service) = service().await;
    let body = json!({"pseudonym": "S01", "height_m": 1.8, "body_mass_kg": 70.5, "notes": "left-handed"});
    let made = service.post("/api/v1/subjects", &body).await;
    assert_eq!(made.status, StatusCode::CREATED);
    let location = made.headers["location"].to_str().unwrap().to_owned();
    assert_eq!(service.fetch(&location).await.json(), made.json());
    assert_eq!(service.fetch("/api/v1/subjects").await.items().as_array().unwrap().len(), 3);

    is_problem(&service.post("/api/v1/subjects", &body).await, StatusCode::CONFLICT, "/problems/conflict", "S01");
    let with = |field: &str, value: Value| {
        let mut body = json!({"pseudonym": "S02", "height_m": 1.8, "body_mass_kg": 70.5});
        body[field] = value;
        body
    };
    let invalid = "/problems/invalid-field";
    for (field, value, detail) in [
        ("height_m", json!(17.27), "1.4 to 2.2"),
        ("body_mass_kg", json!(-1), "35 to 160"),
        ("pseudonym", json!("jane@example.org"), "not an address"),
        ("pseudonym", json!("1980-02-03"), "a date"),
        ("pseudonym", json!(" "), "1 to 40"),
        ("notes", json!("bell\u{7}"), "printable characters"),
    ] {
        let answer = service.post("/api/v1/subjects", &with(field, value.clone())).await;
        is_problem(&answer, StatusCode::UNPROCESSABLE_ENTITY, invalid, detail);
        assert_eq!(answer.json()["field"], field);
    }
    for (body, detail) in [
        (with("height_m", json!("tall")), "field height_m"),
        (with("name", json!("Jane")), "field name is unknown"),
        (json!({"pseudonym": "S03"}), "field height_m is missing"),
        (json!("a subject"), "The document is not an object with named fields"),
        (json!(["S03", 1.7, 65]), "is not an object with named fields"),
    ] {
        is_problem(
            &service.post("/api/v1/subjects", &body).await,
            StatusCode::BAD_REQUEST,
            "/problems/malformed",
            detail,
        );
    }
    let answer = service.post_text("/api/v1/subjects", "application/json", "{\"pseudonym\": ").await;
    is_problem(&answer, StatusCode::BAD_REQUEST, "/problems/malformed", "EOF");
    let answer = service.post_text("/api/v1/subjects", "text/plain", "{}").await;
    let (unsupported, kind) = (StatusCode::UNSUPPORTED_MEDIA_TYPE, "/problems/unsupported-media-type");
    is_problem(&answer, unsupported, kind, "application/json");
    assert_eq!(service.fetch("/api/v1/subjects").await.items().as_array().unwrap().len(), 3, "nothing changed");
    service.stop().await;
}

#[tokio::test]
async fn unknown_objects_are_not_found() {
    let (_folder, service) = service().await;
    let unknown = "01890000-0000-7000-8000-000000000000";
    for path in [
        format!("/api/v1/trials/{unknown}"),
        format!("/api/v1/trials/{unknown}/gait"),
        format!("/api/v1/studies/{unknown}"),
        format!("/api/v1/studies/{unknown}/trials"),
        format!("/api/v1/studies/{unknown}/history"),
        format!("/api/v1/studies/{unknown}/preferences"),
        format!("/api/v1/studies/{unknown}/events"),
        format!("/api/v1/subjects/{unknown}"),
        "/api/v1/trials/seven".to_owned(),
    ] {
        let answer = service.fetch(&path).await;
        is_problem(&answer, StatusCode::NOT_FOUND, "/problems/not-found", "There is no ");
    }
    let nowhere = "The address /api/v1/nothing does not exist.";
    is_problem(&service.fetch("/api/v1/nothing").await, StatusCode::NOT_FOUND, "/problems/not-found", nowhere);
    for path in [format!("/studies/{unknown}"), format!("/trials/{unknown}"), "/nothing".to_owned()] {
        let answer = service.fetch(&path).await;
        assert_eq!(answer.status, StatusCode::NOT_FOUND);
        assert!(answer.content_type().starts_with("text/html"));
    }
    let body = json!({"subject_id": unknown});
    is_problem(&service.post("/api/v1/studies", &body).await, StatusCode::NOT_FOUND, "/problems/not-found", "subject");
    service.stop().await;
}

#[tokio::test]
async fn study_is_created_run_and_read_as_json_and_csv() {
    let (_folder, service) = service().await;
    let body = json!({"subject_id": service.subject().await, "number_of_trials": 5, "seed": 3, "name": "First"});
    let made = service.post("/api/v1/studies", &body).await;
    assert_eq!(made.status, StatusCode::CREATED, "{}", made.text);
    let study: StudyId = made.json()["id"].as_str().unwrap().parse().unwrap();
    service.wait_for(study, &[StudyState::Finished]).await;

    let read = service.fetch(&format!("/api/v1/studies/{study}")).await.json();
    assert_eq!((&read["name"], &read["trials"]["total"]), (&json!("First"), &json!(5)));
    let page = service.fetch(&format!("/api/v1/studies/{study}/trials?limit=3")).await.json();
    assert_eq!(page["items"].as_array().unwrap().len(), 3);
    let next = page["next"].as_str().unwrap();
    let page = service.fetch(&format!("/api/v1/studies/{study}/trials?limit=3&cursor={next}")).await.json();
    assert_eq!((page["items"].as_array().unwrap().len(), &page["next"]), (2, &Value::Null));

    let csv = service.fetch(&format!("/api/v1/studies/{study}/trials.csv")).await;
    assert!(csv.content_type().starts_with("text/csv"));
    assert_eq!(csv.text.lines().count(), 6);
    let header = format!("number,trial_id,{},state,gait_rmse_rad", TunedBounds::NAMES.join(","));
    assert!(csv.text.starts_with(&header));

    let history = service.fetch(&format!("/api/v1/studies/{study}/history")).await.items();
    assert_eq!(history.as_array().unwrap().last().unwrap()["iteration"], 5);

    let trial = page["items"][1]["id"].as_str().unwrap().to_owned();
    let gait = service.fetch(&format!("/api/v1/trials/{trial}/gait")).await;
    assert_eq!(gait.json()["domains"].as_array().unwrap().len(), 8);
    let csv = service.fetch(&format!("/api/v1/trials/{trial}/gait.csv")).await;
    assert_eq!(csv.text.lines().count(), 1 + 8 * 9);
    let iterations = service.fetch(&format!("/api/v1/trials/{trial}/iterations")).await.items();
    assert_eq!(iterations.as_array().unwrap().len(), 12);
    service.stop().await;
}

#[tokio::test]
async fn invalid_study_is_refused_with_the_field() {
    let (_folder, service) = service().await;
    let subject = service.subject().await;
    let unprocessable = StatusCode::UNPROCESSABLE_ENTITY;
    for (field, value, named) in [
        ("number_of_trials", json!(0), "number_of_trials"),
        ("parallel_trials", json!(65), "parallel_trials"),
        ("priority", json!(11), "priority"),
        ("seed", json!(9_007_199_254_740_992_u64), "seed"),
        ("name", json!("x".repeat(121)), "name"),
        ("base_bounds", json!({"a1": 1e9}), "base_bounds.a1"),
        ("base_bounds", json!({"a3": 1.4, "a4": 1.2}), "base_bounds.a3"),
        ("gait_settings", json!({"mesh": {"ds2": 0}}), "gait_settings.mesh.ds2"),
        ("solve_options", json!({"threads": 17}), "solve_options.threads"),
        (
            "search_space",
            json!({"dimensions": [{"name": "a0", "values": [1.0], "lengthscale": 1.0}]}),
            "search_space.dimensions[0].name",
        ),
        (
            "search_space",
            json!({"dimensions": [{"name": "a1", "values": [20, 15], "lengthscale": 1}]}),
            "search_space.dimensions[0].values",
        ),
        (
            "search_space",
            json!({"dimensions": [{"name": "a1", "values": [15, 20], "lengthscale": 0}]}),
            "search_space.dimensions[0].lengthscale",
        ),
        ("learner", json!({"preference_noise": -1.0}), "learner.preference_noise"),
        ("learner", json!({"nugget": 2.0}), "learner.nugget"),
        ("learner", json!({"ordinal_thresholds": [0.0, 1.0]}), "learner.ordinal_thresholds"),
    ] {
        let mut body = json!({"subject_id": subject});
        body[field] = value;
        let answer = service.post("/api/v1/studies", &body).await;
        assert_eq!(answer.status, unprocessable, "{field}: {}", answer.text);
        assert_eq!(answer.json()["field"], named);
    }
    assert_eq!(service.fetch("/api/v1/studies").await.items(), json!([]));
    service.stop().await;
}

#[tokio::test]
async fn preferences_are_created_read_and_retracted() {
    let (_folder, service) = service().await;
    let study = finished(&service, 4).await;
    let trials = service.trials(study).await;
    let converged: Vec<_> = trials.iter().filter(|t| t.state == TrialState::Converged).map(|t| t.id).collect();
    let path = format!("/api/v1/studies/{study}/preferences");
    let before = service.fetch(&path).await.items().as_array().unwrap().len();

    let body = json!({"trial_a": converged[0], "trial_b": converged[1], "answer": "b", "author": "Dr K"});
    let given = service.post(&path, &body).await;
    assert_eq!(given.status, StatusCode::CREATED, "{}", given.text);
    let mut row = given.json();
    assert_eq!(row.as_object_mut().unwrap().remove("other_answers"), Some(json!([])), "nobody else answered this");
    assert_eq!((&row["content"]["kind"], &row["content"]["winner"]), (&json!("preference"), &json!(converged[1])));
    assert_eq!(service.fetch(given.headers["location"].to_str().unwrap()).await.json(), row);

    let equal = json!({"trial_a": converged[0], "trial_b": converged[1], "answer": "no_difference"});
    assert_eq!(service.post(&path, &equal).await.json()["content"]["kind"], "no_difference");

    let unprocessable = StatusCode::UNPROCESSABLE_ENTITY;
    let itself = json!({"trial_a": converged[0], "trial_b": converged[0], "answer": "a"});
    is_problem(&service.post(&path, &itself).await, unprocessable, "/problems/invalid-field", "itself");
    let unknown = json!({"trial_a": converged[0], "trial_b": "01890000-0000-7000-8000-000000000000", "answer": "a"});
    is_problem(&service.post(&path, &unknown).await, unprocessable, "/problems/invalid-field", "trial_b");
    let ghost = json!({"trial_a": converged[0], "trial_b": converged[1], "answer": "a", "note": "a\u{0}b"});
    is_problem(&service.post(&path, &ghost).await, unprocessable, "/problems/invalid-field", "note");
    let neither = json!({"trial_a": converged[0], "trial_b": converged[1], "answer": "both"});
    is_problem(&service.post(&path, &neither).await, StatusCode::BAD_REQUEST, "/problems/malformed", "answer");
    let other = finished(&service, 2).await;
    let foreign = service.trials(other).await[0].id;
    let mixed = json!({"trial_a": converged[0], "trial_b": foreign, "answer": "a"});
    is_problem(&service.post(&path, &mixed).await, unprocessable, "/problems/invalid-field", "of this study");
    let machine = json!({"trial_a": converged[0], "trial_b": converged[1], "answer": "a", "source": "gait_rmse"});
    is_problem(&service.post(&path, &machine).await, StatusCode::BAD_REQUEST, "/problems/malformed", "source");
    assert_eq!(service.fetch(&path).await.items().as_array().unwrap().len(), before + 2);

    let retract = format!("/api/v1/preferences/{}/retract", row["id"].as_str().unwrap());
    let without = service.post(&retract, &json!({"reason": " "})).await;
    is_problem(&without, unprocessable, "/problems/invalid-field", "say why the preference is retracted");
    let done = service.post(&retract, &json!({"reason": "wrong button", "author": "Dr K"})).await.json();
    assert_eq!(done["retraction"]["reason"], "wrong button");
    let again = service.post(&retract, &json!({"reason": "wrong button"})).await;
    is_problem(&again, StatusCode::CONFLICT, "/problems/conflict", "already");
    assert_eq!(service.fetch(&path).await.items().as_array().unwrap().len(), before + 2, "the row stays");
    service.stop().await;
}

#[tokio::test]
async fn study_with_human_answers_waits_for_each_and_page_and_rest_have_the_same_effect() {
    let (_folder, service) = service().await;
    let study = service.study(|new| (new.number_of_trials, new.answer_source) = (4, AnswerSource::People)).await;
    let mut through_form = false;
    loop {
        let present = service.wait_for(study, &[StudyState::Waiting, StudyState::Finished]).await;
        if present.state == StudyState::Finished {
            break;
        }
        let trials = service.trials(study).await;
        let newest = trials.last().unwrap().id;
        let before = trials[trials.len() - 2].id;
        if through_form {
            let form = format!("a={newest}&b={before}&answer=a&source=clinician&author=K&note=&key={newest}");
            let path = format!("/studies/{study}/compare");
            let saved = service.post_text(&path, "application/x-www-form-urlencoded", &form).await;
            assert_eq!(saved.status, StatusCode::SEE_OTHER, "{}", saved.text);
            let page = service.fetch(saved.headers["location"].to_str().unwrap()).await;
            assert!(page.text.contains("Saved"), "the answer is read back");
        } else {
            let body = json!({"trial_a": newest, "trial_b": before, "answer": "a", "author": "K"});
            let path = format!("/api/v1/studies/{study}/preferences");
            assert_eq!(service.post(&path, &body).await.status, StatusCode::CREATED);
        }
        through_form = !through_form;
        // The scheduler reads the answer a moment later.
        while service.get(study).await.state == StudyState::Waiting && service.trials(study).await.len() == trials.len()
        {
            tokio::time::sleep(std::time::Duration::from_millis(2)).await;
        }
    }
    let rows = service.fetch(&format!("/api/v1/studies/{study}/preferences")).await.items();
    let rows = rows.as_array().unwrap();
    assert_eq!(rows.len(), 3);
    for row in rows {
        assert_eq!(
            (&row["content"]["kind"], &row["source"], &row["author"], &row["note"]),
            (&json!("preference"), &json!("clinician"), &json!("K"), &json!(""))
        );
    }
    service.stop().await;
}

#[tokio::test]
async fn study_is_paused_resumed_and_stopped_and_refuses_invalid_changes_of_state() {
    let folder = tempfile::tempdir().unwrap();
    let slow = Analytic::slow(std::time::Duration::from_millis(10));
    let service = Service::start(&folder.path().join("a.db"), slow, 1).await;
    let study = service.study(|new| new.number_of_trials = 50).await;
    let act = |act: &str| format!("/api/v1/studies/{study}/{act}");
    let nothing = json!({});
    assert_eq!(service.post(&act("pause"), &nothing).await.json()["state"], "paused");
    let twice = service.post(&act("pause"), &nothing).await;
    is_problem(&twice, StatusCode::CONFLICT, "/problems/conflict", "Possible now: resume, stop");
    assert_eq!(service.post(&act("resume"), &nothing).await.json()["state"], "running");
    service.wait_for_trials(study, 2).await;
    assert_eq!(service.post(&act("stop"), &nothing).await.json()["state"], "stopped");
    let trials = service.trials(study).await;
    assert!(trials.iter().all(|trial| !trial.state.is_open()), "{trials:?}");
    assert!(trials.len() < 50);
    service.stop().await;
}

#[tokio::test]
async fn overlong_reason_is_refused() {
    let (_folder, service) = service().await;
    let study = service.study(|new| new.start = false).await;
    let path = format!("/api/v1/studies/{study}/start");
    let refused = service.post(&path, &json!({"reason": "x".repeat(2001)})).await;
    is_problem(&refused, StatusCode::UNPROCESSABLE_ENTITY, "/problems/invalid-field", "reason");
    assert_eq!(service.post(&path, &json!({"reason": "x".repeat(2000)})).await.status, StatusCode::OK);
    service.stop().await;
}

#[tokio::test]
async fn trial_is_cancelled_and_retried() {
    let folder = tempfile::tempdir().unwrap();
    let slow = Analytic::slow(std::time::Duration::from_millis(20));
    let service = Service::start(&folder.path().join("a.db"), slow, 1).await;
    let study = service.study(|new| new.number_of_trials = 1).await;
    while service.trials(study).await.first().is_none_or(|t| t.state != TrialState::Running) {
        tokio::time::sleep(std::time::Duration::from_millis(5)).await;
    }
    let trial = service.trials(study).await[0].id;
    let cancelled = service.post(&format!("/api/v1/trials/{trial}/cancel"), &json!({})).await;
    assert_eq!(cancelled.json()["state"], "cancelled");
    service.wait_for(study, &[StudyState::Finished]).await;
    let again = service.post(&format!("/api/v1/trials/{trial}/cancel"), &json!({})).await;
    is_problem(&again, StatusCode::CONFLICT, "/problems/conflict", "cancelled");
    assert!(service.feedback(study).await.is_empty(), "the learner does not hear of it");

    let more = service.post(&format!("/api/v1/studies/{study}/extend"), &json!({"number_of_trials": 2})).await;
    assert_eq!(more.status, StatusCode::OK, "{}", more.text);
    let retried = service.post(&format!("/api/v1/trials/{trial}/retry"), &json!({})).await;
    assert_eq!(retried.status, StatusCode::ACCEPTED, "{}", retried.text);
    let job = service.fetch(retried.headers["location"].to_str().unwrap()).await.json();
    assert_eq!((&job["id"], &job["kind"]), (&json!(format!("solve-{trial}")), &json!("solve")));
    service.wait_for(study, &[StudyState::Finished]).await;
    let states: Vec<_> = service.trials(study).await.iter().map(|trial| (trial.id, trial.state.is_result())).collect();
    assert!(states.contains(&(trial, true)), "it was not run again: {states:?}");
    service.stop().await;
}

#[tokio::test]
async fn pages_are_served_without_external_resources() {
    let (_folder, service) = service().await;
    let empty = service.fetch("/").await;
    assert!(empty.text.contains("No studies yet"));
    let study = finished(&service, 4).await;
    let trial = service.trials(study).await[2].id;
    for path in [
        "/".to_owned(),
        "/studies/new".to_owned(),
        format!("/studies/{study}"),
        format!("/studies/{study}/compare"),
        format!("/trials/{trial}"),
    ] {
        let page = service.fetch(&path).await;
        assert_eq!(page.status, StatusCode::OK, "{path}: {}", page.text);
        let policy = page.headers["content-security-policy"].to_str().unwrap();
        assert!(policy.contains("default-src 'self'") && !policy.contains("unsafe"));
        for foreign in ["src=\"http", "href=\"http", "src=\"//", "style=\"", "onclick", "javascript:"] {
            assert!(!page.text.contains(foreign), "{path} holds {foreign}");
        }
    }
    for file in ["gaitwright.css", "live.mjs", "icon.svg"] {
        assert_eq!(service.fetch(&format!("/static/{file}")).await.status, StatusCode::OK);
    }
    assert_eq!(service.fetch("/static/../Cargo.toml").await.status, StatusCode::NOT_FOUND);
    service.stop().await;
}

#[tokio::test]
async fn text_is_compressed_unless_it_has_a_strong_entity_tag_or_is_a_stream() {
    let (_folder, service) = service().await;
    let study = finished(&service, 2).await;
    let compressed = async |path: &str| {
        let request = Request::get(path).header("accept-encoding", "gzip").body(Body::empty()).unwrap();
        let answer = service.send(request).await;
        assert_eq!(answer.status, StatusCode::OK, "{path}");
        answer.headers.get("content-encoding").is_some_and(|encoding| encoding == "gzip")
    };
    for path in [
        "/static/gaitwright.css".to_owned(),
        "/static/gait.mjs".to_owned(),
        format!("/studies/{study}"),
        format!("/api/v1/studies/{study}/trials"),
    ] {
        assert!(compressed(&path).await, "{path}");
        assert!(!service.fetch(&path).await.headers.contains_key("content-encoding"), "{path}: nobody asked for gzip");
    }
    for path in [format!("/api/v1/studies/{study}"), format!("/api/v1/studies/{study}/archive"), "/health".to_owned()] {
        assert!(!compressed(&path).await, "{path}");
    }
    let events = Request::get(format!("/api/v1/studies/{study}/events")).header("accept-encoding", "gzip");
    let events = service.router().oneshot(events.body(Body::empty()).unwrap()).await.unwrap();
    assert_eq!(events.headers()["content-type"], "text/event-stream");
    assert!(!events.headers().contains_key("content-encoding"), "events must not wait in a buffer");
    let tag = service.fetch("/static/live.mjs").await.headers["etag"].to_str().unwrap().to_owned();
    let known = Request::get("/static/live.mjs").header("if-none-match", &tag).body(Body::empty()).unwrap();
    assert_eq!(service.send(known).await.status, StatusCode::NOT_MODIFIED);
    service.stop().await;
}

#[tokio::test]
async fn long_refusal_is_encoded_as_its_header_says() {
    let (_folder, service) = service().await;
    let path = format!("/api/v1/studies?state={}", "a".repeat(2000));
    for accepted in ["gzip", "identity"] {
        let request = Request::get(&path).header("accept-encoding", accepted).body(Body::empty()).unwrap();
        let answer = service.router().oneshot(request).await.unwrap();
        assert_eq!(answer.status(), StatusCode::UNPROCESSABLE_ENTITY);
        let says_gzip = answer.headers().get("content-encoding").is_some_and(|encoding| encoding == "gzip");
        let body = axum::body::to_bytes(answer.into_body(), 1 << 20).await.unwrap();
        assert_eq!(says_gzip, body.starts_with(&[0x1f, 0x8b]), "{accepted}");
        assert_eq!(says_gzip, accepted == "gzip");
    }
    service.stop().await;
}

#[tokio::test]
async fn refused_study_form_is_shown_again_with_its_errors() {
    let (_folder, service) = service().await;
    let form = |height: &str, trials: &str| {
        format!(
            "subject=new&pseudonym=S07&height_m={height}&body_mass_kg=70&muscles=on&answer_source=gait_rmse\
             &number_of_trials={trials}&parallel_trials=1&seed=1&name="
        )
    };
    let kind = "application/x-www-form-urlencoded";
    let refused = service.post_text("/studies/new", kind, &form("17.27", "3")).await;
    assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY);
    assert!(refused.text.contains("\u{201c}Height, m\u{201d} is 17.27; it must be 1.4 to 2.2."));
    assert!(refused.text.contains("value=\"17.27\""), "what was typed is kept");
    let refused = service.post_text("/studies/new", kind, &form("1.7", "many")).await;
    assert_eq!(refused.status, StatusCode::UNPROCESSABLE_ENTITY);
    assert_eq!(service.fetch("/api/v1/subjects").await.items().as_array().unwrap().len(), 2, "nothing is left of it");
    let made = service.post_text("/studies/new", kind, &form("1.7", "3")).await;
    assert_eq!(made.status, StatusCode::SEE_OTHER);
    assert!(service.fetch(made.headers["location"].to_str().unwrap()).await.text.contains("S07"));
    service.stop().await;
}

#[tokio::test]
async fn requests_from_another_site_cannot_change_anything() {
    let (_folder, service) = service().await;
    let send = |headers: &[(&str, &str)]| {
        let mut request = axum::http::Request::post("/api/v1/subjects").header("content-type", "application/json");
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        let body = json!({"pseudonym": "S01", "height_m": 1.8, "body_mass_kg": 70.5}).to_string();
        request.body(axum::body::Body::from(body)).unwrap()
    };
    for foreign in [
        &[("sec-fetch-site", "cross-site")][..],
        &[("sec-fetch-site", "same-site")],
        &[("origin", "http://evil.example"), ("host", "127.0.0.1:8080")],
        &[("origin", "null"), ("host", "127.0.0.1:8080")],
    ] {
        let answer = service.send(send(foreign)).await;
        is_problem(&answer, StatusCode::FORBIDDEN, "/problems/forbidden", "another origin");
    }
    assert_eq!(service.fetch("/api/v1/subjects").await.items().as_array().unwrap().len(), 2);
    let ours = [("origin", "http://127.0.0.1:8080"), ("host", "127.0.0.1:8080")];
    assert_eq!(service.send(send(&ours)).await.status, StatusCode::CREATED);
    service.stop().await;
}

#[tokio::test]
async fn invalid_page_size_is_refused_with_the_range() {
    let (_folder, service) = service().await;
    let study = finished(&service, 2).await;
    let lists = [
        "subjects".to_owned(),
        "audit".to_owned(),
        format!("studies/{study}/trials"),
        format!("studies/{study}/preferences"),
    ];
    for list in lists {
        for limit in ["0", "-1", "1001", "99999999999", "many", ""] {
            let refused = service.fetch(&format!("/api/v1/{list}?limit={limit}")).await;
            is_problem(&refused, StatusCode::UNPROCESSABLE_ENTITY, "/problems/invalid-field", "limit");
            assert_eq!((&refused.json()["value"], &refused.json()["allowed"]), (&json!(limit), &json!("1 to 1000")));
        }
        assert_eq!(service.fetch(&format!("/api/v1/{list}?limit=1")).await.status, StatusCode::OK);
    }
    service.stop().await;
}

/// The events of a study as they come.
async fn stream_of(service: &Service, study: StudyId, last_seen: Option<i64>) -> impl AsyncFnMut() -> String + use<> {
    let mut request = Request::get(format!("/api/v1/studies/{study}/events"));
    if let Some(seen) = last_seen {
        request = request.header("last-event-id", seen);
    }
    let mut stream = service.router().oneshot(request.body(Body::empty()).unwrap()).await.unwrap().into_body();
    async move || {
        let frame = tokio::time::timeout(Duration::from_secs(20), stream.frame()).await.unwrap().unwrap().unwrap();
        String::from_utf8(frame.into_data().unwrap().to_vec()).unwrap()
    }
}

#[tokio::test]
async fn events_after_the_last_received_one_are_replayed() {
    let (_folder, service) = service().await;
    let study = finished(&service, 2).await;
    let recorded = events::after(&mut service.store.read().await.unwrap(), study, 0, 100).await.unwrap();
    assert!(recorded.len() > 5, "{recorded:?}");
    let mut next_event = stream_of(&service, study, Some(recorded[1].seq)).await;
    assert!(next_event().await.contains("event: study_state"));
    let mut text = String::new();
    while text.matches("id: ").count() < recorded.len() - 2 {
        text.push_str(&next_event().await);
    }
    let seen: Vec<i64> = text.lines().filter_map(|line| line.strip_prefix("id: ")?.parse().ok()).collect();
    let expected: Vec<i64> = recorded[2..].iter().map(|event| event.seq).collect();
    assert_eq!(seen, expected);
    service.stop().await;
}

#[tokio::test]
async fn event_stream_reports_the_end_of_a_study_and_resumes_with_it() {
    let (_folder, service) = service().await;
    let study = finished(&service, 2).await;
    let path = format!("/api/v1/studies/{study}");
    let mut next_event = stream_of(&service, study, None).await;
    let first = next_event().await;
    assert!(
        first.contains("event: study_state") && first.contains("finished") && first.contains("All 2 trials"),
        "{first}"
    );
    let extended = service.post(&format!("{path}/extend"), &json!({"number_of_trials": 3})).await;
    assert_eq!(extended.status, StatusCode::OK, "{}", extended.text);
    let next = next_event().await;
    assert!(next.contains("event: study_changed") && next.contains("running") && next.contains("id: "), "{next}");
    service.stop().await;
}
