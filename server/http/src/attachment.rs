//! Responses that a browser saves as files.

use axum::body::Body;
use axum::http::{HeaderValue, header};
use axum::response::{IntoResponse, Response};
use std::fmt::Write as _;

/// A response that a browser saves under `name`.
pub(crate) fn attachment(kind: &'static str, name: &str, body: impl Into<Body>) -> Response {
    let headers =
        [(header::CONTENT_TYPE, HeaderValue::from_static(kind)), (header::CONTENT_DISPOSITION, disposition(name))];
    (headers, body.into()).into_response()
}

/// The header that gives a response its file name. A quoted name can hold plain characters only, so other names are
/// percent-encoded (RFC 6266).
pub(crate) fn disposition(name: &str) -> HeaderValue {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-._".contains(&byte);
    let text = if name.bytes().all(is_plain) {
        format!("attachment; filename=\"{name}\"")
    } else {
        let mut encoded = String::new();
        for byte in name.bytes() {
            if is_plain(byte) {
                encoded.push(char::from(byte));
            } else {
                // Writing to a string cannot fail.
                let _ = write!(encoded, "%{byte:02X}");
            }
        }
        format!("attachment; filename*=UTF-8''{encoded}")
    };
    // The text is ASCII.
    HeaderValue::from_str(&text).unwrap_or(HeaderValue::from_static("attachment"))
}

#[cfg(test)]
mod tests {
    use super::disposition;

    #[test]
    fn header_encodes_names_that_are_not_plain() {
        assert_eq!(disposition("gait-trial-3.json"), "attachment; filename=\"gait-trial-3.json\"");
        assert_eq!(disposition("Fuß.json"), "attachment; filename*=UTF-8''Fu%C3%9F.json");
        assert_eq!(disposition("a\"\r\n.csv"), "attachment; filename*=UTF-8''a%22%0D%0A.csv");
    }
}
