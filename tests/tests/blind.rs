//! Blind comparisons: the shown pairs, the recorded answers, and concealment of the allocation.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::{Method, StatusCode};
use gait_optimizer::{CancelToken, IterationRecord, SolveOutcome};
use gaitwright_service::access::{Right, Role};
use gaitwright_service::workers::{Assignment, Evaluate};
use gaitwright_store::blind_pairs::{self, BlindPair, BlindPairKind};
use gaitwright_store::members::MemberKind;
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_store::{StudyId, audit};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::callers::{self, As, member, rater_of, send, signed_in};
use gaitwright_tests::read_allocations::sides;
use gaitwright_tests::service::Service;
use serde_json::{Value, json};
use tempfile::TempDir;

async fn waiting(trials: u32) -> (TempDir, Service, StudyId) {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let study = service.study(|new| (new.answer_source, new.number_of_trials) = (AnswerSource::People, trials)).await;
    service.wait_for(study, &[StudyState::Waiting]).await;
    (folder, service, study)
}

async fn next(service: &Service, study: StudyId) -> Value {
    let answer = service.post(&format!("/api/v1/studies/{study}/blind-pairs/next"), &json!({})).await;
    assert!(answer.status.is_success(), "{}", answer.text);
    answer.json()["pair"].clone()
}

async fn say(service: &Service, pair: &Value, answer: &str) -> StatusCode {
    let path = format!("/api/v1/blind-pairs/{}/answer", pair["code"].as_str().unwrap());
    service.post(&path, &json!({"answer": answer, "response_ms": 900})).await.status
}

async fn shown(service: &Service, study: StudyId) -> Vec<BlindPair> {
    blind_pairs::of_study(&mut service.store.read().await.unwrap(), study).await.unwrap()
}

#[tokio::test]
async fn responses_to_raters_reveal_no_gait() {
    let (_folder, service, study) = waiting(4).await;
    let pair = next(&service, study).await;
    let code = pair["code"].as_str().unwrap();
    let mut bytes = pair.to_string();
    for path in [
        "/rate".to_owned(),
        format!("/rate/pair/{code}"),
        format!("/api/v1/blind-pairs/{code}/motions/first"),
        format!("/api/v1/blind-pairs/{code}/motions/second"),
    ] {
        let answer = service.fetch(&path).await;
        assert_eq!(answer.status, StatusCode::OK, "{path}: {}", answer.text);
        if path.contains("/motions/") {
            // The motion has only positions.
            let found =
                answer.text.strip_prefix("{\"stick_figures\":").and_then(|rest| rest.strip_suffix('}')).unwrap();
            assert!(found.chars().all(|c| "[]-.,0123456789".contains(c)), "{found}");
            continue;
        }
        bytes.push_str(&answer.text);
        for (name, value) in &answer.headers {
            bytes.push_str(name.as_str());
            bytes.push_str(value.to_str().unwrap());
        }
    }
    let taken = service.post_text(&format!("/rate/{study}"), "application/x-www-form-urlencoded", "").await;
    assert_eq!(taken.headers["location"], format!("/rate/pair/{code}"), "the same pair until it is answered");
    for trial in service.trials(study).await {
        for secret in [
            trial.id.to_string(),
            trial.id.short(),
            serde_json::to_string(&trial.action).unwrap(),
            trial.gait_rmse_rad.map_or("no figure".to_owned(), |rmse| format!("{rmse:.4}")),
            trial.gait_rmse_rad.map_or("no figure".to_owned(), |rmse| rmse.to_string()),
            trial.cost_of_transport.map_or("no figure".to_owned(), |cost| format!("{cost:.4}")),
        ] {
            assert!(!bytes.contains(&secret), "{secret}");
        }
    }
    let words = bytes.to_lowercase();
    for word in ["trial", "rmse", "bound", "converged", "\"a1\"", "0.026", "stride_", ".csv", ".json", "seed"] {
        assert!(!words.contains(word), "{word}");
    }
    // Both motions have the same length, number of stick found and start position.
    let motion = |side: &str| {
        let path = format!("/api/v1/blind-pairs/{code}/motions/{side}");
        let service = &service;
        async move { service.fetch(&path).await.json()["stick_figures"].take() }
    };
    let (first, second) = (motion("first").await, motion("second").await);
    assert_eq!(first.as_array().unwrap().len(), 101);
    assert_eq!(second.as_array().unwrap().len(), 101);
    assert_eq!((first[0][0][0].as_f64(), second[0][0][0].as_f64()), (Some(0.0), Some(0.0)));
    service.stop().await;
}

