//! Records the decision of staff about a gait that was reported as unsafe, for pages and REST.

use super::reported_gait::{ReportedGait, SafetyReportSource};
use super::safety_reports::SafetyReports;
use crate::access::Caller;
use crate::error::Error;
use crate::printable;
use gaitwright_store::safety_reviews::{self, NewSafetyReview, SafetyDecision, SafetyReview};
use gaitwright_store::{
    Connection, FeedbackId, SafetyReportId, StoreResult, TrialId, Writer, assessments, audit, blind_pairs, consents,
    events, feedback, trials,
};
use serde::Deserialize;
use serde_json::json;
use utoipa::ToSchema;

/// A decision about the safety reports of a gait.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewSafetyReview)]
pub struct Decision {
    /// `cleared`: the gait is cleared for walking. `unsafe`: the gait remains marked as unsafe, and the review is
    /// complete.
    pub decision: SafetyDecision,
    /// Reason, 1 to 2000 characters.
    #[schema(min_length = 1, max_length = 2000)]
    pub reason: String,
    /// Name or pseudonym of the reviewer. Defaults to the caller's name.
    #[serde(default)]
    #[schema(min_length = 1, max_length = 80)]
    pub author: Option<String>,
    /// The safety reports in force that the reviewer has seen. The decision is refused if a report in force is not
    /// listed. By default, all of them count as seen.
    #[serde(default)]
    pub reports: Option<Vec<SafetyReportId>>,
}

/// Records a decision. If the gait is cleared for walking, retracts the preferences that the learner derived from the
/// reports.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Invalid`] naming the field, [`Error::Conflict`] if no report is open, if there is a
/// newer report than the reviewer has seen, or if the subject withdrew consent.
pub async fn give(
    writer: &mut Writer,
    caller: &Caller,
    id: TrialId,
    decision: &Decision,
) -> Result<SafetyReview, Error> {
    let trial = trials::get(writer, id).await?;
    consents::may_be_shown(writer, trial.study_id).await?;
    let author = printable::name("author", decision.author.as_deref().unwrap_or(&caller.name), 80)?;
    let reason = printable::reason("reason", &decision.reason, " and explain the decision")?;
    let reports = SafetyReports::read(writer, trial.study_id).await?;
    let in_force = reports.in_force_about(id);
    let number = trial.number;
    if in_force.is_empty() {
        let elsewhere = reports.unsafe_motions.about(&trial).and_then(|report| report.other_trial(&trial));
        return Err(Error::conflict(match elsewhere {
            Some(other) => {
                format!("The gait of trial {number} was reported as unsafe in {other}. Review the report there.")
            }
            None => format!("The gait of trial {number} has no safety report in force."),
        }));
    }
    let unseen = |report: &&ReportedGait| decision.reports.as_ref().is_some_and(|seen| !seen.contains(&report.id()));
    if let Some(unseen) = in_force.iter().rfind(unseen) {
        let other = format!(
            "The gait of trial {number} has a safety report by {} that is not among the reports of this review. Read it first.",
            unseen.by
        );
        return Err(Error::conflict(other));
    }
    let taken = decision.decision;
    let decided: Vec<SafetyReportId> = in_force.iter().map(ReportedGait::id).collect();
    let new = NewSafetyReview { trial: id, reports: &decided, decision: taken, author, reason };
    let made = safety_reviews::insert(writer, new).await?;
    if taken == SafetyDecision::Cleared {
        retract_derived_preferences(writer, &in_force, (author, reason)).await?;
    }
    let payload = json!({ "trial_id": id, "number": number, "decision": taken });
    events::append(writer, trial.study_id, "safety_reviewed", &payload).await?;
    let reports: Vec<_> = in_force.iter().map(|report| json!({ "by": report.by, "at": report.at })).collect();
    let detail = json!({
        "study": trial.study_id, "decision": taken, "author": author, "reason": reason, "safety_reports": reports,
    });
    audit::append(writer, &caller.actor, "gait.review", &format!("trial {id}"), &detail).await?;
    Ok(safety_reviews::get(writer, made).await?)
}

/// Retracts the preferences that were derived from safety reports, because nobody stated them.
async fn retract_derived_preferences(
    writer: &mut Writer,
    reports: &[ReportedGait],
    (author, reason): (&str, &str),
) -> StoreResult<()> {
    for report in reports {
        if let Some(id) = derived_preference(writer, report.source).await? {
            let row = feedback::get(writer, id).await?;
            feedback::retract(writer, &row, author, reason).await?;
        }
    }
    Ok(())
}

async fn derived_preference(db: &mut Connection, source: SafetyReportSource) -> StoreResult<Option<FeedbackId>> {
    match source {
        SafetyReportSource::Rater(id) => blind_pairs::feedback_of(db, id).await,
        SafetyReportSource::Staff(id) => Ok(assessments::get(db, id).await?.feedback_id),
        // The learner receives the answer of a subject only at unblinding, and does not receive reports about one gait.
        SafetyReportSource::Subject(_) | SafetyReportSource::Alone(_) => Ok(None),
    }
}
