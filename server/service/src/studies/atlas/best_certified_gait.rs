//! The gait of an atlas with the lowest Gait RMSE among those that pass their certificate.

use super::family::Family;
use super::gait_map::GaitMap;
use super::solved_action::SolvedAction;
use crate::error::Error;
use gait_optimizer::certificate::{Certificate, certify};
use gait_optimizer::{CancelToken, GaitProblem, SolveOutcome, SolveStatus, solve};
use gaitwright_compute::OnPool;

/// A gait with its certificate.
#[derive(Debug)]
pub struct BestCertifiedGait {
    /// Its number in the atlas.
    pub number: u32,
    /// Its solve, repeated from the root gait.
    pub outcome: SolveOutcome,
    /// Its certificate, which it passes.
    pub certificate: Certificate,
}

/// How the search for the best gait ended.
#[derive(Debug)]
pub enum BestCertifiedGaitSearch {
    /// A gait passed. `failed` gaits with a lower Gait RMSE did not.
    Found {
        /// The gait.
        best: Box<BestCertifiedGait>,
        /// Number of gaits before it that failed their certificates.
        failed: usize,
    },
    /// No gait of the atlas passes its certificate.
    NoneCertified,
    /// Cancelled before a gait passed.
    Cancelled,
}

/// Solves the gaits again from the root, the lowest Gait RMSE first, until one passes its certificate.
pub(super) fn search(
    _: &OnPool,
    family: &Family,
    map: &GaitMap,
    observer: &mut dyn FnMut(u32),
    cancel: &CancelToken,
) -> Result<BestCertifiedGaitSearch, Error> {
    for (failed, (number, solved)) in by_gait_rmse(map).into_iter().enumerate() {
        observer(number);
        let bounds = map.bounds_of(family.problem.bounds, solved.action)?;
        let problem = GaitProblem { bounds, ..family.problem.clone() };
        let outcome = solve(&problem, Some(&family.root), &family.options, &mut |_| {}, cancel)?;
        if cancel.is_cancelled() {
            return Ok(BestCertifiedGaitSearch::Cancelled);
        }
        if outcome.report.status != SolveStatus::Converged {
            let why = "this time the solve did not converge. With a time limit, a result depends on the speed of the machine.";
            return Err(Error::Malformed(format!("Gait {number} was solved again, and {why}")));
        }
        let certificate = certify(&outcome.gait)?;
        if certificate.passed {
            let best = Box::new(BestCertifiedGait { number, outcome, certificate });
            return Ok(BestCertifiedGaitSearch::Found { best, failed });
        }
    }
    Ok(BestCertifiedGaitSearch::NoneCertified)
}

/// The gaits and their numbers, the lowest Gait RMSE first, then the lowest number.
fn by_gait_rmse(map: &GaitMap) -> Vec<(u32, &SolvedAction)> {
    let mut gaits: Vec<(f64, u32, &SolvedAction)> =
        map.rows().filter_map(|row| Some((row.solved.gait.as_ref()?.gait_rmse_rad, row.number?, row.solved))).collect();
    gaits.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    gaits.dedup_by_key(|gait| gait.1);
    gaits.into_iter().map(|(_, number, solved)| (number, solved)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::gait_map::tests::solved;
    use super::*;
    use crate::studies::bound_grid;

    #[test]
    fn gaits_are_tried_once_each_in_the_order_of_gait_rmse() {
        let space = bound_grid::table_i().unwrap();
        let with_rmse = |action, free: &[&str], rmse| {
            let mut solved = solved(&space, action, free, true);
            solved.gait.as_mut().unwrap().gait_rmse_rad = rmse;
            solved
        };
        let mut map = GaitMap::new(space.clone(), with_rmse(0, &["a8"], 0.7));
        map.add(with_rmse(100, &[], 0.5));
        map.add(solved(&space, 200, &[], false));
        map.add(with_rmse(300, &["a8"], 0.6));
        map.add(with_rmse(400, &[], 0.5));
        let order: Vec<(u32, u64)> = by_gait_rmse(&map).iter().map(|(n, solved)| (*n, solved.action.0)).collect();
        assert_eq!(order, [(2, 100), (4, 400), (3, 300), (1, 0)]);
    }
}