/// Takes and answers pairs of a study until it has ended.
async fn rate_to_the_end(service: &Service, who: &As, study: StudyId, answer: &str) {
    for _ in 0..4000 {
        let present = service.wait_for(study, &[StudyState::Waiting, StudyState::Finished]).await;
        if present.state == StudyState::Finished {
            return;
        }
        let next = format!("/api/v1/studies/{study}/blind-pairs/next");
        let pair = send(service, who, &Method::POST, &next, "application/json", "{}").await.json()["pair"].clone();
        if pair.is_null() {
            // The study is still processing the last answer.
            tokio::time::sleep(std::time::Duration::from_millis(5)).await;
            continue;
        }
        let path = format!("/api/v1/blind-pairs/{}/answer", pair["code"].as_str().unwrap());
        let body = json!({"answer": answer}).to_string();
        let said = send(service, who, &Method::POST, &path, "application/json", &body).await;
        assert_eq!(said.status, StatusCode::OK, "{}", said.text);
        let again = send(service, who, &Method::POST, &path, "application/json", &body).await;
        assert_eq!(again.status, StatusCode::CONFLICT, "one answer per pair");
    }
    panic!("the study does not end");
}

#[tokio::test]
async fn every_rater_answer_reaches_the_learner_including_repeats() {
    let (_folder, service) = callers::service().await;
    let (rater, admin) = (rater_of(&service, &[]).await, signed_in(&service, Role::Administrator).await);
    // One pair in ten is a repeat, by chance: one study in sixty has none.
    let mut with_repeats = None;
    for _ in 0..8 {
        let study = service.study(|new| (new.answer_source, new.number_of_trials) = (AnswerSource::People, 40)).await;
        member(&service, study, MemberKind::User, "a rater").await;
        rate_to_the_end(&service, &rater, study, "first").await;
        let shown = shown(&service, study).await;
        if shown.iter().any(|pair| pair.kind == BlindPairKind::Repeat) {
            with_repeats = Some((study, shown));
            break;
        }
    }
    let (study, shown) = with_repeats.expect("a repeated pair in eight studies");
    let feedback = service.feedback(study).await;
    let of_raters: Vec<_> = feedback.iter().filter(|row| row.by_rater).collect();
    assert_eq!(of_raters.len(), shown.len());
    assert!(of_raters.iter().all(|row| !row.could_have_known), "a rater who may not read answers blindly");
    let repeats = shown.iter().filter(|p| p.kind == BlindPairKind::Repeat).count();
    assert!(repeats > 0, "{repeats} repeats of {}", shown.len());

    let found = format!("/api/v1/studies/{study}/raters");
    let before = send(&service, &admin, &Method::GET, &found, "", "").await.items();
    assert_eq!(before[0]["first_preferred"], Value::Null, "before unblinding it would tell the order of pairs");
    assert_eq!(before[0]["repeats_agree"]["of"], json!(repeats));
    let unblind = json!({"rater": "a rater", "reason": "the study has ended"}).to_string();
    let path = format!("/api/v1/studies/{study}/raters/unblind");
    let told = send(&service, &admin, &Method::POST, &path, "application/json", &unblind).await;
    assert_eq!(told.status, StatusCode::OK, "{}", told.text);
    let after = send(&service, &admin, &Method::GET, &found, "", "").await.items();
    assert_eq!(after[0]["first_preferred"]["share"], 1.0, "this rater always says first");
    let of_rater = format!("/api/v1/studies/{study}/unblinded-pairs?rater=a%20rater");
    let pairs = send(&service, &admin, &Method::GET, &of_rater, "", "").await.items();
    assert_eq!(pairs.as_array().unwrap().len(), shown.len());
    for (pair, (first, second)) in pairs.as_array().unwrap().iter().zip(sides(&service.store, study).await) {
        assert_eq!((&pair["shown_first"], &pair["shown_second"]), (&json!(first), &json!(second)));
        assert_eq!(pair["answer"], "first");
    }
    service.stop().await;
}

