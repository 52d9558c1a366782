//! A study of ten thousand trials, and the pages and lists that must stay fast with it.

use crate::analytic::Analytic;
use crate::service::Service;
use axum::http::StatusCode;
use gaitwright_store::studies::StudyState;
use gaitwright_store::{Store, StudyId, TrialId, commit};
use serde_json::Value;
use std::path::Path;
use std::time::{Duration, Instant};

/// How many trials.
pub const TRIALS: u32 = 10_000;

/// A service on a record with such a study, and one of its trials.
pub async fn service(database: &Path) -> (Service, StudyId, TrialId) {
    let service = Service::start(database, Analytic::default(), 1).await;
    let study = service.study(|new| new.number_of_trials = 3).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trial = service.trials(study).await[0].id;
    service.stop().await;
    fill(database, study).await;
    (Service::start(database, Analytic::default(), 1).await, study, trial)
}

/// Fills a finished study with trials like its first one.
pub async fn fill(database: &Path, study: StudyId) {
    fill_to(database, study, TRIALS).await;
}

/// Fills a finished study up to this number of trials like its first one.
pub async fn fill_to(database: &Path, study: StudyId, trials: u32) {
    let store = Store::open(database).await.unwrap();
    let mut writer = store.write().await.unwrap();
    let before: u32 = sqlx::query_scalar("select max(number) from trials where study_id = ?")
        .bind(study.to_string())
        .fetch_one(&mut **writer)
        .await
        .unwrap();
    sqlx::query(
        "with recursive n(i) as (select ?3 + 1 union all select i + 1 from n where i < ?1)
         insert into trials (id, study_id, number, action_index, action, reason, best_before, warm_started_from, state, status,
             gait_rmse_rad, cost_of_transport, objective, max_violation, iterations, seconds_total, report, violations,
             created_at, started_at, finished_at)
         select printf('01890000-0000-7000-8%s-%012d', substr(study_id, 34, 3), i), study_id, i, i % 11664, action, reason, id, id, state, status,
             gait_rmse_rad + i / 1e6, cost_of_transport, objective, max_violation, iterations, seconds_total, report,
             violations, created_at, started_at, finished_at
         from n join trials on study_id = ?2 and number = 1",
    )
    .bind(trials)
    .bind(study.to_string())
    .bind(before)
    .execute(&mut **writer)
    .await
    .unwrap();
    sqlx::query(
        "insert into feedback (id, study_id, kind, trial_a, label, source, author, created_at)
         select printf('01890001-0000-7000-8%s-%012d', substr(study_id, 34, 3), number), study_id, 'label', id, 'converged', 'evaluation', 'x', created_at from trials
         where study_id = ?1 and number > ?2",
    )
    .bind(study.to_string())
    .bind(before)
    .execute(&mut **writer)
    .await
    .unwrap();
    sqlx::query(
        "insert into feedback (id, study_id, kind, trial_a, trial_b, source, author, created_at)
         select printf('01890002-0000-7000-8%s-%012d', substr(t.study_id, 34, 3), t.number), t.study_id, 'preference', f.id, t.id, 'clinician', 'x', t.created_at
         from trials t join trials f on f.study_id = t.study_id and f.number = 1
         where t.study_id = ?1 and t.number > ?2",
    )
    .bind(study.to_string())
    .bind(before)
    .execute(&mut **writer)
    .await
    .unwrap();
    sqlx::query("update studies set number_of_trials = ?1 where id = ?2")
        .bind(trials)
        .bind(study.to_string())
        .execute(&mut **writer)
        .await
        .unwrap();
    commit(writer).await.unwrap();
    store.close().await;
}

/// Adds this number of answers of a person to a study with two trials.
pub async fn answer_often(database: &Path, study: StudyId, answers: u32) {
    let store = Store::open(database).await.unwrap();
    let mut writer = store.write().await.unwrap();
    sqlx::query(
        "with recursive n(i) as (select 1 union all select i + 1 from n where i < ?1)
         insert into feedback (id, study_id, kind, trial_a, trial_b, source, author, created_at)
         select printf('01890003-0000-7000-8000-%012d', i + (select max(seq) from feedback)), a.study_id, 'preference', a.id, b.id, 'clinician', 'x', a.created_at
         from n join trials a on a.study_id = ?2 and a.number = 1 join trials b on b.study_id = ?2 and b.number = 2",
    )
    .bind(answers)
    .bind(study.to_string())
    .execute(&mut **writer)
    .await
    .unwrap();
    commit(writer).await.unwrap();
    store.close().await;
}

/// The address of a page of a list after its first 9,000 entries.
async fn far_page(service: &Service, list: &str) -> String {
    let mut path = format!("{list}?limit=1000");
    let mut cursor = Value::Null;
    for _ in 0..9 {
        cursor = service.fetch(&path).await.json()["next"].take();
        path = format!("{list}?limit=1000&cursor={}", cursor.as_str().unwrap());
    }
    format!("{list}?limit=200&cursor={}", cursor.as_str().unwrap())
}

/// Each page and list, with the shortest of three response times.
pub async fn times(service: &Service, study: StudyId, trial: TrialId) -> Vec<(String, Duration)> {
    let api = format!("/api/v1/studies/{study}");
    let mut times = Vec::new();
    for path in [
        "/".to_owned(),
        format!("/studies/{study}"),
        format!("/studies/{study}/live"),
        format!("/studies/{study}?sort=a5&order=ascending&state=converged&text=drawn&page=3"),
        format!("/studies/{study}/analysis"),
        "/system".to_owned(),
        format!("/studies/{study}/compare"),
        format!("/trials/{trial}"),
        "/api/v1/studies".to_owned(),
        api.clone(),
        far_page(service, &format!("{api}/trials")).await,
        far_page(service, &format!("{api}/preferences")).await,
        format!("{api}/raters"),
        "/api/v1/audit".to_owned(),
        "/metrics".to_owned(),
    ] {
        let mut fastest = Duration::MAX;
        for _ in 0..3 {
            let begun = Instant::now();
            let answer = service.fetch(&path).await;
            fastest = fastest.min(begun.elapsed());
            assert_eq!(answer.status, StatusCode::OK, "{path}: {}", answer.text);
            assert!(answer.text.len() < 2_000_000, "{path}: {} bytes", answer.text.len());
        }
        times.push((path.replace(&study.to_string(), "STUDY").replace(&trial.to_string(), "TRIAL"), fastest));
    }
    times
}
