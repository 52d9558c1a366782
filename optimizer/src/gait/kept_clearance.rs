//! The swing-foot clearance that a gait keeps.

use super::Gait;
use super::stick_figure::stick_figure;
use crate::body::{Side, WalkerModel};
use crate::model_error::ModelError;
use crate::walking::{CYCLE, DomainKind, clearance_profile};

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