#[tokio::test]
async fn rater_answer_counts_for_the_gait_shown_on_its_side() {
    let (_folder, service) = callers::service().await;
    let rater = signed_in(&service, Role::Rater).await;
    let mut swapped = std::collections::BTreeSet::new();
    for answer in ["first", "second"] {
        let study = service.study(|new| (new.answer_source, new.number_of_trials) = (AnswerSource::People, 20)).await;
        member(&service, study, MemberKind::User, "a rater").await;
        rate_to_the_end(&service, &rater, study, answer).await;
        let feedback = service.feedback(study).await;
        let of_raters = feedback.iter().filter(|row| row.by_rater).map(|row| row.content);
        for (said, (first, second)) in of_raters.zip(sides(&service.store, study).await) {
            let (winner, loser) = if answer == "first" { (first, second) } else { (second, first) };
            assert_eq!(said, gaitwright_store::feedback::FeedbackContent::Preference { winner, loser });
            swapped.insert(winner > loser);
        }
    }
    assert_eq!(swapped.len(), 2, "both orders were drawn");
    service.stop().await;
}

/// An analytic solver whose hip is higher the worse the gait: a motion in millimetres identifies its trial.
struct Tall(Analytic);

/// Height of the hip in the gait of such a trial, m.
fn hip_m(rmse: f64) -> f64 {
    0.9 + 0.2 * rmse
}

impl Evaluate for Tall {
    fn evaluate(
        &self,
        assignment: &Assignment,
        observer: &mut dyn FnMut(&IterationRecord),
        cancel: &CancelToken,
    ) -> Result<SolveOutcome, String> {
        let mut outcome = self.0.evaluate(assignment, observer, cancel)?;
        let height = hip_m(outcome.report.gait_rmse_rad);
        for q in outcome.gait.domains.iter_mut().flat_map(|domain| &mut domain.q) {
            q[1] = height;
        }
        Ok(outcome)
    }
}

#[tokio::test]
async fn each_side_shows_the_gait_drawn_for_it() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Tall(Analytic::default()), 1).await;
    let study = service.study(|new| (new.answer_source, new.number_of_trials) = (AnswerSource::People, 24)).await;
    let mut orders = std::collections::BTreeSet::new();
    for _ in 0..4000 {
        let present = service.wait_for(study, &[StudyState::Waiting, StudyState::Finished]).await;
        if present.state == StudyState::Finished {
            break;
        }
        let pair = next(&service, study).await;
        let Some(code) = pair["code"].as_str() else {
            tokio::time::sleep(std::time::Duration::from_millis(5)).await;
            continue;
        };
        let trials = service.trials(study).await;
        let of = |id| hip_m(trials.iter().find(|trial| trial.id == id).unwrap().gait_rmse_rad.unwrap());
        let (first, second) = *sides(&service.store, study).await.last().unwrap();
        for (side, trial) in [("first", first), ("second", second)] {
            let motion = service.fetch(&format!("/api/v1/blind-pairs/{code}/motions/{side}")).await.json();
            let hip = motion["stick_figures"][0][0][1].as_f64().unwrap();
            assert!((hip - of(trial)).abs() < 6e-4, "{side}: {hip} m, drawn: {} m", of(trial));
        }
        if (of(first) - of(second)).abs() > 2e-3 {
            orders.insert(of(first) > of(second));
        }
        assert_eq!(say(&service, &pair, "first").await, StatusCode::OK);
    }
    assert_eq!(orders.len(), 2, "both orders were drawn of gaits that can be told apart");
    service.stop().await;
}

