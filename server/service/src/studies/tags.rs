//! The rules for the tags of a study.

use crate::error::{Error, FieldError};
use crate::printable;

/// Largest number of tags of a study, and of characters of a tag.
const MAX_TAGS: usize = 10;
const MAX_TAG: usize = 40;

/// Checks tags: trimmed, without repetitions, in alphabetical order.
///
/// # Errors
/// [`Error::Invalid`] naming the field.
pub(super) fn checked_tags(tags: &[String]) -> Result<Vec<String>, Error> {
    if tags.len() > MAX_TAGS {
        return Err(FieldError::described(
            "tags",
            &format!("a list of {} tags", tags.len()),
            "a list of at most 10 tags",
        )
        .into());
    }
    let mut checked = Vec::new();
    for tag in tags {
        let tag = printable::name("tags", tag, MAX_TAG)?;
        if tag.contains(',') {
            return Err(Error::invalid("tags", tag, "a tag without commas, because commas separate tags"));
        }
        checked.push(tag.to_owned());
    }
    checked.sort();
    checked.dedup();
    Ok(checked)
}
