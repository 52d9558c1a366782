//! Heat maps: tables of values over two quantities, shaded by value, with contour lines. Every cell also has its value as
//! text, so no information is in the shade alone.

use super::contours::{Contour, contours};
use super::escaped_text::escape;
use std::fmt::Write;

/// One cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Tile {
    /// Value that determines the shade. A cell whose value is not finite has the lightest shade and no contour lines.
    pub value: f64,
    /// Text of the cell.
    pub text: String,
    /// Text below it; may be empty.
    pub below: String,
    /// Whether the cell has a frame.
    pub framed: bool,
}

/// A heat map.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    /// Title.
    pub title: String,
    /// Label of the columns, with its unit, and their values.
    pub columns: (String, Vec<f64>),
    /// Label of the rows, with its unit, and their values.
    pub rows: (String, Vec<f64>),
    /// Cells by row.
    pub cells: Vec<Vec<Tile>>,
    /// Values of the lightest and the darkest shade.
    pub range: (f64, f64),
    /// Whether contour lines connect equal values. Counts have none between them.
    pub has_contours: bool,
}

const WIDTH: f64 = 640.0;
const LEFT: f64 = 74.0;
const TOP: f64 = 34.0;
const ROW: f64 = 52.0;
const BOTTOM: f64 = 60.0;
/// The darkest shade, on which text is readable in the light and the dark scheme.
const DARKEST: f64 = 0.5;

impl HeatMap {
    /// The map as an SVG element.
    pub fn svg(&self) -> String {
        let label = escape(&format!("{}: {} by {}", self.title, self.rows.0, self.columns.0));
        let ((width, height), body) = (self.size(), self.body());
        format!(
            "<svg class=\"chart map\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{label}\">{body}</svg>"
        )
    }

    /// Width and height of the drawing.
    pub(super) fn size(&self) -> (f64, f64) {
        (WIDTH, self.bottom() + BOTTOM)
    }

    /// The elements of the drawing.
    pub(super) fn body(&self) -> String {
        let mut svg = String::with_capacity(8 * 1024);
        // Writing to a String cannot fail.
        let _ = self.draw(&mut svg);
        svg
    }

    /// Bottom of the cells.
    fn bottom(&self) -> f64 {
        TOP + ROW * self.cells.len() as f64
    }

    /// Centre of a cell, or a place between centres.
    fn place(&self, (row, column): (f64, f64)) -> (f64, f64) {
        let width = (WIDTH - LEFT - 8.0) / self.columns.1.len().max(1) as f64;
        (LEFT + width * (column + 0.5), TOP + ROW * (row + 0.5))
    }

    /// Whether contour lines are drawn. Maps have none if their values hardly differ.
    pub fn draws_contours(&self) -> bool {
        !self.contours().is_empty()
    }

    fn contours(&self) -> Vec<Contour> {
        if !self.has_contours {
            return Vec::new();
        }
        let grid: Vec<Vec<f64>> = self.cells.iter().map(|row| row.iter().map(|cell| cell.value).collect()).collect();
        contours(&grid)
    }

    fn draw(&self, svg: &mut String) -> std::fmt::Result {
        self.draw_cells(svg)?;
        for Contour { pieces, .. } in self.contours() {
            svg.push_str("<path class=\"contour\" d=\"");
            for piece in pieces {
                let [from, to] = piece.map(|end| self.place(end));
                write!(svg, "M{:.1} {:.1}L{:.1} {:.1}", from.0, from.1, to.0, to.1)?;
            }
            svg.push_str("\"/>");
        }
        self.draw_texts(svg)
    }

