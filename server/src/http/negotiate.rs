//! JSON or CSV, as the Accept header asks; a `.csv` address is CSV always.

use crate::error::Error;
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
    let mut writer = csv::Writer::from_writer(Vec::new());
    let internal = |e: csv::Error| Error::Internal(e.to_string());
    writer.write_record(header).map_err(internal)?;
    for row in rows {
        writer.write_record(&row).map_err(internal)?;
    }
    let bytes = writer.into_inner().map_err(|e| Error::Internal(e.to_string()))?;
    let headers = [
        (header::CONTENT_TYPE, "text/csv; charset=utf-8".to_owned()),
        (header::CONTENT_DISPOSITION, format!("attachment; filename=\"{name}\"")),
        (header::VARY, "Accept".to_owned()),
    ];
    Ok((headers, bytes).into_response())
}
