//! Unblinding of a rater.

use crate::access::Caller;
use crate::error::Error;
use crate::printable;
use gaitwright_store::allocations::{self, PairWithSides};
use gaitwright_store::blind_pairs::{self, BlindPairKind, OrderedAnswer};
use gaitwright_store::{BlindPairId, Connection, Instant, StudyId, TrialId, Writer, audit, consents, studies};
use serde::Serialize;
use serde_json::json;
use utoipa::ToSchema;

/// Pair shown to a rater who has been unblinded, with the trial shown on each side.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct UnblindedPair {
    /// Identifier.
    pub id: BlindPairId,
    /// Identifier of the study.
    pub study_id: StudyId,
    /// Name of the rater.
    pub rater: String,
    /// Number of the pair for this rater in this study, from 1.
    pub number: u32,
    /// Why it was shown.
    pub kind: BlindPairKind,
    /// Trial shown first.
    pub shown_first: TrialId,
    /// Trial shown second.
    pub shown_second: TrialId,
    /// Earlier pair that it repeats. Null if it is not a repeat.
    pub repeats: Option<BlindPairId>,
    /// Whether the rater could have known the allocation.
    pub could_have_known: bool,
    /// Time at which the pair was drawn.
    pub created_at: Instant,
    /// Answer in terms of what was shown. Null if there is none yet.
    pub answer: Option<OrderedAnswer>,
    /// Time of the answer. Null if there is none yet.
    pub answered_at: Option<Instant>,
}

impl From<&PairWithSides> for UnblindedPair {
    fn from(sided: &PairWithSides) -> Self {
        let row = &sided.pair;
        let (shown_first, shown_second) = sided.shown();
        Self {
            id: row.id,
            study_id: row.study_id,
            rater: row.rater.clone(),
            number: row.number,
            kind: row.kind,
            shown_first,
            shown_second,
            repeats: row.repeats,
            could_have_known: row.could_have_known,
            created_at: row.created_at,
            answer: sided.answer(),
            answered_at: row.answered_at,
        }
    }
}

/// Unblinds a rater: the sides of all pairs can be read from now on ([`unblinded_pairs`]). Later answers of the rater do
/// not count as blind.
///
/// # Errors
/// [`Error::Invalid`] without a reason or for an unknown rater, [`Error::NotFound`], [`Error::Conflict`] if the sides
/// are not in this record.
pub async fn unblind(
    writer: &mut Writer,
    caller: &Caller,
    study: StudyId,
    rater: &str,
    reason: &str,
) -> Result<(), Error> {
    studies::get(writer, study).await?;
    consents::may_be_shown(writer, study).await?;
    let reason = printable::reason("reason", reason, " and say why the rater is unblinded")?;
    if !blind_pairs::of_study(writer, study).await?.iter().any(|shown| shown.rater == rater) {
        return Err(Error::invalid("rater", rater, "a rater who was shown a pair of this study"));
    }
    blind_pairs::unblind(writer, study, rater, caller.actor.as_str(), reason).await?;
    if allocations::page_of_unblinded_raters(writer, study, Some(rater), None, 1).await?.is_empty() {
        return Err(Error::conflict(
            "The archive of this study did not record which gait was on which side in this rater's pairs. \
             Unblind the rater on the system where the study was created.",
        ));
    }
    let detail = json!({ "rater": rater, "reason": reason });
    audit::append(writer, &caller.actor, "study.unblind_rater", &format!("study {study}"), &detail).await?;
    Ok(())
}

/// A page of the pairs of unblinded raters, in the order of the draws.
///
/// # Errors
/// [`Error::NotFound`]; errors of the database.
pub async fn unblinded_pairs(
    db: &mut Connection,
    study: StudyId,
    rater: Option<&str>,
    after: Option<BlindPairId>,
    limit: u32,
) -> Result<Vec<UnblindedPair>, Error> {
    studies::get(db, study).await?;
    let pairs = allocations::page_of_unblinded_raters(db, study, rater, after, limit).await?;
    Ok(pairs.iter().map(UnblindedPair::from).collect())
}
