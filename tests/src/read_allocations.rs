//! Allocations, read directly from the database, for tests that compare responses with them.

use gaitwright_store::{LabSessionId, Store, StudyId, TrialId};
use sqlx::Row;

/// Whether walk 2 of a session is with gait A.
pub async fn gait_a_first(store: &Store, session: LabSessionId) -> bool {
    let row = sqlx::query("select gait_a_first from lab_allocations where lab_session_id = ?").bind(session);
    row.fetch_one(&mut **store.read().await.unwrap()).await.unwrap().get(0)
}

/// The trials that raters of a study were shown first and second, in the order in which they were drawn.
pub async fn sides(store: &Store, study: StudyId) -> Vec<(TrialId, TrialId)> {
    let rows = sqlx::query(
        "select iif(a.swapped, p.trial_b, p.trial_a), iif(a.swapped, p.trial_a, p.trial_b) \
         from blind_pairs p join blind_pair_allocations a on a.pair_id = p.id where p.study_id = ? \
         order by p.id",
    );
    let rows = rows.bind(study).fetch_all(&mut **store.read().await.unwrap()).await.unwrap();
    rows.iter().map(|row| (row.get(0), row.get(1))).collect()
}
