//! Sparklines: small lines without axes, within text.

use super::axis::ChartAxis;
use std::fmt::Write;

const WIDTH: f64 = 96.0;
const HEIGHT: f64 = 24.0;
const MARGIN: f64 = 3.0;

/// A step line of values from 0 to `end`; `None` without values.
pub fn sparkline(label: &str, points: &[(f64, f64)], end: f64) -> Option<String> {
    let (first, last) = (points.first()?, points.last()?);
    let x = ChartAxis::over([first.0, end.max(last.0)].into_iter(), 2, true);
    let y = ChartAxis::over(points.iter().map(|p| p.1), 2, true);
    let px = |value: f64| MARGIN + x.place(value) * (WIDTH - 2.0 * MARGIN);
    let py = |value: f64| HEIGHT - MARGIN - y.place(value) * (HEIGHT - 2.0 * MARGIN);
    let mut path = format!("M{:.1} {:.1}", px(first.0), py(first.1));
    for &(at, value) in &points[1..] {
        // Writing to a String cannot fail.
        let _ = write!(path, "H{:.1}V{:.1}", px(at), py(value));
    }
    let (x, y) = (px(end.max(last.0)), py(last.1));
    Some(format!(
        "<svg class=\"sparkline\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{}\"><path d=\"{path}H{x:.1}\"/>\
         <circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.5\"/></svg>",
        super::escaped_text::escape(label)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_value_gives_a_level_line_and_no_value_none() {
        assert_eq!(sparkline("", &[], 5.0), None);
        let line = sparkline("a<b", &[(1.0, 0.3)], 5.0).unwrap_or_default();
        assert!(line.contains("a&lt;b") && !line.contains("NaN"), "{line}");
    }
}
