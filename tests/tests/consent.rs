//! Withdrawal of consent: studies stop, no data is added, shown or exported, and the record is kept.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::body::Body;
use axum::http::{Request, StatusCode};
use gaitwright_http::openapi;
use gaitwright_store::audit;
use gaitwright_store::studies::{AnswerSource, Evaluation, StudyState};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::archives::{exported, import};
use gaitwright_tests::cli;
use gaitwright_tests::consistent_gaits::Consistent;
use gaitwright_tests::measured::joint_angles;
use gaitwright_tests::service::Service;
use serde_json::{Value, json};
use std::time::Duration;

/// Responses about the service, and lists of objects without their results. They stay available after a withdrawal.
const OF_NO_SUBJECT: [&str; 20] = [
    "/api/v1/access-log",
    "/api/v1/audit",
    "/api/v1/backups/{id}",
    "/api/v1/devices",
    "/api/v1/devices/{id}",
    "/api/v1/health",
    "/api/v1/jobs",
    "/api/v1/me",
    "/api/v1/reference-gaits",
    "/api/v1/reference-gaits/{id}",
    "/api/v1/reference-gaits/{id}/figures/{file}",
    "/api/v1/sessions",
    "/api/v1/studies",
    "/api/v1/study-members/{id}",
    "/api/v1/subjects",
    "/api/v1/tokens",
    "/api/v1/tokens/{id}",
    "/api/v1/users",
    "/api/v1/users/{id}",
    "/api/v1/workers",
];

