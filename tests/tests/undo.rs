//! Undo of a changed answer brings back the answer that stood before, at every entry point.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gaitwright_service::access::Caller;
use gaitwright_service::studies::recorded_answer::RecordedAnswer;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_service::studies::undo;
use gaitwright_store::feedback::FeedbackRow;
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_store::trials::TrialState;
use gaitwright_store::{AnswerId, Store, StudyId, TrialId, commit, studies};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::archives::{exported, import};
use gaitwright_tests::callers::FORM;
use gaitwright_tests::consistent_gaits::Consistent;
use gaitwright_tests::service::{Answer, Service};
use serde_json::{Value, json};
use tempfile::TempDir;

/// A finished study and two of its converged trials.
async fn finished(service: &Service) -> (StudyId, TrialId, TrialId) {
    let study = service.study(|new| new.number_of_trials = 5).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trials = service.trials(study).await;
    let mut converged = trials.iter().filter(|trial| trial.state == TrialState::Converged).map(|trial| trial.id);
    (study, converged.next().unwrap(), converged.next().unwrap())
}

async fn started() -> (TempDir, Service, StudyId, TrialId, TrialId) {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let (study, a, b) = finished(&service).await;
    (folder, service, study, a, b)
}

/// Gives an answer on the page of the comparison and returns its identifier.
async fn answer(service: &Service, study: StudyId, fields: &str, changes: &str) -> String {
    let key = AnswerId::fresh();
    let form = format!("{fields}&source=clinician&author=K&note=firm&changes={changes}&key={key}");
    saved(&service.post_text(&format!("/studies/{study}/compare"), FORM, &form).await)
}

async fn press_undo(service: &Service, study: StudyId, saved: &str) -> Answer {
    service.post_text(&format!("/studies/{study}/undo"), FORM, &format!("saved={saved}&author=K")).await
}

/// The answer that a page leads to.
#[track_caller]
fn saved(answer: &Answer) -> String {
    assert_eq!(answer.status, StatusCode::SEE_OTHER, "{}", answer.text);
    answer.headers["location"].to_str().unwrap().split("saved=").nth(1).unwrap().to_owned()
}

async fn recorded(service: &Service, id: &str) -> RecordedAnswer {
    RecordedAnswer::get(&mut service.store.read().await.unwrap(), None, id.parse().unwrap()).await.unwrap()
}

/// Which recorded answers count.
async fn in_force(service: &Service, ids: &[&str]) -> Vec<bool> {
    let mut found = Vec::new();
    for id in ids {
        found.push(recorded(service, id).await.retraction().is_none());
    }
    found
}

async fn learner_log(service: &Service, study: StudyId) -> Vec<String> {
    let mut reader = service.store.read().await.unwrap();
    let study = studies::get(&mut reader, study).await.unwrap();
    let log = StudySnapshot::read(&mut reader, study).await.unwrap().log();
    let mut feedback: Vec<String> = log.feedback.iter().map(|entry| format!("{entry:?}")).collect();
    feedback.sort();
    feedback
}

#[tokio::test]
async fn undo_of_a_changed_answer_on_the_page_brings_the_former_one_back() {
    let (_folder, service, study, a, b) = started().await;
    let pair = format!("a={a}&b={b}");
    let first = answer(&service, study, &format!("{pair}&answer=b"), "").await;
    let before = learner_log(&service, study).await;
    // Each step changes the answer in force, and undoes that: a preference, no difference, and an assessment.
    let mut standing = first.clone();
    for changed in ["a", "no_difference", "cannot_tell"] {
        let newer = answer(&service, study, &format!("{pair}&answer={changed}"), &standing).await;
        assert_ne!(learner_log(&service, study).await, before);
        let page = service.fetch(&format!("/studies/{study}/compare?saved={newer}")).await.text;
        assert!(page.contains(&format!("action=\"/studies/{study}/undo\" data-undo")), "{page}");
        let restored = saved(&press_undo(&service, study, &newer).await);
        assert_eq!(saved(&press_undo(&service, study, &newer).await), restored, "the form sent twice counts once");
        assert_eq!(in_force(&service, &[&standing, &newer, &restored]).await, [false, false, true]);
        let (old, new) = (recorded(&service, &standing).await, recorded(&service, &restored).await);
        assert!(new.is_copy_of(&old) && new.created_at() > old.created_at(), "{new:?}");
        assert_eq!(new.restores(), Some(old.id()));
        assert_eq!(learner_log(&service, study).await, before);
        let page = service.fetch(&format!("/studies/{study}/compare?saved={restored}")).await.text;
        assert!(page.contains("The earlier answer counts again") && !page.contains("data-undo data"), "{page}");
        // The undo cannot be undone.
        let refused = press_undo(&service, study, &restored).await;
        assert_eq!(refused.status, StatusCode::CONFLICT);
        assert!(refused.text.contains("An undo cannot be undone") && refused.text.contains("</html>"));
        standing = restored;
    }
    let page = service.fetch(&format!("/studies/{study}")).await.text;
    assert!(page.contains("brought back by undo") && page.contains("retracted: undone immediately after answering"));
    // Without a former answer, nothing counts after an undo.
    let pair = format!("a={b}&b={a}&answer=cannot_tell&source=clinician&author=L&note=&key={}", AnswerId::fresh());
    let only = saved(&service.post_text(&format!("/studies/{study}/compare"), FORM, &pair).await);
    let undone = saved(&press_undo(&service, study, &only).await);
    assert!(undone.starts_with(&format!("{only}&a=")), "back to the two gaits: {undone}");
    assert_eq!(in_force(&service, &[&only, &standing]).await, [false, true]);
    service.stop().await;
}

