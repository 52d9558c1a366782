//! Serves styles, scripts and images, which are embedded in the binary.

use crate::problem_details::Refusal;
use axum::extract::Path;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use gaitwright_service::error::Error;
use rust_embed::Embed;

#[derive(Embed)]
#[folder = "web/static"]
struct StaticFiles;

/// `GET /static/{path}`. Browsers revalidate by content hash, so a new version is used at once.
pub(super) async fn get(Path(path): Path<String>, headers: HeaderMap) -> Result<Response, Refusal> {
    let file = StaticFiles::get(&path).ok_or_else(|| Error::NotFound { what: "file".to_owned(), id: path })?;
    // Weak, because a compressed response has other bytes.
    let tag = format!("W/\"{}\"", hex::encode(&file.metadata.sha256_hash()[..16]));
    let known = headers.get(header::IF_NONE_MATCH).is_some_and(|value| value.as_bytes() == tag.as_bytes());
    if known {
        return Ok((StatusCode::NOT_MODIFIED, [(header::ETAG, tag)]).into_response());
    }
    let kind = file.metadata.mimetype().to_owned();
    let headers = [(header::CONTENT_TYPE, kind), (header::ETAG, tag), (header::CACHE_CONTROL, "no-cache".to_owned())];
    Ok((headers, file.data).into_response())
}
