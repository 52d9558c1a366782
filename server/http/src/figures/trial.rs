//! The figures of a trial: its gait, its solve, and its gait under those of other trials.

use crate::shared_state::AppState;
use gait_optimizer::gait::stick_figure::stick_figures;
use gait_optimizer::{Gait, ReferenceGait};
use gaitwright_charts::{Figure, GaitWalker, gait_charts};
use gaitwright_compute::OnPool;
use gaitwright_service::error::Error;
use gaitwright_service::studies::overlaid_gaits;
use gaitwright_store::trials::Trial;
use gaitwright_store::{Connection, Packed, TrialId, gaits, other_local_optima, reference_gaits, studies, trials};

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

/// The gait of a trial and those of other trials of its study, in the same charts.
pub(crate) struct OverlaidGaits(Vec<(u32, Packed<Gait>)>);

impl OverlaidGaits {
    /// # Errors
    /// [`Error::NotFound`], [`Error::Invalid`] for a trial whose gait cannot be overlaid on the first one.
    pub(crate) async fn read(db: &mut Connection, trial: &Trial, others: &[TrialId]) -> Result<Self, Error> {
        let others = overlaid_gaits::others(db, trial, "other", others).await?;
        let mut gaits = Vec::new();
        for trial in std::iter::once(trial).chain(&others) {
            gaits.push((trial.number, gaits::get(db, trial.id).await?));
        }
        Ok(Self(gaits))
    }

    /// Joint angles over those of the reference gait, torques and powers.
    ///
    /// # Errors
    /// If a gait cannot be read.
    pub(crate) fn draw(&self, pool: &OnPool, reference: &ReferenceGait) -> Result<Vec<gait_charts::Group>, Error> {
        let gaits = self.0.iter().map(|(number, gait)| Ok((format!("trial {number}"), gait.unpack(pool)?)));
        let gaits: Vec<(String, Gait)> = gaits.collect::<Result<_, Error>>()?;
        let named: Vec<(&str, &Gait)> = gaits.iter().map(|(name, gait)| (name.as_str(), gait)).collect();
        Ok(gait_charts::of_several(&named, reference))
    }
}

/// The figures in which other gaits are overlaid on that of a trial, as on its page and on the page that compares two gaits.
///
/// # Errors
/// As [`OverlaidGaits::read`]; errors of the database.
pub(crate) async fn of_several(app: &mut AppState, id: TrialId, others: &[TrialId]) -> Result<Vec<Figure>, Error> {
    let mut reader = app.read().await?;
    let trial = trials::get(&mut reader, id).await?;
    let reference = studies::get(&mut reader, trial.study_id).await?.plan.reference_gait_id;
    let reference = reference_gaits::get(&mut reader, reference).await?.definition;
    let gaits = OverlaidGaits::read(&mut reader, &trial, others).await?;
    drop(reader);
    let draw =
        move |pool: &OnPool| Ok(gaits.draw(pool, &reference)?.into_iter().flat_map(|group| group.figures).collect());
    app.compute(draw).await?
}

/// The joint angles of two gaits, named by their places on a page and their trials, over the reference gait.
pub(crate) fn pair((a, gait_a): (u32, &Gait), (b, gait_b): (u32, &Gait), reference: &ReferenceGait) -> Vec<Figure> {
    let (a, b) = (format!("first: trial {a}"), format!("second: trial {b}"));
    let charts = gait_charts::with_reference(&[(&a, gait_a), (&b, gait_b)], reference);
    charts.into_iter().map(|chart| Figure::chart("angles", chart)).collect()
}
