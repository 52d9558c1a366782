//! Records that a subject consents, or withdraws consent, which stops every study of the subject.

use super::command;
use crate::error::Error;
use crate::printable;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::consents::{self, Consent, ConsentKind};
use gaitwright_store::{SubjectId, TrialId, Writer, studies, subjects};
use serde::Deserialize;
use serde_json::json;
use utoipa::ToSchema;

/// A consent that a subject signed.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewConsent {
    /// Name and version of the consent form.
    #[schema(min_length = 1, max_length = 2000)]
    pub form: String,
}

/// A withdrawal of consent.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ConsentWithdrawal {
    /// Reason, 1 to 2000 characters, or `none given` if the subject gave none.
    #[schema(min_length = 1, max_length = 2000)]
    pub reason: String,
}

/// Records a consent.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Invalid`] naming the field.
pub async fn give(writer: &mut Writer, actor: &Actor, id: SubjectId, new: &NewConsent) -> Result<Consent, Error> {
    let form = printable::reason("form", &new.form, "")?;
    subjects::get(writer, id).await?;
    let row = consents::append(writer, id, ConsentKind::Given, form, actor).await?;
    audit::append(writer, actor, "subject.consent", &format!("subject {id}"), &json!({ "form": form })).await?;
    Ok(row)
}

/// Records that a subject withdrew consent, and stops the subject's studies. Returns the cancelled trials too: their
/// solves must be stopped once this is durable.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Invalid`] naming the field, [`Error::Conflict`] if consent was already withdrawn.
pub async fn withdraw(
    writer: &mut Writer,
    actor: &Actor,
    id: SubjectId,
    why: &ConsentWithdrawal,
) -> Result<(Consent, Vec<TrialId>), Error> {
    let reason = printable::reason("reason", &why.reason, "")?;
    subjects::get(writer, id).await?;
    let before = consents::of_subject(writer, id).await?;
    if before.last().is_some_and(|last| last.kind == ConsentKind::Withdrawn) {
        return Err(Error::conflict("This subject has already withdrawn consent."));
    }
    let (mut stopped, mut cancelled) = (Vec::new(), Vec::new());
    for study in studies::open_of(writer, id).await? {
        cancelled.extend(command::stop(writer, &study, "The subject withdrew consent.").await?);
        stopped.push(study.id);
    }
    let row = consents::append(writer, id, ConsentKind::Withdrawn, reason, actor).await?;
    let detail = json!({ "reason": reason, "stopped": stopped });
    audit::append(writer, actor, "subject.withdraw", &format!("subject {id}"), &detail).await?;
    Ok((row, cancelled))
}
