//! The figures of a trial: its gait, its solve, and its gait beside that of another trial.

use crate::shared_state::AppState;
use gait_optimizer::gait::stick_figure::stick_figures;
use gait_optimizer::{Gait, ReferenceGait};
use gaitwright_charts::{Figure, GaitWalker, gait_charts};
use gaitwright_compute::OnPool;
use gaitwright_service::error::Error;
use gaitwright_service::studies::preference_answer;
use gaitwright_store::{TrialId, gaits, other_local_optima, reference_gaits, studies, trials};

/// Every figure of the page of a gait; while its solve runs, the solver progress.
///
/// # Errors
/// [`Error::NotFound`]; errors of the database.
pub(crate) async fn of_trial(app: &mut AppState, id: TrialId) -> Result<Vec<Figure>, Error> {
    if let Some(running) = app.scheduler.running_solves().track(id) {
        return Ok(gait_charts::solve(&running.records).into_iter().collect());
    }
    let mut reader = app.read().await?;
    let study = trials::get(&mut reader, id).await?.study_id;
    let reference = studies::get(&mut reader, study).await?.plan.reference_gait_id;
    let reference = reference_gaits::get(&mut reader, reference).await?.definition;
    let Some(gait) = gaits::find(&mut reader, id).await? else { return Ok(Vec::new()) };
    let iterations = gaits::iterations(&mut reader, id).await?;
    drop(reader);
    let draw = move |pool: &OnPool| {
        let (gait, iterations) = (gait.unpack(pool)?, iterations.unpack(pool)?);
        let mut figures =
            vec![gait_charts::tiles(stick_figures(&gait)?), gait_charts::animation(GaitWalker::new(&gait)?)];
        for group in gait_charts::of_gait(&gait, &reference)? {
            figures.extend(group.figures);
        }
        figures.extend(gait_charts::solve(&iterations));
        Ok(figures)
    };
    app.compute(draw).await?
}

/// The figures of another local optimum of a trial.
///
/// # Errors
/// [`Error::NotFound`]; errors of the database.
pub(crate) async fn of_local_optimum(app: &mut AppState, id: TrialId, number: u32) -> Result<Vec<Figure>, Error> {
    let found = other_local_optima::get(&mut *app.read().await?, id, number).await?;
    let draw = move |pool: &OnPool| {
        let gait = found.gait.unpack(pool)?;
        Ok(vec![gait_charts::tiles(stick_figures(&gait)?), gait_charts::animation(GaitWalker::new(&gait)?)])
    };
    app.compute(draw).await?
}

/// The joint angles of two gaits of a study, as on the page that compares them.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Invalid`] for a trial of another study; errors of the database.
pub(crate) async fn of_pair(app: &mut AppState, a: TrialId, b: TrialId) -> Result<Vec<Figure>, Error> {
    let mut reader = app.read().await?;
    let trial = trials::get(&mut reader, a).await?;
    let other = preference_answer::comparable(&mut reader, trial.study_id, "other", b).await?;
    let reference = studies::get(&mut reader, trial.study_id).await?.plan.reference_gait_id;
    let reference = reference_gaits::get(&mut reader, reference).await?.definition;
    let (Some(gait_a), Some(gait_b)) = (gaits::find(&mut reader, a).await?, gaits::find(&mut reader, b).await?) else {
        return Ok(Vec::new());
    };
    drop(reader);
    let draw = move |pool: &OnPool| {
        let (gait_a, gait_b) = (gait_a.unpack(pool)?, gait_b.unpack(pool)?);
        Ok(pair((trial.number, &gait_a), (other.number, &gait_b), &reference))
    };
    app.compute(draw).await?
}

/// The joint angles of two gaits, named by their trials, over the reference gait.
pub(crate) fn pair((a, gait_a): (u32, &Gait), (b, gait_b): (u32, &Gait), reference: &ReferenceGait) -> Vec<Figure> {
    let (a, b) = (format!("first: trial {a}"), format!("second: trial {b}"));
    let charts = gait_charts::with_reference(&[(&a, gait_a), (&b, gait_b)], reference);
    charts.into_iter().map(|chart| Figure::chart("pair", chart)).collect()
}
