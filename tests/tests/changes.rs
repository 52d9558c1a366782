//! Every operation that changes something leaves exactly one row in the audit trail, and the form, REST and the
//! unattended loop leave the same rows in the record. The table is compared with the description: an operation that is
//! not listed here fails the test.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::body::Body;
use axum::http::{Request, header};
use gaitwright_http::openapi;
use gaitwright_service::access::Role;
use gaitwright_service::studies::bound_grid;
use gaitwright_service::studies::identical_gaits::is_same_gait;
use gaitwright_store::audit::{self, ChainCheck};
use gaitwright_store::feedback::{FeedbackContent, FeedbackRow};
use gaitwright_store::studies::{AnswerSource, Evaluation, StudyState};
use gaitwright_store::trials::Trial;
use gaitwright_store::{StudyId, TrialId, feedback};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::callers::signed_in;
use gaitwright_tests::described::audit_trail;
use gaitwright_tests::explained::without_gaits;
use gaitwright_tests::measured::{electromyogram, joint_angles};
use gaitwright_tests::service::Service;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::time::Duration;

/// Details of rows that the requests below do not write, but other requests, sign-ins, imports, jobs and the command line.
const ELSEWHERE: [&str; 21] = [
    "again",
    "failed_attempts",
    "failed_attempts_of_network",
    "failures",
    "file_sha256",
    "first_at",
    "kept",
    "last_at",
    "names",
    "network",
    "number_of_trials",
    "passed",
    "relaxed_bound",
    "scheduled",
    "signed_by",
    "number_of_simulated_walks",
    "to_device",
    "trajectories",
    "trusted",
    "unchecked_rmse",
    "without_gait",
];

async fn rows(service: &Service) -> usize {
    audit::page(&mut service.store.read().await.unwrap(), "", None, 10_000).await.unwrap().len()
}

/// Everything that the requests below need.
struct Scene {
    service: Service,
    finished: StudyId,
    draft: StudyId,
    script: StudyId,
    human: StudyId,
}

impl Scene {
    async fn set(folder: &std::path::Path) -> Self {
        let service = Service::start(&folder.join("a.db"), Analytic::slow(Duration::from_millis(10)), 1).await;
        let finished = service.study(|new| new.number_of_trials = 3).await;
        service.wait_for(finished, &[StudyState::Finished]).await;
        let draft = service.study(|new| (new.number_of_trials, new.start) = (2, false)).await;
        let script = service.study(|new| (new.evaluation, new.number_of_trials) = (Evaluation::Script, 9)).await;
        let human = service.study(|new| (new.answer_source, new.number_of_trials) = (AnswerSource::People, 4)).await;
        service.wait_for(human, &[StudyState::Waiting]).await;
        Self { service, finished, draft, script, human }
    }

    /// Sends a request, and requires success and exactly one row.
    async fn one(&self, done: &mut BTreeSet<String>, operation: &str, path: &str, body: Value) -> Value {
        let (method, _) = operation.split_once(' ').unwrap();
        let before = rows(&self.service).await;
        let request = Request::builder()
            .method(method.to_uppercase().as_str())
            .uri(path)
            .header(header::CONTENT_TYPE, "application/json")
            .body(Body::from(body.to_string()))
            .unwrap();
        let answer = self.service.send(request).await;
        assert!(answer.status.is_success(), "{operation}: {} {}", answer.status, answer.text);
        assert_eq!(rows(&self.service).await, before + 1, "{operation}");
        done.insert(operation.replace("/api/v1", ""));
        answer.json()
    }
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap()
}

/// A level of a6 that is not that of the trial.
fn elsewhere(trial: &Trial) -> f64 {
    if bound_grid::table_i().unwrap().values(trial.action_index)[5] == 0.3 { 0.2 } else { 0.3 }
}

