//! The words of the pages. The list is the template: it says nothing that depends on a record.

use super::error::{Page, page};
use crate::access::{Caller, Role};
use crate::http::identify::AnsweredTo;
use askama::Template;
use axum::Extension;

#[derive(Template)]
#[template(path = "glossary.html")]
struct Glossary {
    /// Whom it is shown to: nobody has no navigation, a rater has one of its own.
    to: Option<AnsweredTo>,
}

/// `GET /glossary`.
pub(super) async fn get(caller: Option<Extension<Caller>>) -> Page {
    page(&Glossary { to: caller.map(|Extension(caller)| AnsweredTo(caller.role)) })
}
