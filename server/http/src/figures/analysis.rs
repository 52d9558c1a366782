//! The figures of the page *Analysis*: the posterior of the learner over the search space of a study.

use super::trials_by_bound::{by_bound, parallel};
use crate::format::{meaning, percent, signed};
use crate::shared_state::AppState;
use gait_learner::{Dimension, LearnerError, Marginal, SearchSpace};
use gaitwright_charts::{Chart, Figure, HeatMap, Stroke, Tile};
use gaitwright_compute::OnPool;
use gaitwright_service::error::Error;
use gaitwright_service::studies::analysis::{Analysis, too_large_to_wait};
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{StudyId, TrialId, feedback, studies, trials};
use serde::Deserialize;
use std::sync::Arc;

/// Which two bounds the maps show.
#[derive(Debug, Default, Deserialize)]
pub(crate) struct AxisChoice {
    x: Option<String>,
    y: Option<String>,
}

/// Two bounds, the others held.
pub(crate) struct Maps {
    pub(crate) dimensions: Vec<DimensionChoice>,
    pub(crate) held: Option<(TrialId, u32)>,
    pub(crate) figures: Vec<Figure>,
}

pub(crate) struct DimensionChoice {
    pub(crate) name: String,
    pub(crate) meaning: &'static str,
    pub(crate) x: bool,
    pub(crate) y: bool,
}

