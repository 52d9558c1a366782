//! The confirmation of a saved form: `?saved=true` in the address that a form leads to.

use serde::Deserialize;

/// Whether a form was saved just now.
#[derive(Debug, Deserialize)]
pub(super) struct Saved {
    #[serde(default)]
    pub(super) saved: bool,
}

/// The address of a page that confirms the saved form.
pub(super) fn confirmed(page: &str) -> String {
    format!("{page}?saved=true")
}