#[tokio::test]
async fn undo_brings_an_assessment_back_and_refuses_safety_reports() {
    let (_folder, service, study, a, b) = started().await;
    let pair = format!("a={a}&b={b}");
    let first = answer(&service, study, &format!("{pair}&answer=cannot_tell"), "").await;
    let newer = answer(&service, study, &format!("{pair}&answer=a"), &first).await;
    let restored = saved(&press_undo(&service, study, &newer).await);
    let assessments = service.fetch(&format!("/api/v1/studies/{study}/assessments")).await.items();
    assert_eq!((&assessments[1]["id"], &assessments[1]["restores"]), (&json!(restored), &json!(first)));
    assert_eq!((&assessments[1]["retraction"], &assessments[1]["note"]), (&Value::Null, &json!("firm")));
    // A safety report stays, even if it replaced an answer, and is recorded even if that answer counts no longer.
    for changes in [&restored, &newer] {
        let report = answer(&service, study, &format!("{pair}&answer=unsafe_a"), changes).await;
        let refused = press_undo(&service, study, &report).await;
        assert!(refused.status == StatusCode::CONFLICT && refused.text.contains("A safety report cannot be undone"));
        assert_eq!(in_force(&service, &[&restored, &report]).await, [false, true]);
    }
    let derived = service.fetch(&format!("/api/v1/studies/{study}/preferences")).await.items();
    let derived = derived.as_array().unwrap().last().unwrap()["id"].as_str().unwrap().to_owned();
    let refused = service.post(&format!("/api/v1/preferences/{derived}/undo"), &json!({})).await;
    assert_eq!(refused.json()["type"], "/problems/cannot-be-undone", "{}", refused.text);
    service.stop().await;
}

