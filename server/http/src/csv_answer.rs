//! Answers that are CSV files.

use axum::http::header;
use axum::response::{IntoResponse, Response};
use gaitwright_charts::csv_table::CsvTable;

/// A table as a CSV answer that a browser saves under `name`.
pub(crate) fn csv_answer(name: &str, table: CsvTable) -> Response {
    csv_file(name, table.into_text())
}

/// A CSV file that a browser saves under `name`.
pub(crate) fn csv_file(name: &str, text: String) -> Response {
    let headers = [
        (header::CONTENT_TYPE, "text/csv; charset=utf-8".to_owned()),
        (header::CONTENT_DISPOSITION, format!("attachment; filename=\"{name}\"")),
    ];
    (headers, text).into_response()
}
