//! A study of ten thousand trials.

use gaitwright::store::StudyId;
use sqlx::sqlite::{SqliteConnectOptions, SqlitePoolOptions};
use std::path::Path;

/// How many there are then.
pub const TRIALS: u32 = 10_000;

/// Fills a finished study with trials like its first one.
pub async fn fill(database: &Path, study: StudyId) {
    let options = SqliteConnectOptions::new().filename(database).foreign_keys(true);
    let pool = SqlitePoolOptions::new().max_connections(1).connect_with(options).await.unwrap();
    let mut writer = pool.begin().await.unwrap();
    sqlx::query(
        "with recursive n(i) as (select 4 union all select i + 1 from n where i < ?1)
         insert into trials (id, study_id, number, action_index, action, reason, best_before, state, status,
             gait_rmse_rad, cost_of_transport, objective, max_violation, iterations, seconds_total, report, violations,
             created_at, started_at, finished_at)
         select printf('01890000-0000-7000-8000-%012d', i), study_id, i, i % 11664, action, reason, id, state, status,
             gait_rmse_rad + i / 1e6, cost_of_transport, objective, max_violation, iterations, seconds_total, report,
             violations, created_at, started_at, finished_at
         from n join trials on study_id = ?2 and number = 1",
    )
    .bind(TRIALS)
    .bind(study.to_string())
    .execute(&mut *writer)
    .await
    .unwrap();
    sqlx::query(
        "insert into feedback (id, study_id, kind, trial_a, category, source, author, created_at)
         select printf('01890001-0000-7000-8000-%012d', number), study_id, 'label', id, 1, 'convergence', 'x', created_at from trials
         where study_id = ?1 and number > 3",
    )
    .bind(study.to_string())
    .execute(&mut *writer)
    .await
    .unwrap();
    sqlx::query(
        "insert into feedback (id, study_id, kind, trial_a, trial_b, source, author, created_at)
         select printf('01890002-0000-7000-8000-%012d', t.number), t.study_id, 'preference', f.id, t.id, 'clinician', 'x', t.created_at
         from trials t join trials f on f.study_id = t.study_id and f.number = 1
         where t.study_id = ?1 and t.number > 3",
    )
    .bind(study.to_string())
    .execute(&mut *writer)
    .await
    .unwrap();
    sqlx::query("update studies set trial_budget = 10000").execute(&mut *writer).await.unwrap();
    writer.commit().await.unwrap();
    pool.close().await;
}
