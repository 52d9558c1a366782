//! A stride as a row of pictures, in place of an animation.

use crate::walker::{UNITS_PER_M, parts};
use gait_optimizer::gait::stick_figure::StickFigure;
use std::fmt::Write;

/// Number of pictures of a stride.
const TILES: usize = 9;
const WIDTH: f64 = 112.0;
const HEIGHT: f64 = 190.0;
const GROUND: f64 = 166.0;
/// Scale of the body, whose outlines are in other units.
const SCALE: f64 = 88.0 / UNITS_PER_M;

/// Width and height of the drawing.
pub(super) const SIZE: (f64, f64) = (WIDTH * TILES as f64, HEIGHT);

/// Figures at equal time steps as one SVG element. Each is centred on its hip, with the percentage of the cycle below.
pub fn stride_pictures(figures: &[StickFigure]) -> String {
    let (width, body) = (SIZE.0, body(figures));
    let name = format!("The stride in {TILES} pictures");
    format!("<svg class=\"tiles\" viewBox=\"0 0 {width} {HEIGHT}\" role=\"img\" aria-label=\"{name}\">{body}</svg>")
}

/// The elements of the drawing.
pub(super) fn body(figures: &[StickFigure]) -> String {
    let mut svg = String::with_capacity(16 * 1024);
    // Writing to a String cannot fail.
    let _ = draw(&mut svg, figures);
    svg
}

fn draw(svg: &mut String, figures: &[StickFigure]) -> std::fmt::Result {
    let end = figures.last().map_or(0.0, |figure| figure.time_s);
    write!(svg, "<path class=\"ground\" d=\"M0 {GROUND}H{}\"/>", SIZE.0)?;
    // One body for all pictures: its outlines do not change.
    let body = figures.first().map(parts).unwrap_or_default();
    for tile in 0..TILES {
        let share = tile as f64 / (TILES - 1) as f64;
        let Some(figure) = figures.iter().find(|figure| figure.time_s >= share * end - 1e-9) else { continue };
        let middle = WIDTH * (tile as f64 + 0.5);
        write!(svg, "<g class=\"gait-walker\" transform=\"translate({middle} {GROUND})scale({SCALE})\">")?;
        for part in &body {
            let place = part.segment.placement(figure).transform();
            write!(svg, "<path class=\"{}\" transform=\"{place}\" d=\"{}\"", part.class, part.outline)?;
            // Only the first figure is animated, on the page of a rater.
            if tile == 0 {
                write!(svg, " data-segment=\"{}\"", part.segment.name())?;
            }
            write!(svg, "/>")?;
        }
        write!(svg, "</g><text x=\"{middle}\" y=\"{}\">{:.0} %</text>", HEIGHT - 6.0, 100.0 * share)?;
    }
    Ok(())
}
