//! The pages of problem types, whose addresses are the `type` of problem documents.

use crate::page_error::{PageResult, page};
use crate::problem_kinds::{Entry, ProblemKind};
use askama::Template;
use axum::extract::Path;
use gaitwright_service::error::Error;

#[derive(Template)]
#[template(path = "problems.html")]
struct ProblemsPage {
    entries: Vec<Entry>,
    /// Whether the page shows one type or all of them.
    one: bool,
}

/// `GET /problems`.
pub(super) async fn list() -> PageResult {
    page(&ProblemsPage { entries: ProblemKind::ALL.map(ProblemKind::entry).to_vec(), one: false })
}

/// `GET /problems/{name}`.
pub(super) async fn get(Path(name): Path<String>) -> PageResult {
    let kind = ProblemKind::named(&name).ok_or(Error::NotFound { what: "problem type".to_owned(), id: name })?;
    page(&ProblemsPage { entries: vec![kind.entry()], one: true })
}