#[tokio::test]
async fn answers_of_people_who_could_know_the_gaits_are_recorded_as_not_blind() {
    let (_folder, service) = callers::service().await;
    let study = service.study(|new| (new.answer_source, new.number_of_trials) = (AnswerSource::People, 40)).await;
    service.wait_for(study, &[StudyState::Waiting]).await;
    let clinician = signed_in(&service, Role::Clinician).await;
    let script = callers::token(&service, &[Right::Read, Right::Rate]).await;
    let program = callers::token(&service, &[Right::Rate]).await;
    member(&service, study, MemberKind::Token, "[Rate]").await;
    let rater = rater_of(&service, &[study]).await;
    let next = format!("/api/v1/studies/{study}/blind-pairs/next");
    for (who, unblinded) in [(&clinician, true), (&script, true), (&program, true), (&rater, false)] {
        service.wait_for(study, &[StudyState::Waiting]).await;
        let mut pair = Value::Null;
        while pair.is_null() {
            pair = send(&service, who, &Method::POST, &next, "application/json", "{}").await.json()["pair"].clone();
        }
        let code = pair["code"].as_str().unwrap();
        let page = send(&service, who, &Method::GET, &format!("/rate/pair/{code}"), "", "").await.text;
        assert_eq!(page.contains("recorded as not blind"), unblinded, "{page}");
        let path = format!("/api/v1/blind-pairs/{code}/answer");
        let said = send(&service, who, &Method::POST, &path, "application/json", "{\"answer\": \"second\"}").await;
        assert_eq!(said.status, StatusCode::OK, "{}", said.text);
        let newest = service.feedback(study).await.into_iter().rfind(|row| row.by_rater).unwrap();
        assert_eq!(newest.could_have_known, unblinded, "{who:?}");
    }
    let found = send(&service, &clinician, &Method::GET, &format!("/api/v1/studies/{study}/raters"), "", "").await;
    let marked: Vec<_> =
        found.items().as_array().unwrap().iter().map(|rater| rater["could_have_known"].clone()).collect();
    assert_eq!(marked, [json!(1), json!(1), json!(1), json!(0)], "by name: {}", found.text);
    service.stop().await;
}

#[tokio::test]
async fn answers_of_a_former_clinician_are_recorded_as_not_blind() {
    let (_folder, service) = callers::service().await;
    let study = service.study(|new| (new.answer_source, new.number_of_trials) = (AnswerSource::People, 6)).await;
    service.wait_for(study, &[StudyState::Waiting]).await;
    let (rater, admin) = (rater_of(&service, &[study]).await, signed_in(&service, Role::Administrator).await);
    let users = send(&service, &admin, &Method::GET, "/api/v1/users", "", "").await.items();
    let id = users.as_array().unwrap().iter().find(|user| user["name"] == "a rater").unwrap()["id"].clone();
    for role in ["clinician", "rater"] {
        let path = format!("/api/v1/users/{}/role", id.as_str().unwrap());
        let body = json!({"role": role}).to_string();
        let given = send(&service, &admin, &Method::PUT, &path, "application/json", &body).await;
        assert_eq!(given.status, StatusCode::OK, "{}", given.text);
    }
    let next = format!("/api/v1/studies/{study}/blind-pairs/next");
    let pair = send(&service, &rater, &Method::POST, &next, "application/json", "{}").await.json()["pair"].clone();
    for page in ["/rate".to_owned(), format!("/rate/pair/{}", pair["code"].as_str().unwrap())] {
        let page = send(&service, &rater, &Method::GET, &page, "", "").await;
        assert!(page.text.contains("recorded as not blind"), "{}", page.text);
    }
    let path = format!("/api/v1/blind-pairs/{}/answer", pair["code"].as_str().unwrap());
    send(&service, &rater, &Method::POST, &path, "application/json", "{\"answer\": \"first\"}").await;
    assert!(service.feedback(study).await.iter().any(|row| row.by_rater && row.could_have_known));
    service.stop().await;
}

#[tokio::test]
async fn answer_of_a_rater_unblinded_since_the_draw_is_recorded_as_not_blind() {
    let (_folder, service) = callers::service().await;
    let study = service.study(|new| (new.answer_source, new.number_of_trials) = (AnswerSource::People, 6)).await;
    service.wait_for(study, &[StudyState::Waiting]).await;
    let (rater, admin) = (rater_of(&service, &[study]).await, signed_in(&service, Role::Administrator).await);
    let json_of = "application/json";
    let next = format!("/api/v1/studies/{study}/blind-pairs/next");
    let pair = send(&service, &rater, &Method::POST, &next, json_of, "{}").await.json()["pair"].clone();
    let unblind = json!({"rater": "a rater", "reason": "adverse event"}).to_string();
    send(&service, &admin, &Method::POST, &format!("/api/v1/studies/{study}/raters/unblind"), json_of, &unblind).await;
    let path = format!("/api/v1/blind-pairs/{}/answer", pair["code"].as_str().unwrap());
    send(&service, &rater, &Method::POST, &path, json_of, "{\"answer\": \"first\"}").await;
    assert!(service.feedback(study).await.iter().any(|row| row.by_rater && row.could_have_known));
    service.stop().await;
}