    fn draw_cells(&self, svg: &mut String) -> std::fmt::Result {
        let width = (WIDTH - LEFT - 8.0) / self.columns.1.len().max(1) as f64;
        let (low, high) = self.range;
        for (row, cells) in self.cells.iter().enumerate() {
            for (column, cell) in cells.iter().enumerate() {
                let (x, y) = (LEFT + width * column as f64, TOP + ROW * row as f64);
                let share = ((cell.value - low) / (high - low).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
                let share = if cell.value.is_finite() { share } else { 0.0 };
                let class = if cell.framed { "cell framed" } else { "cell" };
                write!(
                    svg,
                    "<rect class=\"{class}\" x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill-opacity=\"{:.3}\"/>",
                    x + 1.5,
                    y + 1.5,
                    width - 3.0,
                    ROW - 3.0,
                    DARKEST * share
                )?;
            }
        }
        Ok(())
    }

    fn draw_texts(&self, svg: &mut String) -> std::fmt::Result {
        let bottom = self.bottom();
        for (row, (cells, level)) in self.cells.iter().zip(&self.rows.1).enumerate() {
            let (_, middle) = self.place((row as f64, 0.0));
            write!(svg, "<text class=\"tick y\" x=\"{}\" y=\"{:.1}\">{level}</text>", LEFT - 8.0, middle + 5.0)?;
            for (column, cell) in cells.iter().enumerate() {
                let (x, _) = self.place((row as f64, column as f64));
                let y = middle + if cell.below.is_empty() { 5.0 } else { -2.0 };
                write!(svg, "<text class=\"value\" x=\"{x:.1}\" y=\"{y:.1}\">{}</text>", escape(&cell.text))?;
                if !cell.below.is_empty() {
                    let y = middle + 17.0;
                    write!(svg, "<text class=\"below\" x=\"{x:.1}\" y=\"{y:.1}\">{}</text>", escape(&cell.below))?;
                }
            }
        }
        for (column, level) in self.columns.1.iter().enumerate() {
            let (x, _) = self.place((0.0, column as f64));
            write!(svg, "<text class=\"tick x\" x=\"{x:.1}\" y=\"{:.1}\">{level}</text>", bottom + 22.0)?;
        }
        let middle = f64::midpoint(LEFT, WIDTH - 8.0);
        write!(
            svg,
            "<text class=\"label\" x=\"{middle:.1}\" y=\"{:.1}\">{}</text>",
            bottom + 50.0,
            escape(&self.columns.0)
        )?;
        write!(svg, "<text class=\"label start\" x=\"4\" y=\"18\">{}</text>", escape(&self.rows.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_have_their_values_and_equal_values_share_a_shade() {
        let cell = |value: f64| Tile { value, text: format!("<{value}>"), below: String::new(), framed: value > 1.0 };
        let unknown = Tile { value: f64::NAN, text: "none".to_owned(), below: String::new(), framed: false };
        let map = HeatMap {
            title: "t".to_owned(),
            columns: ("x".to_owned(), vec![1.0, 2.0, 3.0]),
            rows: ("y".to_owned(), vec![3.0]),
            cells: vec![vec![cell(1.0), cell(2.0), unknown]],
            range: (1.0, 1.0),
            has_contours: true,
        };
        let svg = map.svg();
        assert_eq!(svg.matches("<rect").count(), 3);
        assert_eq!(svg.matches("framed").count(), 1);
        assert!(svg.contains("&lt;1&gt;") && !svg.contains("NaN") && !svg.contains("inf"));
    }

    #[test]
    fn contour_lines_are_between_the_cells() {
        let cell = |value: f64| Tile { value, text: format!("{value}"), below: String::new(), framed: false };
        let map = HeatMap {
            title: "t".to_owned(),
            columns: ("x".to_owned(), vec![1.0, 2.0]),
            rows: ("y".to_owned(), vec![3.0, 4.0]),
            cells: vec![vec![cell(0.2), cell(0.8)], vec![cell(0.2), cell(0.8)]],
            range: (0.2, 0.8),
            has_contours: true,
        };
        let svg = map.svg();
        // Half way between both columns.
        assert!(svg.contains("<path class=\"contour\" d=\"M353.0 60.0L353.0 112.0\"/>"), "{svg}");
        // The numbers are in the cells.
        assert_eq!(svg.matches("<text").count(), 4 + 4 + 2, "cells, levels of both axes, and their names: {svg}");
    }
}
