//! Responses that are CSV files.

use crate::AppState;
use crate::problem_details::Refusal;
use axum::http::header;
use axum::response::{IntoResponse, Response};
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
    let headers = [
        (header::CONTENT_TYPE, "text/csv; charset=utf-8".to_owned()),
        (header::CONTENT_DISPOSITION, format!("attachment; filename=\"{name}\"")),
    ];
    (headers, text).into_response()
}
