//! An atlas: the gait of every action, from one root gait. It does not depend on the number of workers, and a killed process can
//! continue it. The command `atlas` makes that of Table I in a file; a study makes one in the record.

mod action_map;
mod best_certified_gait;
mod family;
mod gait_map;
mod gait_values;
mod of_study;
mod progress;
mod progress_file;
mod solved_action;
mod study_atlas;

pub use best_certified_gait::{BestCertifiedGait, BestCertifiedGaitSearch};
pub use gait_map::{AtlasRow, GaitMap};
pub use gait_values::GaitValues;
pub use of_study::atlas_of;
pub(super) use of_study::{AtlasStep, next_of, representative};
pub use progress::{AtlasProgress, progress};
pub use solved_action::SolvedAction;
pub use study_atlas::{AtlasResult, StudyAtlas};

use super::bound_grid;
use super::problem_file::SolveInput;
use crate::error::Error;
use family::Family;
use gait_learner::ActionIndex;
use gait_optimizer::{CancelToken, GaitProblem, SolveOptions, SolveStatus, TunedBounds, WarmStart, solve};
use gaitwright_compute::OnPool;
use progress_file::ProgressFile;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Makes or continues an atlas. `start` is the warm start of the root, which otherwise is a cold start; `progress` keeps the
/// solves until [`Finished::forget_progress`]. Calls `observer` before each batch. `None` if cancelled.
///
/// # Errors
/// If the default bounds have no gait, or the progress file belongs to another problem or cannot be written.
pub fn make(
    _: &OnPool,
    (problem, options, start): (GaitProblem, SolveOptions, Option<WarmStart>),
    progress: &Path,
    workers: usize,
    observer: &mut dyn FnMut(&GaitMap),
    cancel: &CancelToken,
) -> Result<Option<Finished>, Error> {
    let Some(root) = root(&problem, &options, start.as_ref(), cancel)? else { return Ok(None) };
    let family = Family { problem, options, root: root.point };
    let input =
        SolveInput { problem: family.problem.clone(), options: family.options, warm_start: Some(family.root.clone()) };
    let mut progress = ProgressFile::open(progress, &input)?;
    let space = bound_grid::table_i().map_err(Error::Learner)?;
    let action = bound_grid::nearest_action(&space, family.problem.bounds).map_err(Error::Learner)?;
    let mut map = GaitMap::new(space, SolvedAction { action, ..root.solved });
    let is_complete = solve_all(&family, &mut map, &mut progress, workers, observer, cancel)?;
    Ok(is_complete.then_some(Finished { map, family, progress }))
}

/// A complete atlas.
pub struct Finished {
    /// The gait of each action.
    pub map: GaitMap,
    family: Family,
    progress: ProgressFile,
}

impl Finished {
    /// Certifies the gaits, the lowest Gait RMSE first, until one passes. Calls `observer` with the number of each gait before
    /// its certificate.
    ///
    /// # Errors
    /// Errors of the optimiser.
    pub fn best_certified_gait(
        &self,
        pool: &OnPool,
        observer: &mut dyn FnMut(u32),
        cancel: &CancelToken,
    ) -> Result<BestCertifiedGaitSearch, Error> {
        best_certified_gait::search(pool, &self.family, &self.map, observer, cancel)
    }

    /// Deletes the progress file, once the atlas was written elsewhere.
    ///
    /// # Errors
    /// If it cannot be deleted.
    pub fn forget_progress(self) -> std::io::Result<()> {
        self.progress.remove()
    }
}

/// The root gait.
struct Root {
    point: WarmStart,
    solved: SolvedAction,
}

/// Solves for the gait of the default bounds. `None` if cancelled.
fn root(
    problem: &GaitProblem,
    options: &SolveOptions,
    start: Option<&WarmStart>,
    cancel: &CancelToken,
) -> Result<Option<Root>, Error> {
    let outcome = solve(problem, start, options, &mut |_| {}, cancel)?;
    if cancel.is_cancelled() {
        return Ok(None);
    }
    if outcome.report.status != SolveStatus::Converged {
        let why = "No gait was found with the default bounds and these settings, so there is no root gait.";
        return Err(Error::Malformed(why.to_owned()));
    }
    let solved = SolvedAction::of(ActionIndex(0), &outcome, &problem.reference)?;
    Ok(Some(Root { point: outcome.warm_start, solved }))
}

/// Solves in batches until every action has a gait or a failed solve. Returns whether it got there.
fn solve_all(
    family: &Family,
    map: &mut GaitMap,
    progress: &mut ProgressFile,
    workers: usize,
    observer: &mut dyn FnMut(&GaitMap),
    cancel: &CancelToken,
) -> Result<bool, Error> {
    loop {
        observer(map);
        let batch = map.next_batch();
        if batch.is_empty() {
            return Ok(true);
        }
        let known = progress.take(&batch);
        let missing: Vec<ActionIndex> = batch[known.len()..].to_vec();
        let solved = solve_batch(family, map, &missing, workers, cancel)?;
        if cancel.is_cancelled() {
            return Ok(false);
        }
        progress.append(&solved)?;
        for solved in known.into_iter().chain(solved) {
            map.add(solved);
        }
    }
}

/// The solves of a batch, in its order.
fn solve_batch(
    family: &Family,
    map: &GaitMap,
    batch: &[ActionIndex],
    workers: usize,
    cancel: &CancelToken,
) -> Result<Vec<SolvedAction>, Error> {
    let bounds = batch.iter().map(|action| map.bounds_of(family.problem.bounds, *action));
    let bounds: Vec<TunedBounds> = bounds.collect::<Result<_, _>>()?;
    let next = AtomicUsize::new(0);
    let solved: Vec<Mutex<Option<Result<SolvedAction, Error>>>> = batch.iter().map(|_| Mutex::new(None)).collect();
    std::thread::scope(|scope| {
        for _ in 0..workers.min(batch.len()) {
            scope.spawn(|| {
                loop {
                    let place = next.fetch_add(1, Ordering::Relaxed);
                    let (Some(action), Some(bounds)) = (batch.get(place), bounds.get(place)) else { return };
                    let problem = GaitProblem { bounds: *bounds, ..family.problem.clone() };
                    let outcome = solve(&problem, Some(&family.root), &family.options, &mut |_| {}, cancel);
                    let found = outcome
                        .map_err(Error::from)
                        .and_then(|outcome| SolvedAction::of(*action, &outcome, &problem.reference));
                    *solved[place].lock().unwrap_or_else(PoisonError::into_inner) = Some(found);
                }
            });
        }
    });
    solved.into_iter().filter_map(|slot| slot.into_inner().unwrap_or_else(PoisonError::into_inner)).collect()
}
