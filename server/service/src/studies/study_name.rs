//! Names of studies, which differ among the studies that a caller can see. Studies out of reach do not count, because a refused
//! name would reveal them; so no index of the record can keep names unique.

use crate::access::Reach;
use crate::error::{Error, FieldError};
use crate::printable::{self, compared};
use gaitwright_store::studies::AtlasRole;
use gaitwright_store::{Connection, StudyId, studies};
use std::collections::BTreeSet;

/// Maximum length of a name, characters.
pub(super) const MAX_LENGTH: usize = 120;

/// The compared names of all studies in reach except this one.
async fn taken(db: &mut Connection, reach: Reach, except: Option<StudyId>) -> Result<BTreeSet<String>, Error> {
    Ok(studies::names(db, reach, except).await?.iter().map(|name| compared(name)).collect())
}

/// A name that no study in reach has: this one, or with a number after it.
///
/// # Errors
/// Errors of the database.
pub(super) async fn free(db: &mut Connection, reach: Reach, name: &str) -> Result<String, Error> {
    Ok(free_of(&taken(db, reach, None).await?, name))
}

fn free_of(taken: &BTreeSet<String>, name: &str) -> String {
    let mut free = name.to_owned();
    let mut number = 2_u32;
    while taken.contains(&compared(&free)) {
        free = marked(name, &format!(" ({number})"));
        number += 1;
    }
    free
}

/// The name of a study for which nobody chose one, if it is free.
pub(super) fn by_default(pseudonym: &str, muscles: bool, seed: u64, atlas: AtlasRole) -> String {
    let variant = if muscles { "with muscles" } else { "without muscles" };
    match atlas {
        AtlasRole::Make => format!("Atlas of {pseudonym}, {variant}"),
        AtlasRole::None | AtlasRole::Use => format!("{pseudonym}, {variant}, seed {seed}"),
    }
}

/// A name with a mark at its end, shortened if it would be too long.
pub(super) fn marked(name: &str, mark: &str) -> String {
    let kept: String = name.chars().take(MAX_LENGTH - mark.len()).collect();
    format!("{}{mark}", kept.trim_end())
}

/// Checks the name that a person chose for a study; `study` has it already if it is renamed.
///
/// # Errors
/// [`Error::Invalid`] if it does not print or another study in reach has it.
pub(super) async fn checked(
    db: &mut Connection,
    reach: Reach,
    name: &str,
    study: Option<StudyId>,
) -> Result<String, Error> {
    let name = printable::name("name", name.trim(), MAX_LENGTH)?;
    let taken = taken(db, reach, study).await?;
    let free = free_of(&taken, name);
    if free == name {
        return Ok(free);
    }
    let message = format!(
        "Another study is named \u{201c}{name}\u{201d}; capitals and spaces make no difference. Choose another name, for \
         example \u{201c}{free}\u{201d}."
    );
    Err(FieldError::in_words("name", &message).into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn free_name_differs_by_more_than_capitals_and_spaces() {
        let taken = ["Sample study", "ÉTUDE (2)"].map(compared).into();
        assert_eq!(free_of(&taken, "sample  STUDY"), "sample  STUDY (2)");
        assert_eq!(free_of(&taken, "étude"), "étude");
        assert_eq!(free_of(&taken, "étude (2)"), "étude (2) (2)");
        let long = "x".repeat(MAX_LENGTH);
        assert_eq!(free_of(&[long.clone()].into(), &long).chars().count(), MAX_LENGTH);
    }
}
