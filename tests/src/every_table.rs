//! A record with a row in every table.

use crate::analytic::Analytic;
use crate::service::Service;
use axum::body::Body;
use axum::http::{Request, StatusCode};
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_store::{StudyId, commit};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A record with a row in every table, in a folder of its own.
pub async fn filled() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    fill(&database).await;
    (folder, database)
}

/// Changes an answer about the two trials of another one, and undoes that.
async fn change_and_undo(service: &Service, study: StudyId, content: &Value) {
    let mut answer = json!({
        "trial_a": content["winner"], "trial_b": content["loser"], "answer": "a", "author": "K", "replaces": null,
    });
    let preferences = format!("/api/v1/studies/{study}/preferences");
    for _ in 0..2 {
        let given = service.post(&preferences, &answer).await;
        assert_eq!(given.status, StatusCode::CREATED, "{}", given.text);
        answer["replaces"] = given.json()["id"].clone();
    }
    let newest = answer["replaces"].as_str().unwrap();
    let undone = service.post(&format!("/api/v1/preferences/{newest}/undo"), &json!({})).await;
    assert_eq!(undone.status, StatusCode::OK, "{}", undone.text);
}

/// Writes a record with a row in every table.
pub async fn fill(database: &Path) {
    let solver = Analytic { other_local_optima: 1, ..Analytic::default() };
    let service = Service::start(database, solver, 1).await;
    let study = service.study(|new| (new.number_of_trials, new.answer_source) = (4, AnswerSource::People)).await;
    service.wait_for(study, &[StudyState::Waiting]).await;
    let pair = service.post(&format!("/api/v1/studies/{study}/blind-pairs/next"), &json!({})).await.json();
    let answer = format!("/api/v1/blind-pairs/{}/answer", pair["pair"]["code"].as_str().unwrap());
    assert_eq!(service.post(&answer, &json!({"answer": "first"})).await.status, StatusCode::OK);
    service.wait_for(study, &[StudyState::Waiting]).await;
    let given = service.fetch(&format!("/api/v1/studies/{study}/preferences")).await.items();
    let retract = format!("/api/v1/preferences/{}/retract", given[0]["id"].as_str().unwrap());
    change_and_undo(&service, study, &given[0]["content"]).await;
    for (path, body) in [
        (retract, json!({"reason": "mistyped"})),
        (format!("/api/v1/subjects/{}/consents", service.subject().await), json!({"form": "form 3"})),
        (
            format!("/api/v1/studies/{study}/raters/unblind"),
            json!({"rater": "an anonymous visitor", "reason": "asked"}),
        ),
        ("/api/v1/users".to_owned(), json!({"name": "R1", "role": "rater"})),
        ("/api/v1/tokens".to_owned(), json!({"name": "rig", "scopes": ["read"]})),
    ] {
        let done = service.post(&path, &body).await;
        assert!(done.status.is_success(), "{path}: {}", done.text);
    }
    let subject = json!({"pseudonym": "P1", "height_m": 1.8, "body_mass_kg": 70.0}).to_string();
    let with_key = Request::post("/api/v1/subjects")
        .header("content-type", "application/json")
        .header("idempotency-key", "key-1")
        .body(Body::from(subject))
        .unwrap();
    assert_eq!(service.send(with_key).await.status, StatusCode::CREATED);
    let mut writer = service.store.write().await.unwrap();
    for sql in [
        "insert into sign_in_links (hash, user_id, created_at, expires_at) select hex(zeroblob(32)), id, '', '' from users \
         limit 1",
        "insert into sessions (hash, id, user_id, created_at, seen_at) select hex(zeroblob(32)), 'Z', id, '', '' from users limit 1",
        "insert into certificates select trial_id, 1, 1, '{}', created_at from gaits limit 1",
        "insert into explanation_requests (trial_id, actor, created_at) select id, 'K', '' from trials limit 1",
        "insert into explanations (trial_id, stopped_early, program, problem_sha256, document, created_at) \
         select trial_id, 0, 'P', gait_sha256, '{}', created_at from gaits limit 1",
        "insert into blind_pair_retractions select pair_id, created_at from blind_pair_answers limit 1",
        "insert into lab_sessions (id, study_id, number, trial_a, trial_b, actor, created_at) \
         select 'L', study_id, 1, min(id), max(id), 'K', '' from trials group by study_id",
        "insert into lab_allocations (lab_session_id, gait_a_first, nonce, created_at) \
         values ('L', 1, lower(hex(randomblob(32))), '')",
        "insert into controller_file_downloads (id, lab_session_id, walk, to_device, actor, created_at) \
         values ('D', 'L', 2, 0, 'K', '')",
        "insert into lab_session_steps (lab_session_id, step, actor, created_at) values ('L', 'walk_1', 'K', '')",
        "insert into lab_answers (lab_session_id, number, answer, actor, created_at) values ('L', 1, 'first', 'K', '')",
        "insert into lab_answer_retractions (lab_session_id, number, actor, created_at) values ('L', 1, 'K', '')",
        "insert into assessments (id, study_id, trial_a, trial_b, answer, source, author, replaces, created_at) \
         select 'M', study_id, min(id), max(id), 'cannot_tell', 'clinician', 'K', 'N', '' from trials group by study_id",
        "insert into assessments (id, study_id, trial_a, trial_b, answer, source, author, restores, created_at) \
         select 'O', study_id, trial_a, trial_b, answer, source, author, id, '' from assessments where id = 'M'",
        "insert into assessment_retractions (assessment_id, author, reason, created_at) values ('M', 'K', 'r', '')",
        "insert into safety_reviews (id, trial_id, decision, author, reason, created_at) \
         select 'I', id, 'unsafe', 'K', 'r', '' from trials limit 1",
        "insert into safety_reports (id, trial_id, source, author, created_at) \
         select 'S', id, 'clinician', 'K', '' from trials limit 1",
        "insert into safety_review_reports (review_id, report_id) values ('I', 'S')",
        "insert into measurement_files (id, lab_session_id, walk, kind, reading, raw, raw_sha256, actor, created_at) \
         values ('R', 'L', 1, 'joint_angles', '{}', x'00', '', 'K', '')",
        "insert into emg_results (id, lab_session_id, document, actor, created_at) values ('E', 'L', '{}', 'K', '')",
        "insert into subject_muscles (subject_id, definition, actor, created_at) \
         select id, '{}', 'K', '' from subjects limit 1",
        "insert into subject_corrections (subject_id, height_m, body_mass_kg, reason, actor, created_at) \
         select id, 1.8, 70.0, 'r', 'K', '' from subjects limit 1",
        "insert into access_log (created_at, last_at, times, kind, actor, address, method, route, object, status) \
         values ('', '', 1, 'view', 'K', '', 'GET', '/', '/', 200)",
        "insert into access_prunings (up_to, older_than_days, actor, created_at) values (0, 1, 'K', '')",
        "insert into imports (study_id, file_sha256, trusted, unchecked_rmse, actor, created_at) \
         select id, hex(zeroblob(32)), 0, 0, 'K', '' from studies limit 1",
    ] {
        sqlx::query(sql).execute(&mut **writer).await.unwrap();
    }
    commit(writer).await.unwrap();
    for (path, body) in [(format!("/api/v1/studies/{study}/members"), json!({"kind": "user", "name": "R1"}))] {
        let done = service.post(&path, &body).await;
        assert!(done.status.is_success(), "{path}: {}", done.text);
        if let Some(member) = done.json()["id"].as_str() {
            let removed = service.post(&format!("/api/v1/study-members/{member}/remove"), &json!({})).await;
            assert_eq!(removed.status, StatusCode::OK, "{}", removed.text);
        }
    }
    let access = service.put(&format!("/api/v1/studies/{study}/access"), &json!({"restricted": true})).await;
    assert_eq!(access.status, StatusCode::OK, "{}", access.text);
    service.stop().await;
}