#[tokio::test]
async fn programs_change_and_undo_answers() {
    let (_folder, service, study, a, b) = started().await;
    let preferences = format!("/api/v1/studies/{study}/preferences");
    let give = |answer: &str, author: &str, replaces: &Value| json!({"trial_a": a, "trial_b": b, "answer": answer, "author": author, "replaces": replaces});
    let first = service.post(&preferences, &give("a", "S01", &Value::Null)).await.json();
    assert_eq!((&first["replaces"], &first["restores"]), (&Value::Null, &Value::Null));
    let newer = service.post(&preferences, &give("b", "S01", &first["id"])).await.json();
    assert_eq!(newer["replaces"], first["id"], "{newer}");
    let undo = format!("/api/v1/preferences/{}/undo", newer["id"].as_str().unwrap());
    let undone = service.post(&undo, &json!({"author": "S01"})).await;
    assert_eq!(undone.status, StatusCode::OK, "{}", undone.text);
    let restored = undone.json()["preference"].clone();
    assert_eq!((&restored["restores"], &restored["content"]), (&first["id"], &first["content"]));
    assert_eq!((&restored["author"], &restored["retraction"]), (&json!("S01"), &Value::Null));
    let read = service.fetch(&format!("/api/v1/preferences/{}", newer["id"].as_str().unwrap())).await.json();
    assert_eq!(read["retraction"]["author"], "S01");
    // A second undo, an undo of the undo, and an undo of the answer that was changed.
    let of = |row: &Value| format!("/api/v1/preferences/{}/undo", row["id"].as_str().unwrap());
    for (path, why) in [
        (undo, "was already undone"),
        (of(&restored), "An undo cannot be undone"),
        (of(&first), "no longer counts: another answer was given instead"),
        (of(&of_gait_rmse(&service, study).await), "Only people's answers"),
    ] {
        let refused = service.post(&path, &json!({})).await;
        assert_eq!(
            (refused.status, &refused.json()["type"]),
            (StatusCode::CONFLICT, &json!("/problems/cannot-be-undone"))
        );
        assert!(refused.text.contains(why), "{why}: {}", refused.text);
    }
    // Only a person's answer about the same two trials can be replaced, and once.
    let other = service.trials(study).await.into_iter().rfind(|trial| trial.state == TrialState::Converged).unwrap().id;
    let elsewhere = json!({"trial_a": a, "trial_b": other, "answer": "a", "author": "S01", "replaces": restored["id"]});
    for (body, status) in [
        (elsewhere, StatusCode::UNPROCESSABLE_ENTITY),
        (give("b", "S01", &json!(AnswerId::fresh())), StatusCode::UNPROCESSABLE_ENTITY),
        (give("b", "S01", &first["id"]), StatusCode::CONFLICT),
        (give("b", "S01", &Value::Null), StatusCode::CONFLICT),
    ] {
        let refused = service.post(&preferences, &body).await;
        assert_eq!(refused.status, status, "{}", refused.text);
    }
    // An assessment replaces a preference; the undo of the assessment brings the preference back.
    let unclear = give("cannot_tell", "S01", &restored["id"]);
    let unclear = service.post(&format!("/api/v1/studies/{study}/assessments"), &unclear).await.json();
    assert_eq!(unclear["replaces"], restored["id"], "{unclear}");
    let undo = format!("/api/v1/assessments/{}/undo", unclear["id"].as_str().unwrap());
    let undone = service.post(&undo, &json!({})).await.json();
    assert_eq!((&undone["preference"]["restores"], &undone["assessment"]), (&restored["id"], &Value::Null));
    let csv = service.fetch(&format!("{preferences}.csv")).await.text;
    assert!(csv.lines().next().unwrap().ends_with("replaces,restores"), "{csv}");
    let standing = format!(",{}", restored["id"].as_str().unwrap());
    assert!(csv.lines().any(|line| line.trim().ends_with(&standing)), "{csv}");
    service.stop().await;
}

async fn of_gait_rmse(service: &Service, study: StudyId) -> Value {
    let rows = service.fetch(&format!("/api/v1/studies/{study}/preferences")).await.items();
    rows.as_array().unwrap().iter().find(|row| row["source"] == "gait_rmse").unwrap().clone()
}

#[tokio::test]
async fn late_undo_is_refused() {
    let (_folder, service, study, a, b) = started().await;
    let (first, late) = (AnswerId::fresh(), AnswerId::fresh());
    let mut writer = service.store.write().await.unwrap();
    for (id, replaces, seconds) in [(first, None, 200), (late, Some(first), 121)] {
        let at = gaitwright_store::now().plus_seconds(-seconds).to_string();
        sqlx::query(
            "insert into feedback (id, study_id, kind, trial_a, trial_b, source, author, replaces, created_at) \
             values (?, ?, 'preference', ?, ?, 'clinician', 'K', ?, ?)",
        )
        .bind(id)
        .bind(study)
        .bind(a)
        .bind(b)
        .bind(replaces)
        .bind(at)
        .execute(&mut **writer)
        .await
        .unwrap();
    }
    commit(writer).await.unwrap();
    let refused = service.post(&format!("/api/v1/preferences/{late}/undo"), &json!({})).await;
    assert_eq!((refused.status, &refused.json()["type"]), (StatusCode::CONFLICT, &json!("/problems/cannot-be-undone")));
    assert!(refused.text.contains("more than two minutes ago"), "{}", refused.text);
    let page = press_undo(&service, study, &late.to_string()).await;
    assert!(page.status == StatusCode::CONFLICT && page.text.contains("more than two minutes ago"), "{}", page.text);
    assert!(page.text.contains("Retract this answer"), "the page offers what is possible: {}", page.text);
    service.stop().await;
}

