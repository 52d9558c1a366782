//! Checks the trials of an imported archive: their values, gaits and results.

use super::context::Context;
use crate::studies::{bound_grid, simulated_walks, trial_transitions};
use gait_optimizer::gait::progress_error_m;
use gait_optimizer::solve::CONVERGED_VIOLATION;
use gait_optimizer::{Gait, GaitResults, ReferenceGait, WarmStart};
use gaitwright_compute::{OnPool, Pool};
use gaitwright_store::studies::StudyPlan;
use gaitwright_store::trials::{Label, Trial, TrialState};
use gaitwright_store::{Connection, StoreError, attempts, gaits};
use std::sync::Arc;

/// Tolerance for the hip position that follows from the durations of a converged gait, m: ten times that of a row. The
/// certificate cannot check the duration of SS1, because the closed loop has no clock there.
const HIP_PROGRESS_M: f64 = 1e-5;

/// Checks an action, and the results of a trial against its state and its report.
pub(super) fn values(trial: &Trial, plan: &StudyPlan) -> Result<(), String> {
    if trial.action_index.0 >= plan.search_space.len() {
        return Err(format!("action_index {} is not in the search space", trial.action_index.0));
    }
    let action = bound_grid::bounds_of(&plan.search_space, plan.base_bounds, trial.action_index);
    if action.map_err(|e| e.to_string())? != trial.action {
        return Err("the action does not match its index".to_owned());
    }
    let results = [
        ("gait_rmse_rad", trial.gait_rmse_rad),
        ("cost_of_transport", trial.cost_of_transport),
        ("mean_strides", trial.mean_strides),
        ("max_violation", trial.max_violation),
        ("seconds_total", trial.seconds_total),
    ];
    for (field, value) in results.iter().filter_map(|(field, value)| Some((field, (*value)?))) {
        if !value.is_finite() || value < 0.0 {
            return Err(format!("{field} is {value}; it must be a finite number of at least 0"));
        }
    }
    if trial.script.is_some() || !trial.state.is_result() {
        let none = trial.report.is_none() && trial.status.is_none() && trial.mean_strides.is_none();
        return if none { Ok(()) } else { Err("it has a solve report or a status, but no solve".to_owned()) };
    }
    let walks = &plan.simulated_walks;
    let solved = trial.status.and_then(trial_transitions::label_of);
    let state = solved.map(|label| match label {
        Label::Converged => simulated_walks::label_of_gait(walks, trial.mean_strides),
        other => other,
    });
    let state = state.map(TrialState::from);
    if state != Some(trial.state) {
        let status = serde_json::json!(trial.status);
        return Err(format!("the status {status} contradicts the state {}", trial.state.as_str()));
    }
    if trial.mean_strides.is_some() != (trial.state.has_gait() && walks.effect.is_part_of_result()) {
        return Err("its mean_strides contradict the setting simulated_walks of the study".to_owned());
    }
    let Some(report) = &trial.report else {
        return if trial.state.has_gait() { Err("the solve report is missing".to_owned()) } else { Ok(()) };
    };
    let converged = trial.state.has_gait();
    let of_gait = |figure: f64| converged.then_some(figure);
    let same = Some(report.status) == trial.status
        && trial.gait_rmse_rad == of_gait(report.gait_rmse_rad)
        && trial.cost_of_transport == of_gait(report.cost_of_transport)
        && trial.objective == Some(report.objective)
        && trial.max_violation == Some(report.max_violation)
        && trial.iterations.is_some_and(|count| count as usize == report.iterations)
        && trial.seconds_total == Some(report.seconds_total);
    if !same {
        return Err("its results differ from its solve report".to_owned());
    }
    if converged && report.max_violation > CONVERGED_VIOLATION {
        return Err(format!("its state is converged, but its violation is {}", report.max_violation));
    }
    Ok(())
}

/// Checks the gait of a trial and computes its Gait RMSE again. Returns whether the trial has a gait.
pub(super) async fn gait(
    db: &mut Connection,
    pool: &Pool,
    trial: &Trial,
    context: &Arc<Context>,
) -> Result<bool, String> {
    let text = |error: StoreError| error.finding();
    if !gaits::exists(db, trial.id).await.map_err(text)? {
        return Ok(false);
    }
    if trial.script.is_some() || !trial.state.is_result() {
        return Err("it has a gait but no solve".to_owned());
    }
    let gait = gaits::get(db, trial.id).await.map_err(text)?;
    let warm_start = gaits::warm_start(db, trial.id).await.map_err(text)?;
    let iterations = gaits::iterations(db, trial.id).await.map_err(text)?;
    let (trial, context) = (trial.clone(), Arc::clone(context));
    let id = trial.id;
    let checked = move |pool: &OnPool| {
        let gait = gait.unpack(pool).map_err(text)?;
        let warm_start = warm_start.unpack(pool).map_err(text)?;
        iterations.unpack(pool).map_err(text)?;
        solved(&trial, &context, &gait, &warm_start)?;
        Ok::<_, String>(gait)
    };
    let gait = pool.run(checked).await.map_err(|e| e.to_string())??;
    if !gaits::is_described(db, id, &gait).await.map_err(text)? {
        return Err("its gait does not match its row".to_owned());
    }
    Ok(true)
}

/// Checks the stored outcome of a solve against its trial.
fn solved(trial: &Trial, context: &Context, gait: &Gait, warm_start: &WarmStart) -> Result<(), String> {
    gait.validate().map_err(|e| e.to_string())?;
    if gait.subject != context.body {
        return Err("its gait belongs to a subject with a different height or body mass".to_owned());
    }
    let plan = &context.study.plan;
    if gait.device != context.device
        || gait.muscles != plan.muscles
        || gait.settings != *plan.gait_settings
        || gait.bounds != trial.action
    {
        return Err("its gait belongs to another device, problem or action".to_owned());
    }
    if warm_start.muscles != plan.muscles || warm_start.mesh != plan.gait_settings.mesh {
        return Err("its warm start belongs to another problem".to_owned());
    }
    same_values(trial, gait, &context.reference)?;
    if trial.state.has_gait() {
        let error = progress_error_m(gait).map_err(|e| e.to_string())?;
        let follows = error <= HIP_PROGRESS_M;
        if !follows {
            return Err(format!("the durations of its gait do not match its motion: the hip is off by {error:.1e} m"));
        }
    }
    Ok(())
}

/// Checks every stated value that the gait determines. Safety reports recognise a motion by these values.
fn same_values(trial: &Trial, gait: &Gait, reference: &ReferenceGait) -> Result<(), String> {
    let Some(report) = &trial.report else { return Ok(()) };
    let anew = GaitResults::of(gait, reference).map_err(|e| e.to_string())?;
    match GaitResults::of_report(report).difference(&anew) {
        Some((name, stated, anew)) => Err(format!("its stated {name} is {stated}, but its gait gives {anew}")),
        None => Ok(()),
    }
}

/// Checks the results that workers delivered for a trial.
pub(super) async fn check_results(db: &mut Connection, trial: &Trial) -> Result<(), String> {
    let results = attempts::of_trial(db, trial.id).await.map_err(|e| e.finding())?;
    let mut used = results.iter().filter(|result| result.used);
    let Some(result) = used.next() else { return Ok(()) };
    if used.next().is_some() {
        return Err("two results were accepted".to_owned());
    }
    if Some(result.status) != trial.status || result.report != trial.report {
        return Err("its result differs from the accepted one".to_owned());
    }
    Ok(())
}
