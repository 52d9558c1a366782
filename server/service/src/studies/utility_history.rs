//! The utility of the recommended gait after each answer of a person, recomputed from the log.

use super::snapshot::{StudySnapshot, is_answer_of_a_person};
use gait_learner::{FeedbackLog, Learner, LearnerError, Posterior, Prediction};
use gaitwright_store::feedback::{FeedbackContent, FeedbackRow};
use gaitwright_store::safety_reviews::SafetyVersion;
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{FeedbackId, TrialId};
use std::collections::{HashMap, HashSet};

/// Largest number of points: each one costs a fit of all answers before it.
const MAX_POINTS: usize = 64;
/// Largest number of entries with which all these fits together take well below a second. A longer log has fewer points in
/// proportion, because a request waits for them.
const MAX_ENTRIES_OF_ALL_POINTS: usize = 200;

/// The recommended gait after a number of answers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UtilityPoint {
    /// Number of answers of people that count.
    pub answers: u32,
    /// The recommended trial after them.
    pub trial: TrialId,
    /// Its utility after them.
    pub utility: Prediction,
}

/// The history of a study, and the entries of the log that it was computed from.
#[derive(Debug, Default)]
pub(super) struct UtilityHistory {
    /// Sequence numbers of the entries that count.
    entries: Vec<i64>,
    safety: Option<SafetyVersion>,
    /// Points, and how many entries each is computed from.
    points: Vec<(usize, UtilityPoint)>,
}

impl UtilityHistory {
    /// The points of a snapshot. A point is computed again only if an entry before it was added or retracted.
    pub(super) fn of(&mut self, snapshot: &StudySnapshot) -> Result<Vec<UtilityPoint>, LearnerError> {
        let rows = in_order(&snapshot.feedback);
        let entries: Vec<i64> = rows.iter().map(|row| row.seq).collect();
        let unchanged = entries.iter().zip(&self.entries).take_while(|(new, old)| new == old).count();
        if self.safety != Some(snapshot.safety) {
            self.points.clear();
        }
        self.points.retain(|(used, _)| *used <= unchanged);
        (self.entries, self.safety) = (entries, Some(snapshot.safety));
        let mut learner = Learner::default();
        let mut points = Vec::new();
        for (answers, used) in prefixes(&rows) {
            let known = self.points.iter().find(|(own, point)| (*own, point.answers) == (used, answers));
            let point = match known {
                Some((_, point)) => Some(*point),
                None => point(snapshot, &mut learner, answers, &rows[..used])?,
            };
            points.extend(point.map(|point| (used, point)));
        }
        self.points = points;
        Ok(self.points.iter().map(|(_, point)| *point).collect())
    }
}

/// The entries that the learner observes, in the order in which they were first given: an answer that undo brought back
/// has the place of the original.
fn in_order(feedback: &[FeedbackRow]) -> Vec<&FeedbackRow> {
    let mut places: HashMap<FeedbackId, i64> = HashMap::new();
    for row in feedback {
        let place = row.restores.and_then(|original| places.get(&original).copied()).unwrap_or(row.seq);
        places.insert(row.id, place);
    }
    let mut rows: Vec<&FeedbackRow> = feedback.iter().filter(|row| counts(row)).collect();
    rows.sort_by_key(|row| places.get(&row.id).copied().unwrap_or(row.seq));
    rows
}

/// Whether the learner observes an entry. A label stays even if it were retracted: its trial was visited.
fn counts(row: &FeedbackRow) -> bool {
    row.retraction.is_none() || matches!(row.content, FeedbackContent::Label { .. })
}

/// Numbers of answers of people, and of the entries before the next answer. Of many answers, every second, fourth, ... and the
/// last, so that earlier points stay as the log grows.
fn prefixes(rows: &[&FeedbackRow]) -> Vec<(u32, usize)> {
    let answers: Vec<usize> = (0..rows.len()).filter(|place| is_answer_of_a_person(rows[*place])).collect();
    let stride = stride(answers.len(), rows.len());
    let shown = (1..=answers.len()).filter(|count| count % stride == 0 || *count == answers.len());
    shown
        .filter_map(|count| {
            let used = answers.get(count).copied().unwrap_or(rows.len());
            Some((u32::try_from(count).ok()?, used))
        })
        .collect()
}

/// Every how many answers there is a point.
fn stride(answers: usize, entries: usize) -> usize {
    let points = MAX_POINTS * MAX_ENTRIES_OF_ALL_POINTS / entries.max(MAX_ENTRIES_OF_ALL_POINTS);
    let mut stride = 1;
    while answers / stride > points {
        stride *= 2;
    }
    stride
}

/// `None` if no gait could be recommended then.
fn point(
    snapshot: &StudySnapshot,
    learner: &mut Learner,
    answers: u32,
    rows: &[&FeedbackRow],
) -> Result<Option<UtilityPoint>, LearnerError> {
    let plan = &snapshot.study.plan;
    let mut log = FeedbackLog::default();
    let mut labelled = HashSet::new();
    for row in rows {
        if let FeedbackContent::Label { trial, .. } = row.content
            && let Some(trial) = snapshot.trial(trial)
        {
            log.visited.push(trial.action_index);
            labelled.insert(trial.id);
        }
        if row.retraction.is_none() {
            log.feedback.extend(snapshot.feedback_for_learner(&row.content));
        }
    }
    let posterior = learner.posterior(&plan.search_space, &log, &plan.learner)?;
    let gaits = snapshot.trials.iter().filter(|trial| {
        labelled.contains(&trial.id)
            && trial.state == TrialState::Converged
            && !snapshot.grounds.safety_reports.unsafe_motions.include(trial)
    });
    let Some(best) = highest(gaits, &posterior)? else { return Ok(None) };
    Ok(Some(UtilityPoint { answers, trial: best.id, utility: posterior.predict(best.action_index)? }))
}

/// The trial with the highest mean, the earliest of several, as the recommendation has it.
fn highest<'a>(
    trials: impl Iterator<Item = &'a Trial>,
    posterior: &Posterior,
) -> Result<Option<&'a Trial>, LearnerError> {
    let mut best: Option<(f64, &Trial)> = None;
    for trial in trials {
        let mean = posterior.mean(trial.action_index)?;
        if best.is_none_or(|(highest, _)| mean > highest) {
            best = Some((mean, trial));
        }
    }
    Ok(best.map(|(_, trial)| trial))
}

#[cfg(test)]
mod tests {
    use super::stride;

    #[test]
    fn longer_logs_have_fewer_points() {
        for (answers, entries, points) in
            [(60, 100, 60), (64, 200, 64), (65, 200, 32), (100, 400, 25), (1000, 1300, 7), (10_000, 10_400, 1)]
        {
            assert_eq!(answers / stride(answers, entries), points, "{answers} of {entries}");
        }
    }
}