#[tokio::test]
async fn undo_that_fails_or_is_interrupted_changes_nothing() {
    let (_folder, service, study, a, b) = started().await;
    let pair = format!("a={a}&b={b}");
    let first = answer(&service, study, &format!("{pair}&answer=b"), "").await;
    let newer = answer(&service, study, &format!("{pair}&answer=a"), &first).await;
    let before = service.feedback(study).await;
    // Everything is done, but the process ends before the change is durable.
    let mut writer = service.store.write().await.unwrap();
    let caller = Caller::without_sign_in();
    let restored = undo::undo(&mut writer, &caller, None, newer.parse().unwrap(), None).await.unwrap();
    assert!(restored.is_some());
    drop(writer);
    assert_eq!(service.feedback(study).await, before);
    // The former answer cannot be brought back: then the newer one stays, too.
    let mut writer = service.store.write().await.unwrap();
    sqlx::query(
        "insert into feedback (id, study_id, kind, trial_a, trial_b, source, author, restores, created_at) \
         select ?, study_id, kind, trial_a, trial_b, source, author, id, created_at from feedback where id = ?",
    )
    .bind(AnswerId::fresh())
    .bind(&first)
    .execute(&mut **writer)
    .await
    .unwrap();
    commit(writer).await.unwrap();
    let before = service.feedback(study).await;
    let failed = service.post(&format!("/api/v1/preferences/{newer}/undo"), &json!({})).await;
    assert!(!failed.status.is_success(), "{}", failed.text);
    assert_eq!(service.feedback(study).await, before);
    service.stop().await;
}

#[tokio::test]
async fn undo_is_refused_if_the_former_author_has_answered_again() {
    let (_folder, service, study, a, b) = started().await;
    let preferences = format!("/api/v1/studies/{study}/preferences");
    let give = async |answer: &str, author: &str, replaces: &Value| {
        let body = json!({"trial_a": a, "trial_b": b, "answer": answer, "author": author, "replaces": replaces});
        let given = service.post(&preferences, &body).await;
        assert_eq!(given.status, StatusCode::CREATED, "{}", given.text);
        given.json()
    };
    let first = give("a", "S01", &Value::Null).await;
    let newer = give("b", "S02", &first["id"]).await;
    give("no_difference", "S01", &Value::Null).await;
    let refused =
        service.post(&format!("/api/v1/preferences/{}/undo", newer["id"].as_str().unwrap()), &json!({})).await;
    assert!(refused.text.contains("S01 has answered this comparison again since"), "{}", refused.text);
    service.stop().await;
}

#[tokio::test]
async fn raters_answer_a_pair_once_and_staff_neither_change_nor_undo_it() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let study = service.study(|new| (new.number_of_trials, new.answer_source) = (4, AnswerSource::People)).await;
    service.wait_for(study, &[StudyState::Waiting]).await;
    let pair = service.post(&format!("/api/v1/studies/{study}/blind-pairs/next"), &json!({})).await.json();
    let code = pair["pair"]["code"].as_str().unwrap();
    let path = format!("/api/v1/blind-pairs/{code}/answer");
    assert_eq!(service.post(&path, &json!({"answer": "first"})).await.status, StatusCode::OK);
    let rated: FeedbackRow = service.feedback(study).await.into_iter().find(|row| row.by_rater).unwrap();
    let (a, b) = RecordedAnswer::Preference(rated.clone()).pair().unwrap();
    let refused = service.post(&format!("/api/v1/preferences/{}/undo", rated.id), &json!({})).await;
    assert!(refused.text.contains("Only the rater"), "{}", refused.text);
    let change = json!({"trial_a": a, "trial_b": b, "answer": "a", "author": "K", "replaces": rated.id});
    let refused = service.post(&format!("/api/v1/studies/{study}/preferences"), &change).await;
    assert!(
        refused.status == StatusCode::CONFLICT && refused.text.contains("A rater's answer cannot be changed"),
        "{}",
        refused.text
    );
    let page = service.fetch(&format!("/studies/{study}/compare?change={}", rated.id)).await.text;
    assert!(!page.contains("Change an answer"), "{page}");
    // The rater cannot change it either, so undo brings nothing back.
    let another = service.post_text(&format!("/rate/pair/{code}"), FORM, "answer=second&note=").await;
    assert_eq!(another.status, StatusCode::CONFLICT);
    let back = service.post_text(&format!("/rate/pair/{code}/retract"), FORM, "").await;
    assert_eq!(back.status, StatusCode::SEE_OTHER, "{}", back.text);
    let rows = service.feedback(study).await;
    assert!(rows.iter().all(|row| row.restores.is_none() && (!row.by_rater || row.retraction.is_some())), "{rows:?}");
    service.stop().await;
}

