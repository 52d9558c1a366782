//! The sensitivities of one trial's gait, computed from its stored solution.

use super::problem_file::PackedInput;
use super::trial_transitions::has_state;
use crate::error::Error;
use gait_learner::SearchSpace;
use gait_optimizer::sensitivity::{BoundSensitivity, GaitSensitivities, GaitSensitivityError, sensitivities};
use gait_optimizer::{TunedBounds, WarmStart};
use gaitwright_compute::OnPool;
use gaitwright_store::trials::Trial;
use gaitwright_store::{Connection, Packed, gaits, studies};

/// Largest number of mesh intervals, over the four kinds of domain, of a gait whose sensitivities a request computes:
/// their time grows with the number of intervals, and stays below a second here.
const MAX_INTERVALS: usize = 80;

/// The solution of a trial, still compressed.
#[derive(Debug)]
pub struct PackedSolution {
    input: PackedInput,
    solution: Packed<WarmStart>,
    space: SearchSpace,
}

/// The sensitivities of a gait, and what they predict for the search space of its study.
#[derive(Debug)]
pub struct StudySensitivities {
    /// The sensitivities.
    pub found: GaitSensitivities,
    /// One step of each bound in the search space; `None` if the study does not tune the bound.
    pub steps: Vec<Option<BoundStep>>,
}

/// One step of a bound in the search space, and the first-order changes in the results.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundStep {
    /// The next stricter value of the search space, or the next looser one if the bound is already at its strictest
    /// value.
    pub to: f64,
    /// Change in the mechanical cost of transport.
    pub cost_of_transport: f64,
    /// Change in Gait RMSE, rad.
    pub gait_rmse_rad: f64,
    /// Whether the same constraints stay active up to this value, to first order.
    pub keeps_active: bool,
}

/// Reads the solution of a trial.
///
/// # Errors
/// [`Error::Conflict`] with the reason if the trial has no sensitivities; errors of the database.
pub async fn solution(db: &mut Connection, trial: &Trial) -> Result<PackedSolution, Error> {
    let number = trial.number;
    if trial.script.is_some() {
        return Err(Error::conflict(format!(
            "Trial {number} was evaluated by a script, so its gait is not stored here and sensitivities cannot be computed."
        )));
    }
    if !trial.state.has_gait() {
        let state = has_state(trial.state);
        return Err(Error::conflict(format!("Trial {number} {state}. Only a converged gait has sensitivities.")));
    }
    if !gaits::exists(db, trial.id).await? {
        return Err(Error::conflict(format!(
            "The trajectory of trial {number} was deleted to save space, so its sensitivities can no longer be computed."
        )));
    }
    let plan = studies::get(db, trial.study_id).await?.plan;
    let mesh = plan.gait_settings.mesh;
    let intervals = mesh.ds2 + mesh.ds3 + mesh.ss2 + mesh.ss1;
    if intervals > MAX_INTERVALS {
        return Err(Error::conflict(format!(
            "The mesh of trial {number} has {intervals} intervals. The service computes sensitivities for at most {MAX_INTERVALS} intervals; \
             for a finer mesh, download the problem file of the trial and run `gaitwright solve --problem problem.json --sensitivities`."
        )));
    }
    let input = PackedInput::of(db, &plan, trial.action, None).await?;
    Ok(PackedSolution { input, solution: gaits::warm_start(db, trial.id).await?, space: plan.search_space })
}

impl PackedSolution {
    /// Computes the sensitivities, which takes a fraction of a second.
    ///
    /// # Errors
    /// [`Error::Conflict`] with the reason if they cannot be computed; [`Error::Store`] if the solution is damaged.
    pub fn sensitivities(self, pool: &OnPool) -> Result<StudySensitivities, Error> {
        let Self { input, solution, space } = self;
        let input = input.unpack(pool)?;
        let found = sensitivities(&input.problem, &solution.unpack(pool)?, &input.options).map_err(refusal)?;
        let steps = found.bounds.iter().map(|bound| step(bound, &space)).collect();
        Ok(StudySensitivities { found, steps })
    }
}

/// One step of a bound in the search space.
fn step(bound: &BoundSensitivity, space: &SearchSpace) -> Option<BoundStep> {
    let values = &space.dimensions().iter().find(|dimension| dimension.name == bound.bound)?.values;
    let place = TunedBounds::NAMES.iter().position(|name| *name == bound.bound)?;
    let larger = values.iter().copied().find(|value| *value > bound.value);
    let smaller = values.iter().copied().rev().find(|value| *value < bound.value);
    let to = if TunedBounds::IS_LOWER[place] { larger.or(smaller) } else { smaller.or(larger) }?;
    let (least, most) = bound.interval;
    Some(BoundStep {
        to,
        cost_of_transport: (to - bound.value) * bound.derivatives.cost_of_transport,
        gait_rmse_rad: (to - bound.value) * bound.derivatives.gait_rmse_rad,
        keeps_active: least.is_none_or(|least| least <= to) && most.is_none_or(|most| to <= most),
    })
}

/// The error for a gait without sensitivities.
pub fn refusal(error: GaitSensitivityError) -> Error {
    match error {
        GaitSensitivityError::Solve(error) => error.into(),
        GaitSensitivityError::Sensitivity(error) => {
            Error::conflict(format!("The sensitivities of this gait cannot be computed: {error}."))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::studies::bound_grid::table_i;
    use gait_optimizer::sensitivity::ResultDerivatives;

    fn bound(bound: &'static str, value: f64, interval: (Option<f64>, Option<f64>)) -> BoundSensitivity {
        let derivatives = ResultDerivatives {
            objective: 1.0,
            cost_of_transport: 2.0,
            gait_rmse_rad: -3.0,
            speed_m_s: 0.0,
            largest_angles_rad: [0.0; 7],
            smallest_angles_rad: [0.0; 7],
        };
        BoundSensitivity { bound, value, active: Vec::new(), derivatives, interval, is_weakly_active: false }
    }

    #[test]
    fn step_goes_to_the_next_stricter_value_where_there_is_one() {
        let space = table_i().unwrap();
        let to = |name, value| step(&bound(name, value, (None, None)), &space).unwrap().to;
        assert_eq!((to("a5", 0.013), to("a5", 0.039)), (0.026, 0.026), "a lower bound is stricter the larger it is");
        assert_eq!((to("a6", 0.2), to("a6", 0.0)), (0.1, 0.1));
        assert!(step(&bound("a0", 1.0, (None, None)), &space).is_none());
    }

    #[test]
    fn changes_are_those_of_the_step_and_the_interval_limits_them() {
        let space = table_i().unwrap();
        let found = step(&bound("a5", 0.013, (Some(0.0), Some(0.02))), &space).unwrap();
        assert!((found.cost_of_transport - 0.026).abs() < 1e-12 && (found.gait_rmse_rad + 0.039).abs() < 1e-12);
        assert!(!found.keeps_active);
        assert!(step(&bound("a5", 0.013, (Some(0.0), Some(0.03))), &space).unwrap().keeps_active);
        assert!(step(&bound("a5", 0.013, (None, None)), &space).unwrap().keeps_active);
    }
}
