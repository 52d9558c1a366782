//! JSON or CSV, as the Accept header asks; a `.csv` address is CSV always.

use crate::AppState;
use crate::problem::Refusal;
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

/// A table as a CSV answer that a browser saves under `name`; written on the pool, because it has up to ten thousand rows.
pub(crate) async fn csv_answer(
    app: &mut AppState,
    name: &str,
    write: impl FnOnce() -> CsvTable + Send + 'static,
) -> Result<Response, Refusal> {
    let text = app.compute(move |_| write().into_text()).await?;
    Ok(csv_file(name, text))
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
