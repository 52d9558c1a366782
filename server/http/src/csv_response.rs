//! Responses that are CSV files.

use crate::AppState;
use crate::attachment::attachment;
use crate::problem_details::Refusal;
use axum::response::Response;
use gaitwright_charts::csv_table::CsvTable;

/// A table as a CSV response that a browser saves under `name`. The pool writes it, because it has up to ten thousand rows.
pub(crate) async fn csv_response(
    app: &mut AppState,
    name: &str,
    write: impl FnOnce() -> CsvTable + Send + 'static,
) -> Result<Response, Refusal> {
    let text = app.compute(move |_| write().into_text()).await?;
    Ok(csv_file(name, text))
}

/// A CSV file that a browser saves under `name`.
pub(crate) fn csv_file(name: &str, text: String) -> Response {
    attachment("text/csv; charset=utf-8", name, text)
}
