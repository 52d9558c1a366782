//! QR codes of addresses, for phones and tablets that cannot receive a link.

use qrcodegen::{QrCode, QrCodeEcc};
use std::fmt::Write;

/// Light modules around the code, as ISO/IEC 18004 requires.
const MARGIN: i32 = 4;

/// The QR code of a text as SVG; empty if the text is too long for one.
pub(crate) fn svg(label: &str, text: &str) -> String {
    let Ok(code) = QrCode::encode_text(text, QrCodeEcc::Medium) else { return String::new() };
    let size = code.size() + 2 * MARGIN;
    let mut dark = String::new();
    for y in 0..code.size() {
        for x in (0..code.size()).filter(|x| code.get_module(*x, y)) {
            // Writing to a String cannot fail.
            let _ = write!(dark, "M{} {}h1v1h-1z", x + MARGIN, y + MARGIN);
        }
    }
    // Dark on light in both colour schemes: many readers reject inverted codes.
    format!(
        "<svg class=\"qr\" viewBox=\"0 0 {size} {size}\" role=\"img\" aria-label=\"{label}\" shape-rendering=\"crispEdges\">\
         <rect width=\"{size}\" height=\"{size}\" fill=\"#fff\"/><path d=\"{dark}\" fill=\"#000\"/></svg>"
    )
}

#[cfg(test)]
mod tests {
    use super::svg;

    #[test]
    fn code_of_an_address_has_finder_patterns_in_three_corners() {
        let code = svg("QR code", "https://gait.clinic.example/sign-in/0123456789");
        for corner in ["M4 4h1", "M10 4h1", "M4 10h1"] {
            assert!(code.contains(corner), "{corner}: {code}");
        }
        assert!(code.starts_with("<svg class=\"qr\" viewBox=\"0 0 ") && code.ends_with("</svg>"));
    }

    #[test]
    fn too_long_text_has_no_code() {
        assert_eq!(svg("QR code", &"x".repeat(10_000)), "");
    }
}
