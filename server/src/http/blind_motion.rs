//! The motion of a gait as a rater sees it: every motion has as many figures, evenly over the stride, starts at the
//! same place, and says nothing of where it is from.

use crate::error::Error;
use gait_optimizer::Gait;
use gait_optimizer::walking::stick_figure::{StickFigure, stick_figures};
use serde::Serialize;

/// Figures of one stride; the last one is the first of the next.
const FIGURES: usize = 101;

/// One figure: hip, shoulder, and knee, ankle, heel, toe of the left and the right leg; forward and up, m.
#[derive(Debug, Serialize)]
pub(crate) struct Figure([[f64; 2]; 10]);

/// A gait as a rater sees it.
pub(crate) fn blind_motion(gait: &Gait) -> Result<Vec<Figure>, Error> {
    let figures = stick_figures(gait)?;
    let (Some(first), Some(last)) = (figures.first(), figures.last()) else {
        return Err(Error::Internal("a gait without any point".to_owned()));
    };
    let (start, length, origin) = (first.time_s, last.time_s - first.time_s, first.hip[0]);
    let at = |index: usize| {
        let time = start + length * index as f64 / (FIGURES - 1) as f64;
        let after = figures.iter().position(|figure| figure.time_s >= time).unwrap_or(figures.len() - 1);
        let (a, b) = (&figures[after.saturating_sub(1)], &figures[after]);
        let span = b.time_s - a.time_s;
        let share = if span > 0.0 { ((time - a.time_s) / span).clamp(0.0, 1.0) } else { 1.0 };
        let (a, b) = (places(a), places(b));
        let mut figure = [[0.0; 2]; 10];
        for (place, (from, to)) in figure.iter_mut().zip(a.iter().zip(&b)) {
            let between = |k: usize| from[k] + (to[k] - from[k]) * share;
            *place = [millimetres(between(0) - origin), millimetres(between(1))];
        }
        Figure(figure)
    };
    Ok((0..FIGURES).map(at).collect())
}

fn places(figure: &StickFigure) -> [[f64; 2]; 10] {
    let (l, r) = (&figure.left, &figure.right);
    [figure.hip, figure.shoulder, l.knee, l.ankle, l.heel, l.toe, r.knee, r.ankle, r.heel, r.toe]
}

/// More digits would be a fingerprint.
fn millimetres(metres: f64) -> f64 {
    (metres * 1000.0).round() / 1000.0
}
