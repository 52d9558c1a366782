//! Continuation: the gait of an action within a family, followed from the root of the family along a straight line of
//! tuned bounds.
//!
//! Regular solutions are continuous in the bounds, also where constraints become active or inactive (Guddat, Guerra Vazquez
//! and Jongen, *Parametric Optimization: Singularities, Pathfollowing and Jumps*, 1990). A step that is halved often enough
//! therefore changes the gait as little as one likes, unless the path ends. A step is accepted if its solve converges within
//! [`MOST_ITERATIONS`] and the joint angles change by at most [`MOST_CHANGE_RAD`]. If a step of [`SHORTEST_STEP`] is refused,
//! the path ends there: this is called a fold, and the reason says which of the two conditions failed.

use super::error::SolveError;
use super::phases::AttemptRun;
use super::progress::SolvePhase;
use super::report::SolveStatus;
use super::warm_start::WarmStart;
use crate::gait_problem::{GaitProblem, GaitProgramme};
use crate::subject::ModelError;
use crate::tuned_bounds::TunedBounds;
use interior_point::{NlpResult, NlpStatus, WarmPoint};
use serde::{Deserialize, Serialize};

/// First step, as a share of the path.
const FIRST_STEP: f64 = 0.25;
/// Shortest step.
const SHORTEST_STEP: f64 = 1.0 / 128.0;
/// Most iterations of a step.
const MOST_ITERATIONS: usize = 25;
/// Iterations up to which the next step is longer.
const FEW_ITERATIONS: usize = 10;
/// Largest change of the joint angles in a step: root mean square over nodes and joints, rad.
const MOST_CHANGE_RAD: f64 = 0.02;

/// The gait from which a family is followed.
#[derive(Debug, Clone, PartialEq)]
pub struct Root {
    /// Its tuned bounds.
    pub bounds: TunedBounds,
    /// Its solution.
    pub solution: WarmStart,
}

/// How a gait was followed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FollowedPath {
    /// Number of accepted steps.
    pub steps: usize,
    /// Number of steps that were refused and halved.
    pub refused_steps: usize,
    /// Largest change of the joint angles in an accepted step: root mean square over nodes and joints, rad.
    pub largest_change_rad: f64,
    /// Where the path ends before the action.
    pub fold: Option<Fold>,
}

/// The end of a path: beyond it, no gait is near.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Fold {
    /// Share of the path from the root to the action.
    pub share: f64,
    /// The tuned bounds of the last gait of the path.
    pub bounds: TunedBounds,
    /// Why the next step was refused.
    pub reason: FoldReason,
}

/// Why a step was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FoldReason {
    /// Its solve did not converge within a few iterations.
    NoGait,
    /// Its gait is another one, far from the previous one.
    Jump,
}

/// Follows the gait of a programme.
pub(super) struct Follower<'a> {
    pub(super) problem: &'a GaitProblem,
    pub(super) programme: &'a GaitProgramme,
    /// The tuned bounds of the root.
    pub(super) from: TunedBounds,
}

impl Follower<'_> {
    /// The tuned bounds at a share of the path.
    fn bounds_at(&self, share: f64) -> Result<TunedBounds, ModelError> {
        if share >= 1.0 {
            return Ok(self.problem.bounds);
        }
        let (from, to) = (self.from.to_array(), self.problem.bounds.to_array());
        TunedBounds::from_array(std::array::from_fn(|i| from[i] + share * (to[i] - from[i])))
    }

    fn programme_at(&self, share: f64) -> Result<GaitProgramme, ModelError> {
        Ok(self.programme.with_bounds(&self.problem.device, &self.bounds_at(share)?))
    }

    /// The result for the bounds of the problem, or an interrupted one.
    pub(super) fn follow(
        &self,
        run: &mut AttemptRun<'_>,
        start: WarmPoint,
    ) -> Result<(NlpResult, FollowedPath), SolveError> {
        let mut path = FollowedPath { steps: 0, refused_steps: 0, largest_change_rad: 0.0, fold: None };
        // The root without tightened bounds.
        let mut now = run.warm(SolvePhase::Cost, &self.programme_at(0.0)?, start)?;
        if AttemptRun::interrupted(&now) {
            return Ok((now, path));
        }
        if now.status != NlpStatus::Converged {
            return Err(SolveError::RootWithoutGait(SolveStatus::from(now.status)));
        }
        let (mut share, mut step) = (0.0, FIRST_STEP);
        while share < 1.0 {
            let next = if share + step >= 1.0 { 1.0 } else { share + step };
            let before = run.iterations;
            run.most_iterations = MOST_ITERATIONS;
            let found = run.warm(SolvePhase::Cost, &self.programme_at(next)?, now.warm_point())?;
            run.most_iterations = usize::MAX;
            if AttemptRun::interrupted(&found) {
                return Ok((found, path));
            }
            let change = self.change_rad(&now.x, &found.x);
            let converged = found.status == NlpStatus::Converged;
            if converged && change <= MOST_CHANGE_RAD {
                path.steps += 1;
                path.largest_change_rad = path.largest_change_rad.max(change);
                (share, now) = (next, found);
                if run.iterations - before <= FEW_ITERATIONS {
                    step *= 2.0;
                }
                continue;
            }
            path.refused_steps += 1;
            if step <= SHORTEST_STEP {
                let reason = if converged { FoldReason::Jump } else { FoldReason::NoGait };
                path.fold = Some(Fold { share, bounds: self.bounds_at(share)?, reason });
                now = run.warm(SolvePhase::Cost, self.programme, now.warm_point())?;
                break;
            }
            step *= 0.5;
        }
        Ok((now, path))
    }

    /// Root mean square of the change of the angles of torso and joints over all nodes, rad.
    fn change_rad(&self, one: &[f64], other: &[f64]) -> f64 {
        let layout = &self.programme.layout;
        let (mut sum, mut count) = (0.0, 0_u32);
        for (d, domain) in layout.domains.iter().enumerate() {
            for k in 0..domain.points {
                let (one, other) = (layout.point_variables(one, d, k), layout.point_variables(other, d, k));
                for (one, other) in one.q[2..].iter().zip(&other.q[2..]) {
                    sum += (one - other).powi(2);
                    count += 1;
                }
            }
        }
        (sum / f64::from(count.max(1))).sqrt()
    }
}
