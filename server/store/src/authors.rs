//! The authors of answers about two gaits, wherever they were given.

use super::{Connection, StoreResult, StudyId, TrialId};

/// Everybody who may have an answer about two trials of a study in either order: a preference, an assessment, an answer to
/// a blinded pair, or a suggestion. Each name once. Of these tables, only the first is large; for the others, the answers
/// to other pairs and retracted ones count as well.
const AUTHORS: &str = "select author from feedback where trial_a = ?2 and trial_b = ?3 and source <> 'gait_rmse' \
     union select author from feedback where trial_a = ?3 and trial_b = ?2 and source <> 'gait_rmse' \
     union select author from assessments where study_id = ?1 \
     union select rater from blind_pairs where study_id = ?1 \
     union select author from feedback indexed by feedback_suggestions where study_id = ?1 and kind = 'suggestion' \
     and suggested in (select action_index from trials where id in (?2, ?3))";

/// The names of those who may have answered already. Everybody with a standing answer about the pair is among them.
///
/// # Errors
/// Errors of the database.
pub async fn of_pair(db: &mut Connection, study: StudyId, (a, b): (TrialId, TrialId)) -> StoreResult<Vec<String>> {
    Ok(sqlx::query_scalar(AUTHORS).bind(study).bind(a).bind(b).fetch_all(db).await?)
}
