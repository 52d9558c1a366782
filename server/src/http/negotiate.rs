//! JSON or CSV, as the Accept header asks; a `.csv` address is CSV always.

use crate::error::Error;
use crate::gait_table::csv_bytes;
use axum::http::{HeaderMap, header};
use axum::response::{IntoResponse, Response};

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

/// Rows as a CSV answer that a browser saves under `name`.
pub(crate) fn csv_answer(name: &str, header: &[&str], rows: Vec<Vec<String>>) -> Result<Response, Error> {
    Ok(csv_file(name, csv_bytes(header, rows)?))
}

/// A CSV file that a browser saves under `name`.
pub(crate) fn csv_file(name: &str, bytes: Vec<u8>) -> Response {
    let headers = [
        (header::CONTENT_TYPE, "text/csv; charset=utf-8".to_owned()),
        (header::CONTENT_DISPOSITION, format!("attachment; filename=\"{name}\"")),
        (header::VARY, "Accept".to_owned()),
    ];
    (headers, bytes).into_response()
}
