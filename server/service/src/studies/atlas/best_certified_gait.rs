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
    use gait_learner::ActionIndex;
    use gait_optimizer::{GaitSettings, SolveOptions, Subject, TunedBounds};
    use gaitwright_compute::Pool;
    use std::collections::BTreeSet;

    /// The solve of the default bounds, and a map with the gaits of these actions.
    fn atlas(settings: &GaitSettings, actions: &[u64]) -> (Family, GaitMap) {
        let mut problem = GaitProblem::new(Subject::builtin(1).unwrap(), false).unwrap();
        problem.settings = *settings;
        let (options, cancel) = (SolveOptions::default(), CancelToken::default());
        let space = bound_grid::table_i().unwrap();
        let root = solve(&problem, None, &options, &mut |_| {}, &cancel).unwrap();
        let nearest = bound_grid::nearest_action(&space, TunedBounds::default()).unwrap();
        let mut map = GaitMap::new(space, SolvedAction::of(nearest, &root, &problem.reference).unwrap());
        let family = Family { problem, options, root: root.warm_start };
        for action in actions.iter().copied().map(ActionIndex) {
            let bounds = map.bounds_of(family.problem.bounds, action).unwrap();
            let problem = GaitProblem { bounds, ..family.problem.clone() };
            let outcome = solve(&problem, Some(&family.root), &family.options, &mut |_| {}, &cancel).unwrap();
            map.add(SolvedAction::of(action, &outcome, &problem.reference).unwrap());
        }
        (family, map)
    }

    fn found(family: Family, map: GaitMap) -> BestCertifiedGaitSearch {
        let runtime = tokio::runtime::Runtime::new().unwrap();
        let search = move |pool: &OnPool| search(pool, &family, &map, &mut |_| {}, &CancelToken::default());
        runtime.block_on(Pool::new(1).run(search)).unwrap().unwrap()
    }

    /// The certificates of all gaits are computed here, without the search.
    #[test]
    fn best_gait_is_the_certified_one_with_the_lowest_gait_rmse() {
        let (family, map) = atlas(&GaitSettings::default(), &[0, 4000, 8000, 11_000]);
        let (mut table, mut numbers) = (Vec::new(), BTreeSet::new());
        // Each gait is that of many actions.
        for row in map.rows().filter(|row| row.number.is_some_and(|number| numbers.insert(number))) {
            let bounds = map.bounds_of(family.problem.bounds, row.solved.action).unwrap();
            let problem = GaitProblem { bounds, ..family.problem.clone() };
            let options = &family.options;
            let outcome = solve(&problem, Some(&family.root), options, &mut |_| {}, &CancelToken::default()).unwrap();
            let passed = certify(&outcome.gait).unwrap().passed;
            table.push((outcome.report.gait_rmse_rad, row.number.unwrap(), passed));
        }
        table.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        assert!(table.len() > 2, "{table:?}");
        let place = table.iter().position(|(_, _, passed)| *passed).unwrap();
        let BestCertifiedGaitSearch::Found { best, failed } = found(family, map) else { panic!("{table:?}") };
        let (rmse, number, _) = table[place];
        assert_eq!((best.number, best.outcome.report.gait_rmse_rad, failed), (number, rmse, place), "{table:?}");
        assert!(best.certificate.passed);
    }

    #[test]
    fn gaits_on_a_mesh_that_is_too_coarse_are_not_certified() {
        let mut settings = GaitSettings::default();
        (settings.mesh.ds2, settings.mesh.ds3, settings.mesh.ss2, settings.mesh.ss1) = (2, 2, 3, 3);
        let (family, map) = atlas(&settings, &[]);
        assert!(matches!(found(family, map), BestCertifiedGaitSearch::NoneCertified));
    }

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
