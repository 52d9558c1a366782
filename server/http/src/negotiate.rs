//! JSON or CSV, as the Accept header asks; a `.csv` address is CSV always.

use axum::http::{HeaderMap, header};
use axum::response::{IntoResponse, Response};
use gaitwright_charts::csv_table::CsvTable;

/// Whether CSV is asked for before JSON.
pub(crate) fn wants_csv(headers: &HeaderMap) -> bool {
    let accept = headers.get(header::ACCEPT).and_then(|value| value.to_str().ok()).unwrap_or("");
    let place =
        |kind: &str| accept.split(',').position(|part| part.split(';').next().is_some_and(|k| k.trim() == kind));
    match (place("text/csv"), place("application/json")) {
        (Some(csv), Some(json)) => csv < json,
        (Some(_), None) => true,
        _ => false,
    }
}

/// A table as a CSV answer that a browser saves under `name`.
pub(crate) fn csv_answer(name: &str, table: CsvTable) -> Response {
    csv_file(name, table.into_text())
}

/// A response with CSV text, which a browser saves as `name`.
pub(crate) fn csv_file(name: &str, text: String) -> Response {
    let headers = [
        (header::CONTENT_TYPE, "text/csv; charset=utf-8".to_owned()),
        (header::CONTENT_DISPOSITION, format!("attachment; filename=\"{name}\"")),
        (header::VARY, "Accept".to_owned()),
    ];
    (headers, text).into_response()
}
