//! Checks in an imported archive which answers replace others, and which were brought back by undo.

use super::super::archive_file::refuse;
use crate::error::Error;
use crate::studies::recorded_answer::RecordedAnswer;
use gaitwright_store::AnswerId;
use gaitwright_store::assessments::Assessment;
use gaitwright_store::feedback::FeedbackRow;
use std::collections::HashMap;

/// Checks that an answer replaces one that no longer counts, and brings back exactly what an undone answer had replaced.
pub(super) fn answer_changes(rows: &[FeedbackRow], assessments: &[Assessment]) -> Result<(), Error> {
    let preferences = rows.iter().cloned().map(RecordedAnswer::Preference);
    let answers: Vec<RecordedAnswer> =
        preferences.chain(assessments.iter().cloned().map(RecordedAnswer::Assessment)).collect();
    let by_id: HashMap<AnswerId, &RecordedAnswer> = answers.iter().map(|answer| (answer.id(), answer)).collect();
    let mut replacements: HashMap<AnswerId, &RecordedAnswer> = HashMap::new();
    for answer in &answers {
        let Some(replaced) = answer.replaces() else { continue };
        let fault = |fault: &str| refuse(format!("answer {} {fault}", answer.id()));
        let known = by_id.get(&replaced).filter(|known| known.pair().is_some() && known.pair() == answer.pair());
        let known =
            known.ok_or_else(|| fault("replaces an answer that is missing or not about the same two trials"))?;
        if known.is_computed() || known.is_by_rater() || known.is_safety_report() {
            return Err(fault("replaces an answer that nobody can change"));
        }
        if known.retraction().is_none() {
            return Err(fault("replaces an answer that still counts"));
        }
        if replacements.insert(replaced, answer).is_some() {
            return Err(fault("replaces an answer that was replaced before"));
        }
    }
    for answer in &answers {
        let Some(original) = answer.restores() else { continue };
        let fault = |fault: &str| refuse(format!("answer {} {fault}", answer.id()));
        let is_undone = replacements.get(&original).is_some_and(|newer| newer.retraction().is_some());
        if !is_undone {
            return Err(fault("brings back an answer whose change was not undone"));
        }
        if !by_id.get(&original).is_some_and(|original| answer.is_copy_of(original)) {
            return Err(fault("differs from the answer that it brings back"));
        }
    }
    Ok(())
}