#[tokio::test]
async fn skipped_pairs_and_unsafe_gaits_are_not_shown_again() {
    let (_folder, service, study) = waiting(12).await;
    let mut unsafe_trial = None;
    let mut turn = 0;
    for _ in 0..4000 {
        let present = service.wait_for(study, &[StudyState::Waiting, StudyState::Finished]).await;
        if present.state == StudyState::Finished {
            break;
        }
        let pair = next(&service, study).await;
        if pair.is_null() {
            tokio::time::sleep(std::time::Duration::from_millis(5)).await;
            continue;
        }
        let last = shown(&service, study).await.pop().unwrap();
        if let Some(closed) = unsafe_trial {
            assert!(last.trial_a != closed && last.trial_b != closed, "an unsafe gait was shown again");
        }
        let word = if turn == 0 {
            "cannot_tell"
        } else if unsafe_trial.is_none() && last.kind == BlindPairKind::New {
            unsafe_trial = sides(&service.store, study).await.last().map(|(_, second)| *second);
            "unsafe_second"
        } else {
            "no_difference"
        };
        assert_eq!(say(&service, &pair, word).await, StatusCode::OK);
        turn += 1;
    }
    service.wait_for(study, &[StudyState::Finished]).await;
    assert!(unsafe_trial.is_some());
    let shown = shown(&service, study).await;
    let skipped = shown[0].trials();
    let again = shown[1..].iter().filter(|p| {
        let pair = p.trials();
        p.kind == BlindPairKind::New && (pair == skipped || pair == (skipped.1, skipped.0))
    });
    assert_eq!(again.count(), 0);
    service.stop().await;
}

#[tokio::test]
async fn unblinding_requires_a_reason_is_audited_and_marks_later_answers() {
    let (_folder, service) = callers::service().await;
    let study = service.study(|new| (new.answer_source, new.number_of_trials) = (AnswerSource::People, 6)).await;
    service.wait_for(study, &[StudyState::Waiting]).await;
    let (rater, admin) = (rater_of(&service, &[study]).await, signed_in(&service, Role::Administrator).await);
    let post = async |who: &As, path: &str, body: Value| {
        send(&service, who, &Method::POST, path, "application/json", &body.to_string()).await
    };
    let next = format!("/api/v1/studies/{study}/blind-pairs/next");
    let pair = post(&rater, &next, json!({})).await.json()["pair"].clone();
    let code = pair["code"].as_str().unwrap();
    post(&rater, &format!("/api/v1/blind-pairs/{code}/answer"), json!({"answer": "second"})).await;
    let path = format!("/api/v1/studies/{study}/raters/unblind");
    let refused = post(&admin, &path, json!({"rater": "a rater", "reason": " "})).await;
    assert_eq!(refused.json()["field"], "reason");
    let concealed =
        send(&service, &admin, &Method::GET, &format!("/api/v1/studies/{study}/unblinded-pairs"), "", "").await;
    assert_eq!(concealed.items(), json!([]), "before unblinding");
    let unknown = post(&admin, &path, json!({"rater": "nobody", "reason": "r"})).await;
    assert_eq!(unknown.json()["field"], "rater");
    let told = post(&admin, &path, json!({"rater": "a rater", "reason": "adverse event"})).await;
    assert_eq!(told.status, StatusCode::OK);
    let list = format!("/api/v1/studies/{study}/unblinded-pairs");
    let read = send(&service, &admin, &Method::GET, &list, "", "").await;
    assert_eq!(read.items()[0]["shown_first"], json!(sides(&service.store, study).await[0].0));
    assert!(!read.text.contains(code));
    let of_nobody = send(&service, &admin, &Method::GET, &format!("{list}?rater=nobody"), "", "").await;
    assert_eq!(of_nobody.items(), json!([]));
    let rows = audit::page(&mut service.store.read().await.unwrap(), "", None, 1).await.unwrap();
    assert_eq!((rows[0].change.as_str(), &rows[0].detail["reason"]), ("study.unblind_rater", &json!("adverse event")));
    loop {
        service.wait_for(study, &[StudyState::Waiting]).await;
        if !post(&rater, &next, json!({})).await.json()["pair"].is_null() {
            break;
        }
    }
    let shown = shown(&service, study).await;
    assert_eq!(shown.iter().map(|p| p.could_have_known).collect::<Vec<_>>(), [false, true]);
    service.stop().await;
}

