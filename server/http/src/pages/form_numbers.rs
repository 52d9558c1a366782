//! Numbers, lists of numbers and file names in forms for measurement files.

use gaitwright_service::error::Error;
use std::str::FromStr;

/// A type of number with its name in errors.
pub(super) trait NamedNumber: FromStr {
    const NAME: &'static str;
}

impl NamedNumber for f64 {
    const NAME: &'static str = "a number";
}

impl NamedNumber for u32 {
    const NAME: &'static str = "a whole number of at least 0";
}

impl NamedNumber for usize {
    const NAME: &'static str = "a whole number of at least 0";
}

pub(super) fn list<T: NamedNumber>(field: &str, text: &str) -> Result<Vec<T>, Error> {
    text.split(',').filter(|part| !part.trim().is_empty()).map(|part| number(field, part)).collect()
}

pub(super) fn number<T: NamedNumber>(field: &str, text: &str) -> Result<T, Error> {
    text.trim().parse().map_err(|_| Error::invalid(field, text, T::NAME))
}

pub(super) fn optional(field: &str, text: &str) -> Result<Option<f64>, Error> {
    if text.trim().is_empty() { Ok(None) } else { number(field, text).map(Some) }
}

/// A text that is not empty.
pub(super) fn given(text: &str) -> Option<String> {
    Some(text.trim().to_owned()).filter(|text| !text.is_empty())
}

/// The name of a file, without the folders that some browsers add.
pub(super) fn file_name(text: &str) -> Option<String> {
    given(text.rsplit(['/', '\\']).next().unwrap_or_default())
}