#[tokio::test]
async fn withdrawal_stops_all_writes_and_exports() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::slow(Duration::from_millis(20)), 1).await;
    let person = service.subject().await;
    let finished = service.study(|new| new.number_of_trials = 3).await;
    service.wait_for(finished, &[StudyState::Finished]).await;
    let draft = service.study(|new| new.start = false).await;
    let human = service.study(|new| (new.number_of_trials, new.answer_source) = (6, AnswerSource::People)).await;
    service.wait_for(human, &[StudyState::Waiting]).await;
    let pair = service.post(&format!("/api/v1/studies/{human}/blind-pairs/next"), &json!({})).await.json();
    let code = pair["pair"]["code"].as_str().unwrap().to_owned();
    let script = service.study(|new| (new.number_of_trials, new.evaluation) = (3, Evaluation::Script)).await;
    let asked = service.post(&format!("/api/v1/studies/{script}/ask"), &json!({})).await.json();
    // One is open at any instant.
    let running = service.study(|new| (new.number_of_trials, new.parallel_trials) = (300, 2)).await;
    while !service.trials(running).await.iter().any(|trial| trial.state.is_open()) {
        tokio::time::sleep(Duration::from_millis(2)).await;
    }

    let of_subject = format!("/api/v1/subjects/{person}");
    let given = service.post(&format!("{of_subject}/consents"), &json!({"form": "version 3"})).await;
    assert_eq!(given.status, StatusCode::CREATED, "{}", given.text);
    let empty = service.post(&format!("{of_subject}/withdraw"), &json!({"reason": " "})).await;
    assert_eq!(empty.status, StatusCode::UNPROCESSABLE_ENTITY);
    let converged = service.trials(finished).await;
    let gaits = json!({"trial_a": converged[0].id, "trial_b": converged[1].id});
    let session = service.post(&format!("/api/v1/studies/{finished}/lab-sessions"), &gaits).await.json();
    let session = session["id"].as_str().unwrap().to_owned();
    service.post(&format!("/api/v1/lab-sessions/{session}/walks"), &json!({"walk": 1})).await;
    let measured = json!({"walk": 1, "recording": joint_angles()});
    let recording =
        service.post(&format!("/api/v1/lab-sessions/{session}/measurement-files/joint-angles"), &measured).await;
    assert_eq!(recording.status, StatusCode::CREATED, "{}", recording.text);
    let assessment = json!({"trial_a": converged[0].id, "trial_b": converged[1].id, "answer": "cannot_tell"});
    let assessment = service.post(&format!("/api/v1/studies/{finished}/assessments"), &assessment).await.json();
    let assessment = assessment["id"].as_str().unwrap().to_owned();
    let best = converged.iter().filter_map(|trial| trial.gait_rmse_rad).fold(f64::INFINITY, f64::min);
    for path in ["/".to_owned(), format!("/studies/{finished}")] {
        let page = service.fetch(&path).await.text;
        assert!(page.contains(&format!("{best:.4}")), "{path} shows the best figure until then: {page}");
    }
    let before = audit::page(&mut service.store.read().await.unwrap(), "", None, 1000).await.unwrap().len();
    let withdraw = json!({"reason": "moved away"});
    let withdrawn = service.post(&format!("{of_subject}/withdraw"), &withdraw).await;
    assert_eq!(withdrawn.status, StatusCode::OK, "{}", withdrawn.text);
    let trail = audit::page(&mut service.store.read().await.unwrap(), "", None, 1000).await.unwrap();
    assert_eq!((trail.len(), trail[0].change.as_str()), (before + 1, "subject.withdraw"));
    assert_eq!(trail[0].detail["stopped"].as_array().unwrap().len(), 4);
    assert_eq!(service.post(&format!("{of_subject}/withdraw"), &withdraw).await.status, StatusCode::CONFLICT);
    for study in [draft, human, script, running] {
        assert_eq!(service.get(study).await.state, StudyState::Stopped);
        assert!(service.trials(study).await.iter().all(|trial| !trial.state.is_open()));
    }

    // Every entry point for new data.
    let trials = service.trials(finished).await;
    let (feedback, tried) = (service.feedback(finished).await, service.trials(running).await.len());
    let answer = json!({"trial_a": trials[0].id, "trial_b": trials[1].id, "answer": "a"});
    let other =
        if service.get(finished).await.plan.search_space.values(trials[0].action_index)[5] == 0.3 { 0.2 } else { 0.3 };
    let suggestion = json!({"over": trials[0].id, "bounds": {"a6": other}});
    let ended = |trial: &gaitwright_store::trials::Trial| trial.state.as_str() == "cancelled";
    let cancelled = service.trials(running).await.into_iter().find(ended).unwrap().id;
    for (path, body) in [
        ("/api/v1/studies".to_owned(), json!({"subject_id": person})),
        (format!("/api/v1/studies/{finished}/clone"), json!({})),
        (format!("/api/v1/studies/{running}/extend"), json!({"number_of_trials": 310})),
        (format!("/api/v1/studies/{finished}/preferences"), answer),
        (format!("/api/v1/studies/{finished}/suggestions"), suggestion),
        (format!("/api/v1/studies/{script}/ask"), json!({})),
        (format!("/api/v1/studies/{human}/blind-pairs/next"), json!({})),
        (format!("/api/v1/blind-pairs/{code}/answer"), json!({"answer": "first"})),
        (format!("/api/v1/trials/{cancelled}/retry"), json!({})),
        (format!("/api/v1/studies/{finished}/lab-sessions"), gaits),
        (format!("/api/v1/lab-sessions/{session}/walks"), json!({"walk": 2})),
        (format!("/api/v1/lab-sessions/{session}/answers"), json!({"number": 1, "answer": "first"})),
        (format!("/api/v1/lab-sessions/{session}/retract-answer"), json!({})),
        (
            format!("/api/v1/studies/{finished}/assessments"),
            json!({"trial_a": trials[0].id, "trial_b": trials[1].id, "answer": "cannot_tell"}),
        ),
        (format!("/api/v1/assessments/{assessment}/retract"), json!({"reason": "r"})),
        (format!("/api/v1/assessments/{assessment}/undo"), json!({})),
        (format!("/api/v1/lab-sessions/{session}/close"), json!({})),
        (format!("/api/v1/lab-sessions/{session}/emg-results"), json!({})),
        (format!("/api/v1/lab-sessions/{session}/unblind"), json!({"reason": "r"})),
        (
            format!("/api/v1/trials/{}/tell", asked["id"].as_str().unwrap()),
            json!({"label": "converged", "gait_rmse_rad": 0.2}),
        ),
    ] {
        let refused = service.post(&path, &body).await;
        assert_eq!(refused.status, StatusCode::CONFLICT, "{path}: {}", refused.text);
    }
    let refused = service.put(&format!("{of_subject}/muscles"), &json!({})).await;
    assert_eq!(refused.status, StatusCode::CONFLICT, "{}", refused.text);
    let form = format!("a={}&b={}&answer=b&source=subject&author=K&key={}", trials[0].id, trials[1].id, trials[0].id);
    let kind = "application/x-www-form-urlencoded";
    let refused = service.post_text(&format!("/studies/{finished}/compare"), kind, &form).await;
    assert_eq!(refused.status, StatusCode::CONFLICT, "{}", refused.text);
    tokio::time::sleep(Duration::from_millis(300)).await;
    assert_eq!(service.feedback(finished).await, feedback);
    assert_eq!(service.trials(running).await.len(), tried);

    // No request shows or exports data; the record is kept.
    let preference = service.feedback(finished).await[0].id;
    let named = [
        ("/studies/{id}", finished.to_string()),
        ("/subjects/{id}", person.to_string()),
        ("/trials/{id}", trials[0].id.to_string()),
        ("/jobs/{id}", format!("solve-{}", trials[0].id)),
        ("/preferences/{id}", preference.to_string()),
        ("/suggestions/{id}", preference.to_string()),
        ("/assessments/{id}", assessment.clone()),
        ("/blind-pairs/{code}", code.clone()),
        ("/lab-sessions/{id}", session.clone()),
        ("/measurement-files/{id}", recording.json()["id"].as_str().unwrap().to_owned()),
        ("/study-comparison", format!("study-comparison?ids={finished},{running}")),
    ];
    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let mut closed = 0;
    for (path, item) in document["paths"].as_object().unwrap().iter().filter(|(_, item)| item["get"].is_object()) {
        if OF_NO_SUBJECT.contains(&path.as_str()) {
            let shown = service.fetch(path).await;
            assert!(path.contains('{') || shown.status == StatusCode::OK, "{path}: {}", shown.text);
            assert!(!shown.text.contains(&best.to_string()), "{path}: {}", shown.text);
            continue;
        }
        let object = named.iter().find(|(of, _)| path.starts_with(&format!("/api/v1{of}")));
        let (of, id) =
            object.unwrap_or_else(|| panic!("{path}: add its object to `named`, or add it to OF_NO_SUBJECT"));
        let name = of.rsplit('/').next().unwrap();
        let answer = service.fetch(&path.replace(name, id).replace("{file}", "a.svg").replace("{side}", "first")).await;
        // None of these responses has results or answers of the subject.
        let open = [
            "/api/v1/studies/{id}",
            "/api/v1/studies/{id}/access",
            "/api/v1/studies/{id}/members",
            "/api/v1/subjects/{id}",
            "/api/v1/subjects/{id}/consents",
            "/api/v1/subjects/{id}/reference-gaits",
        ];
        let open = open.contains(&path.as_str());
        let expected = if open { StatusCode::OK } else { StatusCode::CONFLICT };
        assert_eq!(answer.status, expected, "{path}: {}", answer.text);
        assert_eq!(item["get"]["responses"]["409"].is_object(), !open, "{path}");
        closed += usize::from(!open);
    }
    assert!(closed > 15, "{closed}");
    for (path, body) in [
        (format!("/api/v1/trials/{}/certificate", trials[0].id), json!({})),
        (format!("/api/v1/trials/{}/explanation", trials[0].id), json!({})),
        (format!("/api/v1/trials/{}/execution-report", trials[0].id), json!({})),
        (format!("/api/v1/studies/{human}/raters/unblind"), json!({"rater": "an anonymous visitor", "reason": "r"})),
        (format!("/api/v1/preferences/{preference}/retract"), json!({"reason": "r"})),
        (format!("/api/v1/preferences/{preference}/undo"), json!({})),
        (format!("/api/v1/suggestions/{preference}/retract"), json!({"reason": "r"})),
    ] {
        let refused = service.post(&path, &body).await;
        assert_eq!(refused.status, StatusCode::CONFLICT, "{path}: {}", refused.text);
    }
    for path in [
        format!("/studies/{finished}/live"),
        format!("/studies/{finished}/compare"),
        format!("/trials/{}", trials[0].id),
        format!("/rate/pair/{code}"),
        format!("/studies/{finished}/lab"),
        format!("/studies/{finished}/figures"),
        format!("/lab-sessions/{session}"),
        format!("/lab/{session}"),
        format!("/subjects/{person}/muscles"),
    ] {
        let refused = service.fetch(&path).await;
        assert_eq!(refused.status, StatusCode::CONFLICT, "{path}");
        assert!(refused.content_type().starts_with("text/html") && refused.text.contains("withdrew"), "{path}");
        assert!(refused.text.contains("<h1>Consent withdrawn</h1>"), "{path}: {}", refused.text);
    }
    for path in ["/".to_owned(), format!("/studies/{finished}")] {
        let page = service.fetch(&path).await;
        assert_eq!(page.status, StatusCode::OK);
        let says = page.text.contains("consent withdrawn") || page.text.contains("withdrew");
        assert!(says && !page.text.contains(&format!("{best:.4}")), "{}", page.text);
    }
    let said = service.fetch(&format!("{of_subject}/consents")).await.items();
    let kinds: Vec<_> = said.as_array().unwrap().iter().map(|row| row["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["given", "withdrawn"]);

    // A subject who rejoins gives a new consent.
    service.post(&format!("{of_subject}/consents"), &json!({"form": "version 4"})).await;
    let again = service.post("/api/v1/studies", &json!({"subject_id": person, "start": false})).await;
    assert_eq!(again.status, StatusCode::CREATED, "{}", again.text);
    service.stop().await;
}

#[tokio::test]
async fn subject_page_records_and_withdraws_consent() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::slow(Duration::from_millis(20)), 1).await;
    let running = service.study(|new| new.number_of_trials = 50).await;
    let page = format!("/subjects/{}", service.subject().await);
    let list = service.fetch("/subjects").await;
    assert!(list.text.contains(&page) && list.text.contains("not on record"), "{}", list.text);
    assert!(service.fetch(&page).await.text.contains("No consent on record"));
    let send = async |act: &str, body: &str| {
        service.post_text(&format!("{page}/{act}"), "application/x-www-form-urlencoded", body).await
    };

    assert_eq!(send("consent", "form=&after=0").await.status, StatusCode::UNPROCESSABLE_ENTITY);
    assert_eq!(send("consent", "form=version+3&after=0").await.status, StatusCode::SEE_OTHER);
    let twice = send("consent", "form=version+3&after=0").await;
    assert_eq!(twice.status, StatusCode::CONFLICT);
    assert!(twice.text.contains("after this form was loaded") && twice.text.matches("version 3</td>").count() == 1);

    // Without the tick that confirms it, nothing changes.
    let unconfirmed = send("withdraw", "reason=moved+away").await;
    assert!(
        unconfirmed.status == StatusCode::CONFLICT && unconfirmed.text.contains("moved away"),
        "{}",
        unconfirmed.text
    );
    assert_ne!(service.get(running).await.state, StudyState::Stopped);
    assert_eq!(send("withdraw", "reason=+&confirmed=yes").await.status, StatusCode::UNPROCESSABLE_ENTITY);
    assert_eq!(send("withdraw", "reason=moved+away&confirmed=yes").await.status, StatusCode::SEE_OTHER);
    assert_eq!(service.get(running).await.state, StudyState::Stopped);
    let shown = service.fetch(&page).await.text;
    assert!(shown.contains("This subject withdrew") && shown.contains("moved away"), "{shown}");
    assert!(!shown.contains("/withdraw\""), "it cannot be done twice");
    assert_eq!(send("withdraw", "reason=again&confirmed=yes").await.status, StatusCode::CONFLICT);
    let trail = audit::page(&mut service.store.read().await.unwrap(), "", None, 10).await.unwrap();
    let acts: Vec<_> = trail.iter().map(|row| row.change.as_str()).take(2).collect();
    assert_eq!(acts, ["subject.withdraw", "subject.consent"]);
    service.stop().await;
}

