//! The answers of people on the study page.

use crate::format;
use gaitwright_service::studies::reported_gait::{ReportedGait, SafetyReportSource};
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::assessments::{Assessment, AssessmentAnswer};
use gaitwright_store::feedback::{FeedbackContent, FeedbackRow, Retraction, Source};
use gaitwright_store::{AnswerId, Instant};
use std::cmp::Reverse;

/// An answer.
pub(crate) struct AnswerRow {
    pub(crate) text: String,
    /// Source and author.
    pub(crate) by: String,
    pub(crate) note: String,
    /// Why it no longer counts.
    pub(crate) undone: Option<String>,
    /// `change` of the comparison page that can change it.
    pub(crate) saved: Option<AnswerId>,
    /// Whether it counts again because a change to it was undone.
    pub(crate) restored: bool,
    pub(crate) at: Instant,
}

/// Answers of users and subjects, newest first. Those of Gait RMSE follow from the table of trials.
pub(crate) fn answers(snapshot: &StudySnapshot, assessments: &[Assessment]) -> Vec<AnswerRow> {
    let of_assessment = |id| assessments.iter().any(|assessment| assessment.feedback_id == Some(id));
    let by_people = |row: &&FeedbackRow| !matches!(row.source, Source::GaitRmse | Source::Evaluation);
    let why = |retraction: &Option<Retraction>| Some(format!("retracted: {}", retraction.as_ref()?.reason));
    let cleared = |id| {
        let of_it = |report: &&ReportedGait| report.source == SafetyReportSource::Staff(id);
        let review = snapshot.grounds.safety_reports.cleared.iter().find(of_it)?.review.as_ref()?;
        Some(format!("cleared for walking by {}: {}", review.author, review.reason))
    };
    let preference = |row: &FeedbackRow| {
        Some(AnswerRow {
            text: answer_in_words(row, snapshot)?,
            by: format!("{}, {}", format::source(row), row.author),
            note: row.note.clone(),
            undone: why(&row.retraction),
            saved: (row.retraction.is_none() && !row.by_rater).then(|| row.id.into()),
            restored: row.restores.is_some(),
            at: row.created_at,
        })
    };
    let assessment = |assessment: &Assessment| {
        Some(AnswerRow {
            text: assessment_in_words(assessment, snapshot)?,
            by: format!("{}, {}", format::source_name(assessment.source), assessment.author),
            note: assessment.note.clone(),
            undone: why(&assessment.retraction).or_else(|| cleared(assessment.id)),
            saved: (assessment.retraction.is_none() && !assessment.answer.is_about_safety())
                .then(|| assessment.id.into()),
            restored: assessment.restores.is_some(),
            at: assessment.created_at,
        })
    };
    let preferences = snapshot.feedback.iter().filter(by_people).filter(|row| !of_assessment(row.id));
    let mut rows: Vec<AnswerRow> =
        preferences.filter_map(preference).chain(assessments.iter().filter_map(assessment)).collect();
    rows.reverse();
    rows.sort_by_key(|row| Reverse(row.at));
    rows
}

/// `trial 3 is better than trial 2`.
pub(crate) fn answer_in_words(row: &FeedbackRow, snapshot: &StudySnapshot) -> Option<String> {
    let name = |id| snapshot.trial(id).map(|trial| format!("trial {}", trial.number));
    match row.content {
        FeedbackContent::Preference { winner, loser } => {
            Some(format!("{} is better than {}", name(winner)?, name(loser)?))
        }
        FeedbackContent::NoDifference { a, b } => Some(format!("no difference between {} and {}", name(a)?, name(b)?)),
        FeedbackContent::Label { .. } | FeedbackContent::Suggestion { .. } => None,
    }
}

/// `trial 3 was reported as unsafe`.
pub(crate) fn assessment_in_words(assessment: &Assessment, snapshot: &StudySnapshot) -> Option<String> {
    let name = |id| snapshot.trial(id).map(|trial| format!("trial {}", trial.number));
    let (a, b) = (name(assessment.trial_a)?, name(assessment.trial_b)?);
    Some(match assessment.answer {
        AssessmentAnswer::UnsafeA => format!("{a} was reported as unsafe (in the comparison with {b})"),
        AssessmentAnswer::UnsafeB => format!("{b} was reported as unsafe (in the comparison with {a})"),
        AssessmentAnswer::UnsafeBoth => format!("{a} and {b} were reported as unsafe"),
        AssessmentAnswer::CannotTell => format!("cannot tell whether {a} or {b} is better"),
    })
}