#[tokio::test]
async fn every_operation_writes_exactly_one_row_of_the_audit_trail() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Scene::set(folder.path()).await;
    let Scene { service, finished, draft, script, human } = &scene;
    let trials = service.trials(*finished).await;
    let done = &mut BTreeSet::new();
    let api = "/api/v1";

    let subject = json!({"pseudonym": "S1", "height_m": 1.8, "body_mass_kg": 70});
    let subject = scene.one(done, "post /subjects", &format!("{api}/subjects"), subject).await;
    let of_subject = format!("{api}/subjects/{}", text(&subject["id"]));
    let form = json!({"form": "version 3 of 2026-05-01"});
    scene.one(done, "post /subjects/{id}/consents", &format!("{of_subject}/consents"), form).await;
    let stronger = json!({"sol": {"max_force_n": 4200.0}});
    scene.one(done, "put /subjects/{id}/muscles", &format!("{of_subject}/muscles"), stronger).await;
    let taller = json!({"height_m": 1.81, "body_mass_kg": 70, "reason": "measured again"});
    scene.one(done, "post /subjects/{id}/corrections", &format!("{of_subject}/corrections"), taller).await;
    let why = json!({"reason": "no time"});
    scene.one(done, "post /subjects/{id}/withdraw", &format!("{of_subject}/withdraw"), why).await;
    let study = json!({"subject_id": service.subject().await, "start": false});
    scene.one(done, "post /studies", &format!("{api}/studies"), study).await;
    let of_draft = format!("{api}/studies/{draft}");
    scene.one(done, "patch /studies/{id}", &of_draft, json!({"priority": -10})).await;
    for (act, body) in [("clone", json!({})), ("start", json!({})), ("pause", json!({})), ("resume", json!({}))] {
        scene.one(done, &format!("post /studies/{{id}}/{act}"), &format!("{of_draft}/{act}"), body).await;
    }
    service.wait_for(*draft, &[StudyState::Finished]).await;
    let more = json!({"number_of_trials": 4000});
    scene.one(done, "post /studies/{id}/extend", &format!("{of_draft}/extend"), more).await;
    while !service.trials(*draft).await.iter().any(|trial| trial.state.is_open()) {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    let open = service.trials(*draft).await.into_iter().find(|trial| trial.state.is_open()).unwrap();
    scene.one(done, "post /jobs/{id}/cancel", &format!("{api}/jobs/solve-{}/cancel", open.id), json!({})).await;
    scene.one(done, "post /studies/{id}/stop", &format!("{of_draft}/stop"), json!({"reason": "enough"})).await;
    let cancelled = service.trials(*draft).await.into_iter().find(|trial| trial.state.as_str() == "cancelled").unwrap();

    let ask = format!("{api}/studies/{script}/ask");
    let asked = scene.one(done, "post /studies/{id}/ask", &ask, json!({})).await;
    let tell = json!({"label": "not_converged", "reason": "r"});
    scene.one(done, "post /trials/{id}/tell", &format!("{api}/trials/{}/tell", text(&asked["id"])), tell).await;
    let asked = scene.one(done, "post /studies/{id}/ask", &ask, json!({})).await;
    let cancel = format!("{api}/trials/{}/cancel", text(&asked["id"]));
    scene.one(done, "post /trials/{id}/cancel", &cancel, json!({})).await;
    let retry = format!("{api}/trials/{}/retry", cancelled.id);
    scene.one(done, "post /trials/{id}/retry", &retry, json!({})).await;

    let answer = json!({"trial_a": trials[0].id, "trial_b": trials[1].id, "answer": "a"});
    let give = format!("{api}/studies/{finished}/preferences");
    let given = scene.one(done, "post /studies/{id}/preferences", &give, answer).await;
    let mut other = json!({"trial_a": trials[0].id, "trial_b": trials[1].id, "answer": "b"});
    other["replaces"] = given["id"].clone();
    let changed = scene.one(done, "post /studies/{id}/preferences", &give, other).await;
    let undo = format!("{api}/preferences/{}/undo", text(&changed["id"]));
    let given = scene.one(done, "post /preferences/{id}/undo", &undo, json!({})).await["preference"].clone();
    let retract = format!("{api}/preferences/{}/retract", text(&given["id"]));
    scene.one(done, "post /preferences/{id}/retract", &retract, json!({"reason": "r"})).await;
    let unclear = json!({"trial_a": trials[0].id, "trial_b": trials[1].id, "answer": "cannot_tell"});
    let assess = format!("{api}/studies/{finished}/assessments");
    let made = scene.one(done, "post /studies/{id}/assessments", &assess, unclear.clone()).await;
    let undo = format!("{api}/assessments/{}/undo", text(&made["id"]));
    scene.one(done, "post /assessments/{id}/undo", &undo, json!({})).await;
    let made = scene.one(done, "post /studies/{id}/assessments", &assess, unclear).await;
    let retract = format!("{api}/assessments/{}/retract", text(&made["id"]));
    scene.one(done, "post /assessments/{id}/retract", &retract, json!({"reason": "r"})).await;
    let report = format!("{api}/trials/{}/safety-reports", trials[0].id);
    scene.one(done, "post /trials/{id}/safety-reports", &report, json!({"note": "stumbled"})).await;
    let again = json!({"trial_a": trials[0].id, "trial_b": trials[1].id, "answer": "unsafe_both"});
    service.post(&format!("{api}/studies/{finished}/assessments"), &again).await;
    for (trial, decision) in [(&trials[0], "cleared"), (&trials[1], "unsafe"), (&trials[1], "cleared")] {
        let review = format!("{api}/trials/{}/safety-reviews", trial.id);
        let decision = json!({"decision": decision, "reason": "looked at the video"});
        scene.one(done, "post /trials/{id}/safety-reviews", &review, decision).await;
    }

    let better = json!({"over": trials[0].id, "bounds": {"a6": elsewhere(&trials[0])}});
    let suggest = format!("{api}/studies/{finished}/suggestions");
    let suggested = scene.one(done, "post /studies/{id}/suggestions", &suggest, better).await;
    let retract = format!("{api}/suggestions/{}/retract", text(&suggested["id"]));
    scene.one(done, "post /suggestions/{id}/retract", &retract, json!({"reason": "r"})).await;
    // A job leaves one row for its request, and one when it is done.
    let before = rows(service).await;
    service.backed_up().await;
    assert_eq!(rows(service).await, before + 2);
    done.insert("post /backups".to_owned());

    let next = format!("{api}/studies/{human}/blind-pairs/next");
    let pair = scene.one(done, "post /studies/{id}/blind-pairs/next", &next, json!({})).await;
    let say = format!("{api}/blind-pairs/{}/answer", text(&pair["pair"]["code"]));
    scene.one(done, "post /blind-pairs/{code}/answer", &say, json!({"answer": "first"})).await;
    let unblind = json!({"rater": "an anonymous visitor", "reason": "r"});
    scene
        .one(done, "post /studies/{id}/raters/unblind", &format!("{api}/studies/{human}/raters/unblind"), unblind)
        .await;

    let user = json!({"name": "Ada", "role": "clinician"});
    let user = scene.one(done, "post /users", &format!("{api}/users"), user).await;
    for act in ["link", "disable", "enable"] {
        let path = format!("{api}/users/{}/{act}", text(&user["id"]));
        scene.one(done, &format!("post /users/{{id}}/{act}"), &path, json!({})).await;
    }
    let role = format!("{api}/users/{}/role", text(&user["id"]));
    scene.one(done, "put /users/{id}/role", &role, json!({"role": "rater"})).await;
    signed_in(service, Role::Clinician).await;
    let sessions = service.fetch(&format!("{api}/sessions")).await.items();
    let end = format!("{api}/sessions/{}/end", text(&sessions[0]["id"]));
    scene.one(done, "post /sessions/{id}/end", &end, json!({})).await;
    let of_finished = format!("{api}/studies/{finished}");
    let ada = json!({"kind": "user", "name": "Ada"});
    let member = scene.one(done, "post /studies/{id}/members", &format!("{of_finished}/members"), ada).await;
    let remove = format!("{api}/study-members/{}/remove", text(&member["id"]));
    scene.one(done, "post /study-members/{id}/remove", &remove, json!({})).await;
    let restricted = json!({"restricted": true});
    scene.one(done, "put /studies/{id}/access", &format!("{of_finished}/access"), restricted).await;
    // An invitation makes three changes, each with its own row.
    let invited = service.post(&format!("{of_finished}/invitations"), &json!({"name": "R7"})).await;
    assert!(invited.status.is_success(), "{}", invited.text);
    let newest = audit::page(&mut service.store.read().await.unwrap(), "", None, 3).await.unwrap();
    let acts: Vec<_> = newest.iter().map(|row| row.change.as_str()).collect();
    assert_eq!(acts, ["study.member_add", "user.link", "user.add"]);
    done.insert("post /studies/{id}/invitations".to_owned());
    let token =
        scene.one(done, "post /tokens", &format!("{api}/tokens"), json!({"name": "t", "scopes": ["read"]})).await;
    let revoke = format!("{api}/tokens/{}/revoke", text(&token["id"]));
    scene.one(done, "post /tokens/{id}/revoke", &revoke, json!({})).await;

    let mut device = service.fetch(&format!("{api}/devices")).await.items()[0]["definition"].clone();
    device["name"] = json!("a heavier one");
    scene.one(done, "post /devices", &format!("{api}/devices"), device).await;
    let row = |k: u32| {
        let (time, swing) = (f64::from(k) / 100.0, (std::f64::consts::TAU * f64::from(k) / 110.0).cos());
        let (left, right) = (0.4 + 0.35 * swing, 0.4 - 0.35 * swing);
        format!("{time},0.1,{},{left},{},{},{right}", 0.2 - 0.4 * swing, 0.05 + 0.1 * swing, 0.2 + 0.4 * swing)
    };
    let header = "time_s,torso_rad,hip_L_rad,knee_L_rad,ankle_L_rad,hip_R_rad,knee_R_rad".to_owned();
    let recording = std::iter::once(header).chain((0..440).map(row)).collect::<Vec<_>>().join("\n");
    let reference = json!({"name": "R", "format": "csv", "recording": recording, "height_m": 1.7, "body_mass_kg": 66});
    scene.one(done, "post /reference-gaits", &format!("{api}/reference-gaits"), reference).await;

    let plan = format!("{api}/studies/{finished}/lab-sessions");
    let pair = json!({"trial_a": trials[0].id, "trial_b": trials[1].id});
    let session = scene.one(done, "post /studies/{id}/lab-sessions", &plan, pair).await;
    let session = format!("{api}/lab-sessions/{}", text(&session["id"]));
    scene.one(done, "post /lab-sessions/{id}/walks", &format!("{session}/walks"), json!({"walk": 1})).await;
    for walk in 2..=3 {
        scene.service.post(&format!("{session}/walks"), &json!({"walk": walk})).await;
    }
    let said = json!({"number": 1, "answer": "first"});
    scene.one(done, "post /lab-sessions/{id}/answers", &format!("{session}/answers"), said).await;
    scene.one(done, "post /lab-sessions/{id}/retract-answer", &format!("{session}/retract-answer"), json!({})).await;
    let emg = json!({"walk": 1, "recording": electromyogram(1.0), "reading": {"heel_strike_column": "heel"}});
    scene
        .one(done, "post /lab-sessions/{id}/measurement-files/emg", &format!("{session}/measurement-files/emg"), emg)
        .await;
    scene.one(done, "post /lab-sessions/{id}/emg-results", &format!("{session}/emg-results"), json!({})).await;
    let angles = json!({"walk": 1, "recording": joint_angles()});
    scene
        .one(
            done,
            "post /lab-sessions/{id}/measurement-files/joint-angles",
            &format!("{session}/measurement-files/joint-angles"),
            angles,
        )
        .await;
    scene.one(done, "post /lab-sessions/{id}/unblind", &format!("{session}/unblind"), json!({"reason": "r"})).await;
    scene.one(done, "post /lab-sessions/{id}/close", &format!("{session}/close"), json!({})).await;

    let no_gait =
        service.study(|new| (new.number_of_trials, new.search_space) = (1, Some(without_gaits().into()))).await;
    service.wait_for(no_gait, &[StudyState::Finished]).await;
    let explain = format!("{api}/trials/{}/explanation", service.trials(no_gait).await[0].id);
    scene.one(done, "post /trials/{id}/explanation", &explain, json!({})).await;

    // Certifies and walks with a real gait only; tests/certificates.rs counts these rows.
    done.insert("post /trials/{id}/certificate".to_owned());
    done.insert("post /trials/{id}/execution-report".to_owned());

    let document: Value = serde_json::from_str(&openapi::text().unwrap()).unwrap();
    let mut described = BTreeSet::new();
    for (path, item) in document["paths"].as_object().unwrap() {
        for method in item.as_object().unwrap().keys().filter(|method| *method != "get") {
            described.insert(format!("{method} {}", path.trim_start_matches("/api/v1")));
        }
    }
    assert_eq!(*done, described);
    let mut details = audit_trail(service).await;
    details.extend(ELSEWHERE.map(str::to_owned));
    let described = document["components"]["schemas"]["AuditDetail"]["properties"].as_object().unwrap();
    let missing: Vec<&String> = described.keys().filter(|name| !details.contains(*name)).collect();
    assert!(missing.is_empty(), "no row of the audit trail has {missing:?}");
    let check = audit::verify(&mut service.store.read().await.unwrap()).await.unwrap();
    assert!(matches!(check, ChainCheck::Intact { .. }));
    scene.service.stop().await;
}