#[tokio::test]
async fn studies_of_a_withdrawn_subject_cannot_be_exported_or_imported() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Consistent::default(), 1).await;
    let person = service.subject().await;
    let mut archives = Vec::new();
    let mut last = None;
    for seed in [1, 2] {
        let study = service.study(|new| (new.seed, new.number_of_trials) = (seed, 2)).await;
        service.wait_for(study, &[StudyState::Finished]).await;
        archives.push(exported(&service.store, study).await);
        last = Some(study);
    }
    let withdraw = json!({"reason": "moved away"});
    let path = format!("/api/v1/subjects/{person}/withdraw");
    assert_eq!(service.post(&path, &withdraw).await.status, StatusCode::OK);
    service.stop().await;
    let study = last.unwrap().to_string();
    let export = ["export", &study, "study.gait", "--database", "a.db"];
    let output = cli::run(env!("CARGO_BIN_EXE_gaitwright-cli"), folder.path(), &export);
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(2) && text.contains("withdrew consent"), "{text}");
    assert!(!folder.path().join("study.gait").exists());

    // In another record, in which the subject withdraws after the import of a first study.
    let other = gaitwright_store::Store::open(&folder.path().join("b.db")).await.unwrap();
    import(&other, &archives[0]).await.unwrap();
    other.close().await;
    drop(other);
    let other = Service::start_as_is(&folder.path().join("b.db"), Consistent::default(), 1).await;
    assert_eq!(other.post(&path, &withdraw).await.status, StatusCode::OK);
    let refused = import(&other.store, &archives[1]).await.unwrap_err().to_string();
    assert!(refused.contains("withdrew consent") && refused.contains("nothing was changed"), "{refused}");
    other.stop().await;
}

