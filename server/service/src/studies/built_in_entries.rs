//! The built-in entries of a new record: the subjects from the paper, the device and the reference gaits.

use crate::error::Error;
use gait_optimizer as optimizer;
use gaitwright_store::devices::DeviceRow;
use gaitwright_store::reference_gaits::ReferenceGaitRow;
use gaitwright_store::subjects::SubjectRow;
use gaitwright_store::{Connection, devices, reference_gaits, subjects};

/// Pseudonyms of the paper's subjects.
const PAPER: [(u32, &str, &str); 2] = [
    (1, "paper-1", "First subject from the paper: female, 1.727 m, 65.7 kg."),
    (2, "paper-2", "Second subject from the paper: male, 1.803 m, 75 kg."),
];

/// The built-in device of the record.
///
/// # Errors
/// Errors of the database.
pub async fn device(db: &mut Connection) -> Result<DeviceRow, Error> {
    Ok(devices::ensure(db, &optimizer::Device::ampro3()?).await?.0)
}

/// The default reference gait of the record.
///
/// # Errors
/// Errors of the database.
pub async fn reference_gait(db: &mut Connection) -> Result<ReferenceGaitRow, Error> {
    Ok(reference_gaits::ensure(db, &optimizer::ReferenceGait::builtin()?).await?.0)
}

/// Adds the built-in entries that are missing.
///
/// # Errors
/// Errors of the database.
pub async fn ensure(db: &mut Connection) -> Result<(), Error> {
    device(db).await?;
    // The default one last, so that lists of a new record begin with it.
    for (_, definition) in optimizer::ReferenceGait::all_builtin()?.iter().rev() {
        reference_gaits::ensure(db, definition).await?;
    }
    for (number, pseudonym, notes) in PAPER {
        if subjects::by_pseudonym(db, pseudonym).await?.is_none() {
            subjects::insert(db, pseudonym, optimizer::Subject::builtin(number)?, notes).await?;
        }
    }
    Ok(())
}

/// Whether a subject is as [`ensure`] adds it.
pub fn is_built_in(pseudonym: &str, body: optimizer::Subject, notes: &str) -> bool {
    PAPER.iter().any(|&(number, name, text)| {
        name == pseudonym && text == notes && optimizer::Subject::builtin(number).is_ok_and(|known| known == body)
    })
}

/// The subject of the record with this height and mass: one of the paper's, or one named by height and mass.
///
/// # Errors
/// Errors of the database.
pub async fn subject_with(db: &mut Connection, body: optimizer::Subject) -> Result<SubjectRow, Error> {
    let paper = PAPER.iter().find(|(number, ..)| optimizer::Subject::builtin(*number).is_ok_and(|known| known == body));
    let pseudonym = match paper {
        Some((_, name, _)) => (*name).to_owned(),
        None => format!("{} m {} kg", body.height_m, body.body_mass_kg),
    };
    match subjects::by_pseudonym(db, &pseudonym).await? {
        Some(found) => Ok(found),
        None => Ok(subjects::insert(db, &pseudonym, body, "").await?),
    }
}
