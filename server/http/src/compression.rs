//! Compresses pages, scripts and JSON for clients that accept gzip.

use axum::http::{Extensions, HeaderMap, StatusCode, Version, header};
use tower_http::compression::CompressionLayer;
use tower_http::compression::predicate::{And, Predicate, SizeAbove};

/// Smallest body that is compressed, bytes: a smaller one fits into one packet anyway.
const MIN_COMPRESSED_BYTES: u64 = 1024;

type IsCompressible = fn(StatusCode, Version, &HeaderMap, &Extensions) -> bool;

/// Whether a response is compressed. Events must not wait in a buffer, a strong entity tag promises equal bytes, and
/// archives and pictures are compressed already.
fn is_compressible(_: StatusCode, _: Version, headers: &HeaderMap, _: &Extensions) -> bool {
    let kind = headers.get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok()).unwrap_or_default();
    let is_text = ["text/", "application/javascript", "application/json", "application/problem+json", "image/svg+xml"];
    is_text.iter().any(|start| kind.starts_with(start))
        && !kind.starts_with("text/event-stream")
        && headers.get(header::ETAG).is_none_or(|tag| tag.as_bytes().starts_with(b"W/"))
}

/// The layer.
pub(super) fn layer() -> CompressionLayer<And<SizeAbove, IsCompressible>> {
    let is_compressible: IsCompressible = is_compressible;
    CompressionLayer::new().compress_when(SizeAbove::new(MIN_COMPRESSED_BYTES).and(is_compressible))
}