/// The feedback of a study, without identifiers, times and authors.
fn essence(trials: &[Trial], feedback_rows: &[FeedbackRow]) -> Vec<String> {
    let number = |id: TrialId| trials.iter().find(|trial| trial.id == id).unwrap().number;
    feedback_rows
        .iter()
        .map(|row| match row.content {
            FeedbackContent::Label { trial, label } => format!("label {} of {}", label.as_str(), number(trial)),
            FeedbackContent::Preference { winner, loser } => format!("{} over {}", number(winner), number(loser)),
            FeedbackContent::NoDifference { a, b } => format!("{} as good as {}", number(a), number(b)),
            FeedbackContent::Suggestion { suggested, over } => format!("{suggested:?} over {}", number(over)),
        })
        .collect()
}

#[tokio::test]
async fn form_rest_and_unattended_run_write_the_same_rows_for_the_same_answers() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let automatic = service.study(|new| new.number_of_trials = 12).await;
    service.wait_for(automatic, &[StudyState::Finished]).await;
    // People are not asked again about two gaits that were compared under other actions.
    let trials = service.trials(automatic).await;
    let trial = |id: TrialId| trials.iter().find(|trial| trial.id == id).unwrap();
    let same = |one: TrialId, other: TrialId| is_same_gait(trial(one), trial(other));
    let mut compared: Vec<(TrialId, TrialId)> = Vec::new();
    let mut feedback_rows = service.feedback(automatic).await;
    feedback_rows.retain(|row| {
        let FeedbackContent::Preference { winner, loser } = row.content else { return true };
        let again = compared.iter().any(|&(one, other)| same(one, winner) && same(other, loser));
        compared.push((winner, loser));
        !again
    });
    let expected = essence(&trials, &feedback_rows);
    for by_form in [false, true] {
        let study = service.study(|new| (new.number_of_trials, new.answer_source) = (12, AnswerSource::People)).await;
        while service.wait_for(study, &[StudyState::Waiting, StudyState::Finished]).await.state == StudyState::Waiting {
            let trials = service.trials(study).await;
            // Answers as Gait RMSE would: the question is the newest gait against the one the page offers.
            let page = service.fetch(&format!("/studies/{study}/compare")).await.text;
            let offered = |name: &str| {
                let list =
                    page.split(&format!("<select id=\"{name}\"")).nth(1).unwrap().split("</select>").next().unwrap();
                let option = list.split("<option ").find(|option| option.contains(" selected")).unwrap();
                option.split('"').nth(1).unwrap().to_owned()
            };
            let (a, b) = (offered("a"), offered("b"));
            let rmse = |id: &str| trials.iter().find(|t| t.id.to_string() == id).unwrap().gait_rmse_rad.unwrap();
            let answer = if rmse(&a) < rmse(&b) { "a" } else { "b" };
            let before = service.feedback(study).await.len();
            if by_form {
                let key = feedback_key(before);
                let form = format!("a={a}&b={b}&answer={answer}&source=clinician&author=K&key={key}");
                let path = format!("/studies/{study}/compare");
                let sent = service.post_text(&path, "application/x-www-form-urlencoded", &form).await;
                assert!(sent.status.is_redirection(), "{}", sent.text);
            } else {
                let body = json!({"trial_a": a, "trial_b": b, "answer": answer, "source": "clinician", "author": "K"});
                let sent = service.post(&format!("/api/v1/studies/{study}/preferences"), &body).await;
                assert!(sent.status.is_success(), "{}", sent.text);
            }
            assert_eq!(service.feedback(study).await.len(), before + 1);
            for _ in 0..500 {
                let state = service.get(study).await.state;
                if state != StudyState::Waiting {
                    break;
                }
                tokio::time::sleep(Duration::from_millis(2)).await;
            }
        }
        let feedback_rows = feedback::of_study(&mut service.store.read().await.unwrap(), study, 0).await.unwrap();
        assert_eq!(essence(&service.trials(study).await, &feedback_rows), expected, "by form: {by_form}");
    }
    service.stop().await;
}

fn feedback_key(count: usize) -> String {
    format!("01890000-0000-7000-8000-{:012}", count + 1)
}
