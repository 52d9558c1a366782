//! Makes a drawing self-contained: adds size, white background, title, legend, and the rules of the style sheet for
//! drawings, in its light colours.

use super::escaped_text::escape;
use std::collections::HashMap;
use std::fmt::Write;

/// The style sheet of the pages, which has the colours and dashes of drawings.
pub const STYLE_SHEET: &str = include_str!("../gaitwright.css");
/// Space above the drawing for the title, and to its left.
const TITLE: f64 = 34.0;
const MARGIN: f64 = 10.0;
/// Height of a row of the legend, width of a key, and estimated width of a character.
const ROW: f64 = 22.0;
const KEY: f64 = 34.0;
const CHARACTER: f64 = 7.6;

/// The drawing.
#[derive(Debug)]
pub(super) struct Inside {
    /// Its class in the style sheet.
    pub(super) class: &'static str,
    /// Width and height.
    pub(super) size: (f64, f64),
    /// Its elements.
    pub(super) body: String,
}

/// A complete SVG document.
pub(super) fn svg(title: &str, inside: &Inside, legend: &[(String, String)]) -> String {
    let mut svg = String::with_capacity(inside.body.len() + 8 * 1024);
    // Writing to a String cannot fail.
    let _ = draw(&mut svg, title, inside, legend);
    svg
}

fn draw(svg: &mut String, title: &str, inside: &Inside, legend: &[(String, String)]) -> std::fmt::Result {
    let width = inside.size.0 + 2.0 * MARGIN;
    let places = places(legend, width);
    let rows = places.last().map_or(0.0, |(_, row)| row + 1.0);
    let below = TITLE + inside.size.1;
    let height = below + rows * ROW + 2.0 * MARGIN;
    write!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\">"
    )?;
    write!(svg, "<title>{0}</title><style>{1}</style>", escape(title), style())?;
    write!(svg, "<rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/><g class=\"{}\">", inside.class)?;
    // Before the rules, because those of stick figures centre text.
    let heading =
        format!("text-anchor: start; font-size: 16px; fill: {}", light_values().get("--ink").unwrap_or(&"black"));
    write!(svg, "<text style=\"{heading}\" x=\"{MARGIN}\" y=\"23\">{}</text>", escape(title))?;
    write!(svg, "<g transform=\"translate({MARGIN} {TITLE})\">{}</g>", inside.body)?;
    for ((key, label), (x, row)) in legend.iter().zip(places) {
        let y = below + MARGIN + row * ROW;
        // As in pages: `key c0 dashed`.
        let class = key.trim_start_matches("key ");
        write!(svg, "<g transform=\"translate({x:.1} {y:.1})\">")?;
        if class.ends_with("points") {
            write!(svg, "<circle class=\"dot {class}\" cx=\"13\" cy=\"8\" r=\"4\"/>")?;
        } else if class.ends_with("band") {
            write!(svg, "<rect class=\"{class}\" y=\"2\" width=\"26\" height=\"12\"/>")?;
        } else if class == "stance" {
            write!(svg, "<path class=\"stance\" d=\"M0 8H16\"/><path class=\"swing\" d=\"M16 8H26\"/>")?;
        } else if class == "begins" {
            write!(svg, "<path class=\"mark\" d=\"M13 0V16\"/>")?;
        } else {
            write!(svg, "<path class=\"line {class}\" d=\"M0 8H26\"/>")?;
        }
        write!(svg, "<text x=\"{KEY}\" y=\"13\">{}</text></g>", escape(label))?;
    }
    write!(svg, "</g></svg>")
}

/// Position of each entry of the legend.
fn places(legend: &[(String, String)], width: f64) -> Vec<(f64, f64)> {
    let (mut x, mut row) = (MARGIN, 0.0);
    let place = |(_, label): &(String, String)| {
        let needed = KEY + CHARACTER * label.chars().count() as f64 + 2.0 * MARGIN;
        if x > MARGIN && x + needed > width {
            (x, row) = (MARGIN, row + 1.0);
        }
        let here = (x, row);
        x += needed;
        here
    };
    legend.iter().map(place).collect()
}

/// The style rules of drawings, with the colours of the light scheme.
fn style() -> String {
    let values = light_values();
    let mut style = String::new();
    for line in STYLE_SHEET.lines().filter(|line| concerns_drawings(line)) {
        let mut parts = line.split("var(");
        style.push_str(parts.next().unwrap_or_default());
        for part in parts {
            let (name, rest) = part.split_once(')').unwrap_or((part, ""));
            style.push_str(values.get(name).copied().unwrap_or("inherit"));
            style.push_str(rest);
        }
        style.push('\n');
    }
    // SVG renderers accept only this spelling.
    style.replace("currentcolor", "currentColor")
}

fn concerns_drawings(line: &str) -> bool {
    let palette = line.strip_prefix(".c").is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()));
    let chart = line.starts_with(".chart ") && !line.starts_with(".chart {");
    let tree = line.starts_with(".tree ") && !line.starts_with(".tree {") && !line.starts_with(".tree a:");
    chart
        || line.starts_with(".chart.map ")
        || line.starts_with(".gait-walker ")
        || line.starts_with(".tiles ")
        || tree
        || palette
}

/// The first value of each variable, which is that of the light scheme.
fn light_values() -> HashMap<&'static str, &'static str> {
    let mut values = HashMap::new();
    for declaration in STYLE_SHEET.split([';', '{', '\n']) {
        if let Some((name, value)) = declaration.trim().split_once(": ")
            && name.starts_with("--")
        {
            values.entry(name).or_insert(value.trim());
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn style_has_light_colours_and_no_variables() {
        let style = style();
        assert!(style.contains(".c0 { color: #0a6f8a; }") && style.contains(".chart .line { fill: none;"), "{style}");
        assert!(!style.contains("var(") && !style.contains("inherit") && !style.contains("#5cc3de"), "{style}");
    }

    #[test]
    fn long_legend_wraps_to_the_next_row() {
        let label = "x".repeat(30);
        let legend: Vec<(String, String)> = (0..4).map(|_| ("key c0 solid".to_owned(), label.clone())).collect();
        let rows: Vec<f64> = places(&legend, 660.0).into_iter().map(|(_, row)| row).collect();
        assert_eq!(rows, [0.0, 0.0, 1.0, 1.0]);
    }
}
