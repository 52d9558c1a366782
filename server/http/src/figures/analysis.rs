//! The figures of the page *Analysis*: the posterior of the learner over the search space of a study.

use super::cost_and_rmse::cost_and_rmse;
use super::maps_over_two_bounds::{AxisChoice, chosen, maps};
use super::trials_by_bound::{by_bound, parallel};
use crate::bound_units::{self, meaning};
use crate::shared_state::AppState;
use gait_learner::{Dimension, Marginal};
use gaitwright_charts::{Chart, Figure, Stroke};
use gaitwright_compute::OnPool;
use gaitwright_service::error::Error;
use gaitwright_service::studies::analysis::{Analysis, too_large_to_wait};
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::{StudyId, TrialId, feedback, studies, trials};
use std::sync::Arc;

/// Every figure of the page; empty if the page shows no analysis.
///
/// # Errors
/// [`Error::Invalid`] for a bound that is not tuned, [`Error::NotFound`], or errors of the database and the learner.
pub(crate) async fn figures(app: &mut AppState, id: StudyId, choice: AxisChoice) -> Result<Vec<Figure>, Error> {
    let AnalysisState::There(snapshot, analysis) = analysis_of(app, id).await? else { return Ok(Vec::new()) };
    let draw = move |_: &OnPool| {
        let chosen = chosen(&analysis, &choice)?;
        let mut figures = marginals(&analysis);
        figures.extend(cost_and_rmse(&snapshot, recommended(&snapshot, &analysis)));
        figures.extend(maps(&analysis, &snapshot, chosen).map_err(Error::Learner)?.figures);
        figures.extend(parallel(&snapshot, &analysis).map_err(Error::Learner)?);
        for dimension in 0..analysis.posterior.space().dimensions().len() {
            figures.extend(by_bound(&snapshot, &analysis, dimension).map_err(Error::Learner)?);
        }
        Ok(figures)
    };
    app.compute(draw).await?
}

/// The trial that the study recommends. As on its page, none before people have answered.
pub(crate) fn recommended(snapshot: &StudySnapshot, analysis: &Analysis) -> Option<TrialId> {
    let best = analysis.gaits.first().filter(|_| !snapshot.waits_for_first_answer())?;
    best.trials.first().copied()
}

/// The analysis of a study, or why the page does not show it.
pub(crate) enum AnalysisState {
    Absent(String),
    There(Box<StudySnapshot>, Arc<Analysis>),
}

pub(crate) async fn analysis_of(app: &mut AppState, id: StudyId) -> Result<AnalysisState, Error> {
    let too_many = |what: String| {
        Ok(AnalysisState::Absent(format!(
            "This page is not available for studies with {what}, because the computation would take too long."
        )))
    };
    let mut reader = app.read().await?;
    let study = studies::get(&mut reader, id).await?;
    let trials = trials::counts(&mut reader, id).await?.total as usize;
    if let Some(many) = too_large_to_wait(trials, feedback::count(&mut reader, id).await? as usize) {
        return too_many(many);
    }
    let snapshot = StudySnapshot::read(&mut reader, study).await?;
    drop(reader);
    let answers = snapshot.log().feedback.len();
    if answers == 0 {
        let why = "No results yet. The analysis appears after the first result.";
        return Ok(AnalysisState::Absent(why.to_owned()));
    }
    let analyses = app.analyses.clone();
    let think = move |pool: &OnPool| {
        analyses.of(pool, &snapshot).map(|analysis| AnalysisState::There(Box::new(snapshot), analysis))
    };
    app.compute(think).await?.map_err(Error::Learner)
}

/// All on one scale: what matters is which bound matters.
pub(crate) fn marginals(analysis: &Analysis) -> Vec<Figure> {
    let ends =
        |m: &Marginal| [m.average.mean - m.average.standard_deviation, m.average.mean + m.average.standard_deviation];
    let all = || analysis.marginals.iter().flatten().flat_map(ends);
    let range = (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
    let draw = |(dimension, levels): (&Dimension, &Vec<Marginal>)| {
        let at = |m: &Marginal| bound_units::shown(&dimension.name, m.value);
        let line = levels.iter().map(|m| (at(m), m.average.mean)).collect();
        let band = levels.iter().map(|m| (at(m), ends(m)[0], ends(m)[1])).collect();
        let label = format!("{}: {}", dimension.name, meaning(&dimension.name));
        let mut chart = Chart::new(&label, &label, "utility").with_band("one standard deviation", 0, band).with(
            "mean",
            0,
            Stroke::Marked,
            line,
        );
        chart.y_range = Some(range);
        chart.x_ticks = bound_units::all_shown(&dimension.name, &dimension.values);
        Figure::chart("utility", chart)
    };
    analysis.posterior.space().dimensions().iter().zip(&analysis.marginals).map(draw).collect()
}
