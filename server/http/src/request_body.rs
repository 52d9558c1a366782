//! Receives the whole body of a request before anything decides about the request. A decision that was made while the
//! body was still on its way could be out of date when it takes effect.

use super::body_limits::{ANONYMOUS_BODY_LIMIT_BYTES, BODY_LIMIT_BYTES, MEASUREMENT_FILE_LIMIT_BYTES};
use axum::body::{Body, HttpBody};
use axum::extract::{MatchedPath, Request};
use axum::http::header;
use futures_util::StreamExt;
use gaitwright_service::error::Error;

/// Pages whose forms take measurement files and recordings.
const UPLOAD_PAGES: [&str; 3] = [
    "/reference-gaits",
    "/lab-sessions/{id}/measurement-files/emg",
    "/lab-sessions/{id}/measurement-files/joint-angles",
];

/// How many times its size a file can take in a form, where three bytes stand for a comma or the end of a line.
const GROWTH_IN_FORM: usize = 2;

/// Operations that take measurement files and recordings.
const UPLOADS: [&str; 3] = [
    "/api/v1/reference-gaits",
    "/api/v1/lab-sessions/{id}/measurement-files/emg",
    "/api/v1/lab-sessions/{id}/measurement-files/joint-angles",
];

/// The largest body, bytes.
pub(super) fn limit(request: &Request, is_signed_in: bool) -> usize {
    let route = request.extensions().get::<MatchedPath>().map(MatchedPath::as_str);
    match route {
        _ if !is_signed_in => ANONYMOUS_BODY_LIMIT_BYTES,
        Some(route) if UPLOADS.contains(&route) => MEASUREMENT_FILE_LIMIT_BYTES,
        Some(route) if UPLOAD_PAGES.contains(&route) => GROWTH_IN_FORM * MEASUREMENT_FILE_LIMIT_BYTES,
        _ => BODY_LIMIT_BYTES,
    }
}

fn size_in_words(bytes: usize) -> String {
    match bytes {
        whole if whole >= MIB && whole.is_multiple_of(MIB) => format!("{} MiB", whole / MIB),
        whole if whole >= KIB && whole.is_multiple_of(KIB) => format!("{} KiB", whole / KIB),
        other => format!("{other} bytes"),
    }
}

const KIB: usize = 1024;
const MIB: usize = 1024 * KIB;

/// How many times the limit of a body that is too large is still received. A client that sends its whole body before it
/// reads the answer would otherwise see only a broken connection.
const DISCARDED: usize = 4;

/// The request with its whole body in memory. The body is copied, because each received piece keeps the whole buffer into
/// which it was read: a body that arrives byte by byte would need thousands of times its size.
///
/// # Errors
/// [`Error::TooLarge`], and [`Error::Malformed`] if the body breaks off.
pub(super) async fn receive(request: Request, limit: usize) -> Result<Request, Error> {
    let (parts, body) = request.into_parts();
    let too_large = || Error::TooLarge(format!("The body is too large. The limit here is {}.", size_in_words(limit)));
    let announced = body.size_hint().lower();
    let waits_for_answer = parts.headers.contains_key(header::EXPECT);
    if announced > limit as u64 && (waits_for_answer || announced > (limit * DISCARDED) as u64) {
        return Err(too_large());
    }
    let (mut received, mut length) = (Vec::new(), 0);
    let mut pieces = body.into_data_stream();
    while let Some(piece) = pieces.next().await {
        let piece = piece.map_err(|error| Error::Malformed(format!("The body cannot be read: {error}.")))?;
        length += piece.len();
        if length > limit * DISCARDED {
            break;
        }
        if length <= limit {
            received.extend_from_slice(&piece);
        } else {
            received = Vec::new();
        }
    }
    if length > limit {
        return Err(too_large());
    }
    Ok(Request::from_parts(parts, Body::from(received)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::body::Bytes;
    use futures_util::stream;
    use http_body_util::BodyExt;
    use std::collections::BTreeSet;

    fn in_single_bytes(bytes: Vec<u8>) -> Request {
        let pieces = bytes.into_iter().map(|byte| Ok::<_, std::io::Error>(Bytes::from(vec![byte])));
        Request::new(Body::from_stream(stream::iter(pieces)))
    }

    #[tokio::test]
    async fn body_up_to_the_limit_is_received_in_order() {
        let sent: Vec<u8> = (0..=255).cycle().take(5000).collect();
        let received = receive(in_single_bytes(sent.clone()), 5000).await.unwrap().into_body();
        assert_eq!(received.size_hint().exact(), Some(5000));
        assert!(received.collect().await.unwrap().to_bytes() == sent);
        assert!(matches!(receive(in_single_bytes(sent), 4999).await, Err(Error::TooLarge(_))));
    }

    #[test]
    fn operations_that_take_a_recording_are_uploads() {
        let document = crate::openapi::value().unwrap();
        let takes_recording = |path: &&String| {
            let body = "/post/requestBody/content/application~1json/schema/$ref";
            let reference = document["paths"][path.as_str()].pointer(body).and_then(|reference| reference.as_str());
            let schema = reference.and_then(|reference| document.pointer(reference.trim_start_matches('#')));
            schema.is_some_and(|schema| schema["properties"].get("recording").is_some())
        };
        let described: Vec<&String> = document["paths"].as_object().unwrap().keys().filter(takes_recording).collect();
        let uploads: BTreeSet<&str> = UPLOADS.into_iter().collect();
        assert_eq!(described.into_iter().map(String::as_str).collect::<BTreeSet<_>>(), uploads);
    }

    #[tokio::test]
    async fn broken_body_is_refused() {
        let parts = [Ok(Bytes::from_static(b"a")), Err(std::io::Error::other("cut off"))];
        let request = Request::new(Body::from_stream(stream::iter(parts)));
        assert!(matches!(receive(request, 100).await, Err(Error::Malformed(_))));
    }
}
