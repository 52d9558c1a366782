//! Staff look at a gait that was called unsafe, and decide: one way in for the form and the REST interface.

use super::safety_reports::{Closed, SafetyReportSource, SafetyReports};
use crate::access::Caller;
use crate::error::Error;
use crate::printable;
use gaitwright_store::safety_reviews::{self, NewSafetyReview, SafetyReview, SafetyVerdict};
use gaitwright_store::{
    Connection, FeedbackId, Instant, StoreResult, TrialId, Writer, audit, consents, events, feedback, presentations,
    remarks, trials,
};
use serde::Deserialize;
use serde_json::json;
use utoipa::ToSchema;

/// A decision.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = SafetyReviewToMake)]
pub struct Decision {
    /// `walkable`: the gait may be walked with again. `unsafe`: it stays as it is, and waits for nobody's look any more.
    pub verdict: SafetyVerdict,
    /// Why, for the record.
    #[schema(min_length = 1, max_length = 2000)]
    pub reason: String,
    /// Name or pseudonym of who decides; by default the name of the caller.
    #[serde(default)]
    #[schema(min_length = 1, max_length = 80)]
    pub author: Option<String>,
    /// When the newest safety report was made that the caller has seen: after a newer one the decision is refused. By default
    /// every safety report counts as seen.
    #[serde(default)]
    pub said_until: Option<Instant>,
}

/// Writes a decision. Where the gait may be walked with again, what the learner heard of the safety reports is taken back.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Invalid`] naming the field, [`Error::Conflict`] when nobody calls the gait unsafe, when
/// somebody did so later than the caller has seen, and of a subject who withdrew.
pub async fn give(
    writer: &mut Writer,
    caller: &Caller,
    id: TrialId,
    decision: &Decision,
) -> Result<SafetyReview, Error> {
    let trial = trials::get(writer, id).await?;
    consents::may_be_shown(writer, trial.study_id).await?;
    let author = printable::name("author", decision.author.as_deref().unwrap_or(&caller.name), 80)?;
    let reason = printable::reason("reason", &decision.reason, ": why it is decided so")?;
    let closed = SafetyReports::read(writer, trial.study_id).await?.closing(id);
    let number = trial.number;
    let newest = closed.iter().max_by_key(|closed| closed.at);
    let newest =
        newest.ok_or_else(|| Error::conflict(format!("nobody calls the gait of trial {number} unsafe now")))?;
    if decision.said_until.is_some_and(|seen| newest.at > seen) {
        let again = format!("the gait of trial {number} was called unsafe again, by {}: look at that first", newest.by);
        return Err(Error::conflict(again));
    }
    let verdict = decision.verdict;
    let new = NewSafetyReview { trial: id, said_until: newest.at, verdict, author, reason };
    let made = safety_reviews::insert(writer, new).await?;
    if verdict == SafetyVerdict::Walkable {
        take_back_what_was_heard(writer, &closed, (author, reason)).await?;
    }
    let payload = json!({ "trial_id": id, "number": number, "verdict": verdict });
    events::append(writer, trial.study_id, "safety_reviewed", &payload).await?;
    let said: Vec<_> = closed.iter().map(|closed| json!({ "by": closed.by, "at": closed.at })).collect();
    let detail = json!({
        "study": trial.study_id, "verdict": verdict, "author": author, "reason": reason, "safety_reports": said,
    });
    audit::append(writer, &caller.actor, "gait.review", &format!("trial {id}"), &detail).await?;
    Ok(safety_reviews::get(writer, made).await?)
}

/// That a gait is unsafe was heard as "the other one is better": nobody said that.
async fn take_back_what_was_heard(
    writer: &mut Writer,
    closed: &[Closed],
    (author, reason): (&str, &str),
) -> StoreResult<()> {
    for closed in closed {
        if let Some(id) = heard_of(writer, closed.said).await? {
            let row = feedback::get(writer, id).await?;
            feedback::retract(writer, &row, author, reason).await?;
        }
    }
    Ok(())
}

async fn heard_of(db: &mut Connection, said: SafetyReportSource) -> StoreResult<Option<FeedbackId>> {
    match said {
        SafetyReportSource::Rater(id) => presentations::heard_of(db, id).await,
        SafetyReportSource::Staff(id) => Ok(remarks::get(db, id).await?.feedback_id),
        // It reaches the learner at unblinding.
        SafetyReportSource::Subject => Ok(None),
    }
}