/// Every figure of the page; empty if the page shows no analysis.
///
/// # Errors
/// [`Error::Invalid`] for a bound that is not tuned, [`Error::NotFound`], or errors of the database and the learner.
pub(crate) async fn figures(app: &mut AppState, id: StudyId, choice: AxisChoice) -> Result<Vec<Figure>, Error> {
    let AnalysisState::There(snapshot, analysis) = analysis_of(app, id).await? else { return Ok(Vec::new()) };
    let draw = move |_: &OnPool| {
        let chosen = chosen(&analysis, &choice)?;
        let mut figures = marginals(&analysis);
        figures.extend(maps(&analysis, &snapshot, chosen).map_err(Error::Learner)?.figures);
        figures.extend(parallel(&snapshot, &analysis).map_err(Error::Learner)?);
        for dimension in 0..analysis.posterior.space().dimensions().len() {
            figures.extend(by_bound(&snapshot, &analysis, dimension).map_err(Error::Learner)?);
        }
        Ok(figures)
    };
    app.compute(draw).await?
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

/// The two dimensions of the maps: the requested ones, by default those that matter most; `None` if there is only one
/// dimension.
pub(crate) fn chosen(analysis: &Analysis, choice: &AxisChoice) -> Result<Option<(usize, usize)>, Error> {
    let names: Vec<&str> = analysis.posterior.space().dimensions().iter().map(|d| d.name.as_str()).collect();
    if names.len() < 2 {
        return Ok(None);
    }
    let place = |field: &str, asked: &Option<String>| match asked {
        None => Ok(None),
        Some(name) => {
            let found = names.iter().position(|known| known == name);
            found.map(Some).ok_or_else(|| Error::invalid(field, name.as_str(), &format!("one of {}", names.join(", "))))
        }
    };
    let (x, y) = (place("x", &choice.x)?, place("y", &choice.y)?);
    let ranked = ranked(analysis);
    let other_than = |taken: Option<usize>| ranked.iter().copied().find(|place| Some(*place) != taken).unwrap_or(0);
    let x = x.unwrap_or_else(|| other_than(y));
    let y = y.unwrap_or_else(|| other_than(Some(x)));
    if x == y {
        return Err(Error::invalid("y", names[y], &format!("a bound other than {}", names[x])));
    }
    Ok(Some((x, y)))
}

/// The dimensions by how much they matter, the most important first.
pub(crate) fn ranked(analysis: &Analysis) -> Vec<usize> {
    let mut ranked: Vec<usize> = (0..analysis.main_effects.len()).collect();
    let effect = |place: usize| analysis.main_effects[place].difference.mean;
    ranked.sort_by(|a, b| effect(*b).total_cmp(&effect(*a)));
    ranked
}

/// All on one scale: what matters is which bound matters.
pub(crate) fn marginals(analysis: &Analysis) -> Vec<Figure> {
    let ends =
        |m: &Marginal| [m.average.mean - m.average.standard_deviation, m.average.mean + m.average.standard_deviation];
    let all = || analysis.marginals.iter().flatten().flat_map(ends);
    let range = (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
    let draw = |(dimension, levels): (&Dimension, &Vec<Marginal>)| {
        let line = levels.iter().map(|m| (m.value, m.average.mean)).collect();
        let band = levels.iter().map(|m| (m.value, ends(m)[0], ends(m)[1])).collect();
        let label = format!("{}: {}", dimension.name, meaning(&dimension.name));
        let mut chart = Chart::new(&label, &label, "utility").with_band("one standard deviation", 0, band).with(
            "mean",
            0,
            Stroke::Marked,
            line,
        );
        chart.y_range = Some(range);
        chart.x_ticks.clone_from(&dimension.values);
        Figure::chart("utility", chart)
    };
    analysis.posterior.space().dimensions().iter().zip(&analysis.marginals).map(draw).collect()
}

pub(crate) fn maps(
    analysis: &Analysis,
    snapshot: &StudySnapshot,
    chosen: Option<(usize, usize)>,
) -> Result<Maps, LearnerError> {
    let space = analysis.posterior.space();
    let dimensions = space.dimensions().iter().enumerate();
    let dimensions = dimensions
        .map(|(place, dimension)| DimensionChoice {
            name: dimension.name.clone(),
            meaning: meaning(&dimension.name),
            x: chosen.is_some_and(|(x, _)| x == place),
            y: chosen.is_some_and(|(_, y)| y == place),
        })
        .collect();
    let (Some((right, down)), Some(best)) = (chosen, analysis.posterior.best()) else {
        return Ok(Maps { dimensions, held: None, figures: Vec::new() });
    };
    let held = snapshot.trial_of(best).map(|trial| (trial.id, trial.number));
    let slice = analysis.posterior.slice(down, right, best)?;
    let at = |row: usize, column: usize| {
        let mut levels = space.levels(best);
        (levels[down], levels[right]) = (row, column);
        space.index_of_levels(&levels)
    };
    let mut utility = Vec::new();
    let mut converging = Vec::new();
    for (row, predictions) in slice.predictions.iter().enumerate() {
        let (mut utilities, mut chances) = (Vec::new(), Vec::new());
        for (column, prediction) in predictions.iter().enumerate() {
            let action = at(row, column)?;
            let framed = action == best;
            utilities.push(Tile {
                value: prediction.mean,
                text: signed(prediction.mean),
                below: format!("± {:.2}", prediction.standard_deviation),
                framed,
            });
            let chance = analysis.posterior.probability_of_converging(action)?;
            let below = tried(snapshot, space, [(down, row), (right, column)]);
            chances.push(Tile { value: chance, text: percent(chance), below, framed });
        }
        utility.push(utilities);
        converging.push(chances);
    }
    let means = || utility.iter().flatten().map(|cell| cell.value);
    let range = (means().fold(f64::INFINITY, f64::min), means().fold(f64::NEG_INFINITY, f64::max));
    let axis = |place: usize| {
        let dimension = &space.dimensions()[place];
        (format!("{}: {}", dimension.name, meaning(&dimension.name)), dimension.values.clone())
    };
    let draw = |title: &str, cells, range, in_percent| {
        let group = format!("{} {}", space.dimensions()[right].name, space.dimensions()[down].name);
        Figure::map(
            &group,
            HeatMap { title: title.to_owned(), columns: axis(right), rows: axis(down), cells, range, in_percent },
        )
    };
    let figures =
        vec![draw("Utility", utility, range, false), draw("Probability of converging", converging, (0.0, 1.0), true)];
    Ok(Maps { dimensions, held, figures })
}

/// The text below each map.
pub(crate) const MAP_NOTES: [&str; 2] = [
    "Mean ± standard deviation. Lines connect equal means. The frame marks the best action.",
    "Lines connect equal probabilities. The small numbers count the trials with these two values: yes means converged, no means not converged.",
];

/// How many trials with these levels converged and how many did not.
fn tried(snapshot: &StudySnapshot, space: &SearchSpace, levels: [(usize, usize); 2]) -> String {
    let here = |trial: &&Trial| {
        let own = space.levels(trial.action_index);
        levels.iter().all(|(dimension, level)| own[*dimension] == *level)
    };
    let count = |state| snapshot.trials.iter().filter(here).filter(|trial| trial.state == state).count();
    match (count(TrialState::Converged), count(TrialState::NotConverged)) {
        (0, 0) => String::new(),
        (converged, not) => format!("{converged} yes, {not} no"),
    }
}
