//! A stride as a row of stick figures, in place of an animation.

use gait_optimizer::walking::stick_figure::{LegPoints, StickFigure};
use std::fmt::Write;

/// Number of stick figures of a stride.
const TILES: usize = 9;
const WIDTH: f64 = 104.0;
const HEIGHT: f64 = 190.0;
const GROUND: f64 = 164.0;
/// Units of the drawing per metre.
const SCALE: f64 = 86.0;
/// Centre of the head, in torso lengths above the hip, and its radius, m. The model has no head.
const HEAD_AT: f64 = 1.18;
const HEAD_M: f64 = 0.1;

/// Width and height of the drawing.
pub(super) const SIZE: (f64, f64) = (WIDTH * TILES as f64, HEIGHT);

/// Figures at equal time steps as one SVG element. Each is centred on its hip, with the percentage of the cycle below.
pub fn gait_tiles(figures: &[StickFigure]) -> String {
    let (width, body) = (SIZE.0, body(figures));
    let name = format!("The stride as {TILES} stick figures");
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
    for tile in 0..TILES {
        let share = tile as f64 / (TILES - 1) as f64;
        let Some(figure) = figures.iter().find(|figure| figure.time_s >= share * end - 1e-9) else { continue };
        let middle = WIDTH * (tile as f64 + 0.5);
        let at = |[x, z]: [f64; 2]| (middle + (x - figure.hip[0]) * SCALE, GROUND - z * SCALE);
        let mut line = |class: &str, joints: &[[f64; 2]]| -> std::fmt::Result {
            write!(svg, "<path class=\"{class}\" d=\"")?;
            for (i, (x, y)) in joints.iter().map(|joint| at(*joint)).enumerate() {
                write!(svg, "{}{x:.1} {y:.1}", if i == 0 { 'M' } else { 'L' })?;
            }
            write!(svg, "\"/>")
        };
        let half = WIDTH / 2.0 / SCALE;
        line("ground", &[[figure.hip[0] - half, 0.0], [figure.hip[0] + half, 0.0]])?;
        let foot = |leg: &LegPoints| [leg.ankle, leg.heel, leg.toe, leg.ankle];
        line("left", &[figure.hip, figure.left.knee, figure.left.ankle])?;
        line("left", &foot(&figure.left))?;
        line("right", &[figure.hip, figure.right.knee, figure.right.ankle])?;
        line("right", &foot(&figure.right))?;
        line("torso", &[figure.hip, figure.shoulder])?;
        let along = |i: usize| figure.hip[i] + HEAD_AT * (figure.shoulder[i] - figure.hip[i]);
        let (x, y) = at([along(0), along(1)]);
        write!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{:.1}\"/>", HEAD_M * SCALE)?;
        write!(svg, "<text x=\"{middle:.1}\" y=\"{}\">{:.0} %</text>", HEIGHT - 6.0, 100.0 * share)?;
    }
    Ok(())
}