#[tokio::test]
async fn newest_answer_can_be_retracted_once_and_no_longer_counts() {
    const FORM: &str = "application/x-www-form-urlencoded";
    let (_folder, service, study) = waiting(6).await;
    let pair = next(&service, study).await;
    let at = |pair: &Value, what: &str| format!("/rate/pair/{}{what}", pair["code"].as_str().unwrap());
    assert_eq!(say(&service, &pair, "first").await, StatusCode::OK);
    let answers_in_force = |rows: &[gaitwright_store::feedback::FeedbackRow]| {
        rows.iter().filter(|row| row.by_rater && row.retraction.is_none()).count()
    };
    assert_eq!(answers_in_force(&service.feedback(study).await), 1);
    let back = service.post_text(&at(&pair, "/retract"), FORM, "").await;
    assert_eq!(back.status, StatusCode::SEE_OTHER, "{}", back.text);
    assert_eq!(answers_in_force(&service.feedback(study).await), 0);
    let found = service.fetch(&format!("/api/v1/studies/{study}/raters")).await.items();
    assert_eq!((&found[0]["shown"], &found[0]["answered"]), (&json!(1), &json!(0)), "{found}");
    assert_eq!(service.post_text(&at(&pair, "/retract"), FORM, "").await.status, StatusCode::CONFLICT);

    // Neither an earlier answer nor a safety report can be retracted.
    let mut pairs = Vec::new();
    while pairs.len() < 2 {
        service.wait_for(study, &[StudyState::Waiting]).await;
        let pair = next(&service, study).await;
        if !pair.is_null() {
            let answer = if pairs.is_empty() { "cannot_tell" } else { "unsafe_second" };
            assert_eq!(say(&service, &pair, answer).await, StatusCode::OK);
            pairs.push(pair);
        }
    }
    for pair in &pairs {
        let refused = service.post_text(&at(pair, "/retract"), FORM, "").await;
        assert_eq!(refused.status, StatusCode::CONFLICT, "{}", refused.text);
    }
    service.stop().await;
}

#[tokio::test]
async fn access_page_shows_raters_and_unblinds_for_administrators_only() {
    let (_folder, service) = callers::service().await;
    let study = service.study(|new| (new.answer_source, new.number_of_trials) = (AnswerSource::People, 6)).await;
    service.wait_for(study, &[StudyState::Waiting]).await;
    let rater = rater_of(&service, &[study]).await;
    let (admin, clinician) =
        (signed_in(&service, Role::Administrator).await, signed_in(&service, Role::Clinician).await);
    let (page, form) = (format!("/studies/{study}/members"), "application/x-www-form-urlencoded");
    let read = async |who: &As| send(&service, who, &Method::GET, &page, "", "").await.text;
    assert!(!read(&admin).await.contains("id=\"raters\""), "nobody has compared gaits yet");

    let next = format!("/api/v1/studies/{study}/blind-pairs/next");
    let pair = send(&service, &rater, &Method::POST, &next, "application/json", "{}").await.json()["pair"].clone();
    let answer = format!("/api/v1/blind-pairs/{}/answer", pair["code"].as_str().unwrap());
    send(&service, &rater, &Method::POST, &answer, "application/json", r#"{"answer": "first"}"#).await;
    let (seen, by_clinician) = (read(&admin).await, read(&clinician).await);
    assert!(seen.contains("<th scope=\"row\">a rater</th>") && seen.contains("<td>concealed</td>"), "{seen}");
    assert!(seen.contains("value=\"unblind\"") && !by_clinician.contains("value=\"unblind\""), "{by_clinician}");

    let unblind = "button=unblind&rater=a+rater&reason=adverse+event";
    let refused = send(&service, &clinician, &Method::POST, &page, form, unblind).await;
    assert_eq!(refused.status, StatusCode::FORBIDDEN);
    let without_reason = send(&service, &admin, &Method::POST, &page, form, "button=unblind&rater=a+rater").await;
    assert_eq!(without_reason.status, StatusCode::UNPROCESSABLE_ENTITY);
    assert!(read(&admin).await.contains("<td>concealed</td>"), "refused requests reveal nothing");
    let done = send(&service, &admin, &Method::POST, &page, form, unblind).await;
    assert_eq!(done.status, StatusCode::SEE_OTHER, "{}", done.text);
    let seen = read(&admin).await;
    assert!(seen.contains("<td>1 of 1 (21 % to 100 %)</td>") && !seen.contains("value=\"unblind\""), "{seen}");
    service.stop().await;
}
