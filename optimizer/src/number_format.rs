//! Numbers formatted for messages.

/// Three significant digits, with an exponent if there would be many zeros.
pub(crate) fn figure(value: f64) -> String {
    let magnitude = value.abs();
    if value != 0.0 && !(1e-3..1e4).contains(&magnitude) {
        return format!("{value:.2e}");
    }
    let last = if value == 0.0 { 1.0 } else { 10_f64.powf(2.0 - magnitude.log10().floor()) };
    format!("{}", (value * last).round() / last)
}
