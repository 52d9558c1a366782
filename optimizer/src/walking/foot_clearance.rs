//! Swing-foot clearance: `z >= c (4 w (1 - w))^2` for heel and toe, with w from 0 at the start to 1 at the end of the
//! swing.

use super::domain::{CYCLE, DomainKind};
use super::stick_figure::stick_figure;
use crate::body::{Side, WalkerModel};
use crate::gait::Gait;
use crate::model_error::ModelError;

/// The profile `(4 w (1 - w))^2` with its first two derivatives.
pub(crate) fn clearance_profile(w: f64) -> [f64; 3] {
    let bump = 4.0 * w * (1.0 - w);
    let slope = 4.0 * (1.0 - 2.0 * w);
    [bump * bump, 2.0 * bump * slope, 2.0 * slope * slope - 16.0 * bump]
}

/// The largest clearance `c` that a gait satisfies at every node of both swings, m. `None` for a gait without a swing.
///
/// # Errors
/// [`ModelError`] if subject or device of the gait is invalid.
pub fn kept_clearance_m(gait: &Gait) -> Result<Option<f64>, ModelError> {
    let model = WalkerModel::new(&gait.subject, &gait.device)?;
    let mut kept: Option<f64> = None;
    let cycle = CYCLE.iter().zip(&gait.domains);
    let pairs = cycle.clone().zip(cycle.skip(1));
    for ((domain, first), (_, second)) in pairs.filter(|((domain, _), _)| domain.kind == DomainKind::Ss2) {
        let duration = first.duration_s + second.duration_s;
        let Some(&begin) = first.time_s.first() else { continue };
        let points = [first, second].into_iter().flat_map(|part| part.time_s.iter().zip(&part.q));
        for (&time_s, q) in points {
            let [profile, ..] = clearance_profile((time_s - begin) / duration);
            // The profile vanishes at the ends of the swing.
            if profile < 1e-6 {
                continue;
            }
            let figure = stick_figure(&model, time_s, q);
            let foot = match domain.stance.other() {
                Side::Left => figure.left,
                Side::Right => figure.right,
            };
            let clearance = foot.heel[1].min(foot.toe[1]) / profile;
            kept = Some(kept.map_or(clearance, |least| least.min(clearance)));
        }
    }
    Ok(kept)
}

#[cfg(test)]
mod tests {
    use super::clearance_profile;

    #[test]
    fn profile_is_one_at_mid_swing_and_zero_at_the_ends() {
        assert_eq!([0.0, 0.5, 1.0].map(|w| clearance_profile(w)[0]), [0.0, 1.0, 0.0]);
    }
}