#[tokio::test]
async fn lab_answer_can_be_given_again_after_a_retraction_and_its_change_by_staff_undone() {
    let (_folder, service, study, a, b) = started().await;
    for _ in 0..2 {
        let session = json!({"trial_a": a, "trial_b": b});
        let session = service.post(&format!("/api/v1/studies/{study}/lab-sessions"), &session).await.json();
        let lab = format!("/api/v1/lab-sessions/{}", session["id"].as_str().unwrap());
        for walk in 1..=3 {
            service.post(&format!("{lab}/walks"), &json!({"walk": walk})).await;
        }
        // On the lab screen an answer is retracted before it is given again, so nothing is replaced.
        for number in 1..=2 {
            let said = json!({"number": number, "answer": "first"});
            assert_eq!(service.post(&format!("{lab}/answers"), &said).await.status, StatusCode::OK);
            let back = service.post(&format!("{lab}/retract-answer"), &json!({})).await.json();
            assert_eq!((&back["answer"], &back["answer_number"]), (&Value::Null, &json!(number + 1)), "{back}");
        }
        service.post(&format!("{lab}/answers"), &json!({"number": 3, "answer": "first"})).await;
        assert!(service.post(&format!("{lab}/unblind"), &json!({"reason": "over"})).await.status.is_success());
    }
    // One of the two answers is changed; the other one stays.
    let before = learner_log(&service, study).await;
    let of_subject = service.fetch(&format!("/api/v1/studies/{study}/preferences")).await.items();
    let of_subject = of_subject.as_array().unwrap().iter().find(|row| row["source"] == "subject").unwrap().clone();
    let (id, author) = (of_subject["id"].as_str().unwrap(), of_subject["author"].as_str().unwrap());
    let form = format!(
        "a={a}&b={b}&answer=no_difference&source=subject&author={author}&note=&changes={id}&key={}",
        AnswerId::fresh()
    );
    let newer = saved(&service.post_text(&format!("/studies/{study}/compare"), FORM, &form).await);
    assert_ne!(learner_log(&service, study).await, before);
    let restored = saved(&press_undo(&service, study, &newer).await);
    assert_eq!(in_force(&service, &[id, &newer, &restored]).await, [false, false, true]);
    assert_eq!(learner_log(&service, study).await, before);
    service.stop().await;
}

#[tokio::test]
async fn archive_preserves_changes_and_undos() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Consistent::default(), 1).await;
    let (study, a, b) = finished(&service).await;
    let pair = format!("a={a}&b={b}");
    let first = answer(&service, study, &format!("{pair}&answer=b"), "").await;
    let newer = answer(&service, study, &format!("{pair}&answer=cannot_tell"), &first).await;
    let restored = saved(&press_undo(&service, study, &newer).await);
    let unclear = answer(&service, study, &format!("{pair}&answer=cannot_tell"), &restored).await;
    let newest = answer(&service, study, &format!("{pair}&answer=a"), &unclear).await;
    let last = saved(&press_undo(&service, study, &newest).await);
    let ids = [&first, &newer, &restored, &unclear, &newest, &last];
    let mut before = Vec::new();
    for id in ids {
        before.push(recorded(&service, id).await);
    }
    let file = exported(&service.store, study).await;
    service.stop().await;
    let other = Store::open(&folder.path().join("b.db")).await.unwrap();
    assert_eq!(import(&other, &file).await.unwrap(), study);
    let mut reader = other.read().await.unwrap();
    for (id, before) in ids.into_iter().zip(before) {
        let after = RecordedAnswer::get(&mut reader, Some(study), id.parse().unwrap()).await.unwrap();
        assert!(after.is_copy_of(&before) && after.created_at() == before.created_at(), "{after:?}");
        assert_eq!((after.replaces(), after.restores()), (before.replaces(), before.restores()));
        assert_eq!(after.retraction(), before.retraction());
    }
    drop(reader);
    other.close().await;
}
