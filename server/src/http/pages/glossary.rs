//! The words of the pages. The list is the template: it says nothing that depends on a record.

use super::error::{Page, page};
use askama::Template;

#[derive(Template)]
#[template(path = "glossary.html")]
struct Glossary;

/// `GET /glossary`.
pub(super) async fn get() -> Page {
    page(&Glossary)
}