#[tokio::test]
async fn saved_responses_of_repeated_requests_are_withheld_after_withdrawal() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let finished = service.study(|new| new.number_of_trials = 3).await;
    service.wait_for(finished, &[StudyState::Finished]).await;
    let script = service.study(|new| (new.number_of_trials, new.evaluation) = (3, Evaluation::Script)).await;
    let asked = service.post(&format!("/api/v1/studies/{script}/ask"), &json!({})).await.json();
    let trials = service.trials(finished).await;
    let told = (
        format!("/api/v1/trials/{}/tell", asked["id"].as_str().unwrap()),
        json!({"label": "converged", "gait_rmse_rad": 0.3125}),
    );
    let preferred = (
        format!("/api/v1/studies/{finished}/preferences"),
        json!({"trial_a": trials[0].id, "trial_b": trials[1].id, "answer": "a"}),
    );
    let send = async |(path, body): &(String, Value)| {
        let request = Request::post(path).header("content-type", "application/json").header("idempotency-key", path);
        service.send(request.body(Body::from(body.to_string())).unwrap()).await
    };
    for request in [&told, &preferred] {
        let (first, again) = (send(request).await, send(request).await);
        assert!(first.status.is_success() && again.text == first.text, "{}", first.text);
    }
    let withdraw = format!("/api/v1/subjects/{}/withdraw", service.subject().await);
    assert_eq!(service.post(&withdraw, &json!({"reason": "moved away"})).await.status, StatusCode::OK);
    for request in [&told, &preferred] {
        let again = send(request).await;
        assert_eq!(again.status, StatusCode::CONFLICT, "{}", again.text);
        assert!(again.text.contains("withdrew consent") && !again.text.contains("0.3125"), "{}", again.text);
    }
    service.stop().await;
}
