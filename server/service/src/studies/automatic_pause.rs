//! Pauses a study after failed trials.

use super::snapshot::StudySnapshot;
use gaitwright_store::trials::TrialState;

/// After this many failed trials in a row a study is paused, because its set-up is probably wrong.
const FAILURES_IN_A_ROW: usize = 3;

/// Why the study is paused, if its last trials failed.
pub(super) fn reason_to_pause(snapshot: &StudySnapshot) -> Option<String> {
    let ended = || snapshot.trials.iter().rev().filter(|trial| !trial.state.is_open());
    let failed = ended().take(FAILURES_IN_A_ROW).filter(|trial| trial.state == TrialState::Failed).count();
    if failed < FAILURES_IN_A_ROW {
        return None;
    }
    let last = ended().next().map_or("", |trial| trial.message.as_str());
    Some(format!("{failed} trials in a row failed. The last one: {last}"))
}
