//! Subjects, corrections and consents.

use gaitwright_store::consents::{self, ConsentKind};
use gaitwright_store::{Instant, SubjectId, subjects};
use serde::Serialize;
use utoipa::ToSchema;

/// Subject, known by a pseudonym only.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Subject {
    /// Identifier.
    id: SubjectId,
    /// Unique pseudonym assigned by the site.
    pseudonym: String,
    /// Body height, m.
    height_m: f64,
    /// Body mass, kg.
    body_mass_kg: f64,
    /// Free text.
    notes: String,
    /// Time of creation.
    created_at: Instant,
}

impl From<subjects::SubjectRow> for Subject {
    fn from(row: subjects::SubjectRow) -> Self {
        let subjects::SubjectRow { id, pseudonym, height_m, body_mass_kg, notes, created_at } = row;
        Self { id, pseudonym, height_m, body_mass_kg, notes, created_at }
    }
}

/// Correction of height and mass.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Correction {
    /// Sequence number.
    seq: i64,
    /// Body height before the correction, m.
    previous_height_m: f64,
    /// Body mass before the correction, kg.
    previous_body_mass_kg: f64,
    /// Corrected body height, m.
    height_m: f64,
    /// Corrected body mass, kg.
    body_mass_kg: f64,
    /// Reason for the correction.
    reason: String,
    /// Actor of the correction.
    actor: String,
    /// Time of the correction.
    created_at: Instant,
}

impl From<subjects::Correction> for Correction {
    fn from(row: subjects::Correction) -> Self {
        let subjects::Correction { seq, former, height_m, body_mass_kg, reason, actor, created_at } = row;
        let (previous_height_m, previous_body_mass_kg) = (former.height_m, former.body_mass_kg);
        Self { seq, previous_height_m, previous_body_mass_kg, height_m, body_mass_kg, reason, actor, created_at }
    }
}

/// A subject's consent, or withdrawal of consent. The newest entry applies.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Consent {
    /// Sequence number.
    seq: i64,
    /// Consent or withdrawal.
    kind: ConsentKind,
    /// For consent, the name and version of the signed form. For a withdrawal, the reason, or `none given`.
    note: String,
    /// Actor who recorded it.
    actor: String,
    /// Time of recording.
    created_at: Instant,
}

impl From<consents::Consent> for Consent {
    fn from(row: consents::Consent) -> Self {
        let consents::Consent { seq, kind, note, actor, created_at } = row;
        Self { seq, kind, note, actor, created_at }
    }
}
