//! Motions for raters, without anything that identifies a gait: a fixed number of stick figures over one stride, from the
//! same position, starting at another phase in each pair.

use gait_optimizer::Gait;
use gait_optimizer::gait::stick_figure::{LegPoints, StickFigure, stick_figures};
use gaitwright_service::error::Error;
use serde::Serialize;
use sha2::{Digest, Sha256};

/// Number of stick figures of a stride. The last one is the first of the next stride.
const STICK_FIGURES: usize = 101;

/// One stick figure: hip, shoulder, and knee, ankle, heel, toe of the left and the right leg; forward and up, m.
#[derive(Debug, Serialize)]
pub(crate) struct BlindStickFigure([[f64; 2]; 10]);

/// The phase at which both motions of a pair start, as a fraction of the stride. It differs between pairs, so that no
/// motion has the same bytes as an earlier one. A rater may still recognise a gait by its movement.
pub(crate) fn phase(code: &str) -> f64 {
    let digest = Sha256::digest(code.as_bytes());
    let number = digest.iter().take(6).fold(0_u64, |number, byte| (number << 8) | u64::from(*byte));
    number as f64 / (1_u64 << 48) as f64
}

/// The motion of a gait for a rater.
pub(crate) fn blind_motion(gait: &Gait, phase: f64) -> Result<Vec<BlindStickFigure>, Error> {
    Ok(blind_stride(gait, phase)?.iter().map(BlindStickFigure::of).collect())
}

/// The same, as stick figures.
pub(crate) fn blind_stride(gait: &Gait, phase: f64) -> Result<Vec<StickFigure>, Error> {
    let figures = stick_figures(gait)?;
    let (Some(first), Some(last)) = (figures.first(), figures.last()) else {
        return Err(Error::Internal("the gait has no nodes".to_owned()));
    };
    let (stride_s, stride_m) = (last.time_s - first.time_s, last.hip[0] - first.hip[0]);
    let origin = between(&figures, first.time_s + stride_s * phase).hip[0];
    let at = |index: usize| {
        let share = index as f64 / (STICK_FIGURES - 1) as f64;
        let (place, next_stride) = if phase + share > 1.0 { (phase + share - 1.0, 1.0) } else { (phase + share, 0.0) };
        let figure = between(&figures, first.time_s + stride_s * place);
        let moved = |[x, z]: [f64; 2]| [millimetres(x + next_stride * stride_m - origin), millimetres(z)];
        let leg = |leg: &LegPoints| LegPoints {
            knee: moved(leg.knee),
            ankle: moved(leg.ankle),
            heel: moved(leg.heel),
            toe: moved(leg.toe),
        };
        StickFigure {
            time_s: stride_s * share,
            hip: moved(figure.hip),
            shoulder: moved(figure.shoulder),
            left: leg(&figure.left),
            right: leg(&figure.right),
        }
    };
    Ok((0..STICK_FIGURES).map(at).collect())
}

/// Interpolates the figure at a time.
fn between(figures: &[StickFigure], time: f64) -> StickFigure {
    let after = figures.iter().position(|figure| figure.time_s >= time).unwrap_or(figures.len() - 1);
    let (a, b) = (&figures[after.saturating_sub(1)], &figures[after]);
    let span = b.time_s - a.time_s;
    let share = if span > 0.0 { ((time - a.time_s) / span).clamp(0.0, 1.0) } else { 1.0 };
    let place = |a: [f64; 2], b: [f64; 2]| [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share];
    let leg = |a: &LegPoints, b: &LegPoints| LegPoints {
        knee: place(a.knee, b.knee),
        ankle: place(a.ankle, b.ankle),
        heel: place(a.heel, b.heel),
        toe: place(a.toe, b.toe),
    };
    StickFigure {
        time_s: time,
        hip: place(a.hip, b.hip),
        shoulder: place(a.shoulder, b.shoulder),
        left: leg(&a.left, &b.left),
        right: leg(&a.right, &b.right),
    }
}

impl BlindStickFigure {
    fn of(figure: &StickFigure) -> Self {
        let (l, r) = (&figure.left, &figure.right);
        Self([figure.hip, figure.shoulder, l.knee, l.ankle, l.heel, l.toe, r.knee, r.ankle, r.heel, r.toe])
    }
}

/// Rounds to millimetres, because more digits would identify a gait.
fn millimetres(metres: f64) -> f64 {
    (metres * 1000.0).round() / 1000.0
}
