//! Adds and corrects subjects, and records their muscle measurements. For pages and REST.

use crate::error::Error;
use crate::printable;
use gait_optimizer::Subject as Body;
use gait_optimizer::muscle::MuscleParameters;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::subjects::{self, Correction, PSEUDONYM_UNIQUE, SubjectRow};
use gaitwright_store::{Connection, OnConstraint, SubjectId, Writer};
use serde::Deserialize;
use serde_json::json;
use utoipa::ToSchema;

/// A subject to add.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewSubject {
    /// Pseudonym assigned by the site, never a name.
    #[schema(min_length = 1, max_length = 40)]
    pub pseudonym: String,
    /// Body height, m.
    #[schema(minimum = 1.4, maximum = 2.2)]
    pub height_m: f64,
    /// Body mass, kg.
    #[schema(minimum = 35, maximum = 160)]
    pub body_mass_kg: f64,
    /// Free text.
    #[serde(default)]
    #[schema(max_length = 4000)]
    pub notes: String,
}

/// Checks the data of a subject.
///
/// # Errors
/// [`Error::Invalid`] naming the field.
pub(super) fn check(pseudonym: &str, height_m: f64, body_mass_kg: f64, notes: &str) -> Result<Body, Error> {
    check_pseudonym(pseudonym)?;
    let body = Body::new(height_m, body_mass_kg)?;
    printable::note("notes", notes, 4000)?;
    Ok(body)
}

/// Adds a subject.
///
/// # Errors
/// [`Error::Invalid`] naming the field, [`Error::Conflict`] if the pseudonym is taken.
pub async fn add(writer: &mut Writer, actor: &Actor, new: &NewSubject) -> Result<SubjectRow, Error> {
    let pseudonym = new.pseudonym.trim();
    let body = checked(writer, new).await?;
    let subject = subjects::insert(writer, pseudonym, body, &new.notes)
        .await
        .on_constraint(PSEUDONYM_UNIQUE, || is_taken(pseudonym))?;
    let detail = json!({ "pseudonym": pseudonym, "height_m": body.height_m, "body_mass_kg": body.body_mass_kg });
    audit::append(writer, actor, "subject.add", &format!("subject {}", subject.id), &detail).await?;
    Ok(subject)
}

/// Checks a subject as [`add`] does, without adding it.
///
/// # Errors
/// As [`add`].
pub async fn checked(db: &mut Connection, new: &NewSubject) -> Result<Body, Error> {
    let pseudonym = new.pseudonym.trim();
    let body = check(pseudonym, new.height_m, new.body_mass_kg, &new.notes)?;
    match subjects::by_pseudonym(db, pseudonym).await? {
        Some(_) => Err(is_taken(pseudonym)),
        None => Ok(body),
    }
}

fn is_taken(pseudonym: &str) -> Error {
    Error::conflict(format!("A subject with the pseudonym {pseudonym:?} already exists. Choose another pseudonym."))
}

/// A correction of height and mass.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewCorrection {
    /// Body height, m.
    #[schema(minimum = 1.4, maximum = 2.2)]
    pub height_m: f64,
    /// Body mass, kg.
    #[schema(minimum = 35, maximum = 160)]
    pub body_mass_kg: f64,
    /// Reason for the correction.
    #[schema(min_length = 1, max_length = 2000, pattern = "\\S")]
    pub reason: String,
}

/// Corrects height and mass of a subject. New studies use them; existing studies keep the old values.
///
/// # Errors
/// [`Error::Invalid`] naming the field, [`Error::NotFound`], [`Error::Conflict`] if nothing would change or the subject
/// withdrew consent.
pub async fn correct(
    writer: &mut Writer,
    actor: &Actor,
    id: SubjectId,
    new: &NewCorrection,
) -> Result<Correction, Error> {
    let before = subjects::get(writer, id).await?.body();
    let body = check_correction(new)?;
    if body == before {
        return Err(Error::conflict("Height and mass already have these values."));
    }
    let reason = new.reason.trim();
    let correction = subjects::correct(writer, actor, id, body, reason).await?;
    let detail = json!({
        "height_m": body.height_m, "body_mass_kg": body.body_mass_kg, "reason": reason,
        "before": { "height_m": before.height_m, "body_mass_kg": before.body_mass_kg },
    });
    audit::append(writer, actor, "subject.correct", &format!("subject {id}"), &detail).await?;
    Ok(correction)
}

/// Checks the fields of a correction, without the record.
///
/// # Errors
/// [`Error::Invalid`] naming the field.
pub fn check_correction(new: &NewCorrection) -> Result<Body, Error> {
    let body = Body::new(new.height_m, new.body_mass_kg)?;
    printable::reason("reason", &new.reason, " and say why the values are corrected")?;
    Ok(body)
}

/// Records measured muscle values that override the default ones. New studies use them.
///
/// # Errors
/// [`Error::Invalid`] naming the field, [`Error::NotFound`], [`Error::Conflict`] if the subject withdrew
/// consent.
pub async fn set_muscles(
    writer: &mut Writer,
    actor: &Actor,
    id: SubjectId,
    muscles: &MuscleParameters,
) -> Result<(), Error> {
    subjects::get(writer, id).await?;
    muscles.validate()?;
    subjects::set_muscles(writer, actor, id, muscles).await?;
    audit::append(writer, actor, "subject.muscles", &format!("subject {id}"), &json!({ "muscles": muscles })).await?;
    Ok(())
}

/// Whether a character is visible and unambiguous. Control characters, joiners, direction overrides and blank letters
/// could make two pseudonyms look alike.
fn is_visible(c: char) -> bool {
    const INVISIBLE_LETTERS: [char; 4] = ['\u{115f}', '\u{1160}', '\u{3164}', '\u{ffa0}'];
    (c.is_alphanumeric() && !INVISIBLE_LETTERS.contains(&c)) || " -_.:/#+()".contains(c)
}

/// Refuses a pseudonym that may be an e-mail address, a number of a person or a date of birth.
fn check_pseudonym(pseudonym: &str) -> Result<(), Error> {
    let refuse = |allowed| Err(Error::invalid("pseudonym", pseudonym, allowed));
    if pseudonym.is_empty() || pseudonym.chars().count() > 40 {
        return refuse("1 to 40 characters long");
    }
    let digits = pseudonym.chars().filter(|c| c.is_numeric()).count();
    if pseudonym.contains('@') || digits > 5 {
        return refuse("a code assigned by the site, such as S01, not an address, a date or a long number");
    }
    if !pseudonym.chars().all(is_visible) {
        return refuse("made of letters, digits, spaces and the characters - _ . : / # + ( )");
    }
    Ok(())
}
