//! Maps of the posterior over two tuned bounds, the others held: utility and probability of converging.

use crate::bound_units::{self, meaning};
use crate::format::{percent, signed};
use gait_learner::{LearnerError, MainEffect, SearchSpace};
use gaitwright_charts::{Figure, HeatMap, Tile};
use gaitwright_service::error::Error;
use gaitwright_service::studies::analysis::Analysis;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::TrialId;
use gaitwright_store::trials::{Trial, TrialState};
use serde::Deserialize;

/// Which two bounds the maps show.
#[derive(Debug, Default, Deserialize)]
pub(crate) struct AxisChoice {
    x: Option<String>,
    y: Option<String>,
}

impl AxisChoice {
    /// The two dimensions of a map: the requested ones, by default the first ones in this order. `None` if there is only one
    /// dimension.
    pub(crate) fn places(&self, space: &SearchSpace, ranked: &[usize]) -> Result<Option<(usize, usize)>, Error> {
        let names: Vec<&str> = space.dimensions().iter().map(|d| d.name.as_str()).collect();
        if names.len() < 2 {
            return Ok(None);
        }
        let place = |field: &str, asked: &Option<String>| match asked {
            None => Ok(None),
            Some(name) => {
                let found = names.iter().position(|known| known == name);
                found
                    .map(Some)
                    .ok_or_else(|| Error::invalid(field, name.as_str(), &format!("one of {}", names.join(", "))))
            }
        };
        let (x, y) = (place("x", &self.x)?, place("y", &self.y)?);
        let all = || ranked.iter().copied().chain(0..names.len());
        let other_than = |taken: Option<usize>| all().find(|place| Some(*place) != taken).unwrap_or(0);
        let x = x.unwrap_or_else(|| other_than(y));
        let y = y.unwrap_or_else(|| other_than(Some(x)));
        if x == y {
            return Err(Error::invalid("y", names[y], &format!("a bound other than {}", names[x])));
        }
        Ok(Some((x, y)))
    }
}

/// Two bounds, the others held.
pub(crate) struct Maps {
    pub(crate) dimensions: Vec<DimensionChoice>,
    pub(crate) held: Option<(TrialId, u32)>,
    pub(crate) figures: Vec<Figure>,
}

pub(crate) struct DimensionChoice {
    pub(crate) name: String,
    pub(crate) meaning: String,
    pub(crate) x: bool,
    pub(crate) y: bool,
}

/// The two dimensions of the maps: the requested ones, by default those that matter most; `None` if there is only one
/// dimension.
pub(crate) fn chosen(analysis: &Analysis, choice: &AxisChoice) -> Result<Option<(usize, usize)>, Error> {
    choice.places(analysis.posterior.space(), &MainEffect::ranked(&analysis.main_effects))
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
        let label = format!("{}: {}", dimension.name, meaning(&dimension.name));
        (label, bound_units::all_shown(&dimension.name, &dimension.values))
    };
    let draw = |title: &str, cells, range| {
        let group = format!("{} {}", space.dimensions()[right].name, space.dimensions()[down].name);
        Figure::map(
            &group,
            HeatMap {
                title: title.to_owned(),
                columns: axis(right),
                rows: axis(down),
                cells,
                range,
                has_contours: true,
            },
        )
    };
    let figures = vec![draw("Utility", utility, range), draw("Probability of converging", converging, (0.0, 1.0))];
    Ok(Maps { dimensions, held, figures })
}

/// The text below each map.
pub(crate) const MAP_NOTES: [&str; 2] = [
    "Mean ± standard deviation. Contour lines connect equal means. The frame marks the best action.",
    "Contour lines connect equal probabilities. The small numbers count the trials with these two values: yes means converged, no means not converged or not executable.",
];

/// How many trials with these levels converged and how many did not.
fn tried(snapshot: &StudySnapshot, space: &SearchSpace, levels: [(usize, usize); 2]) -> String {
    let here = |trial: &&Trial| {
        let own = space.levels(trial.action_index);
        levels.iter().all(|(dimension, level)| own[*dimension] == *level)
    };
    let count = |state| snapshot.trials.iter().filter(here).filter(|trial| trial.state == state).count();
    let without_gait = count(TrialState::NotConverged) + count(TrialState::NotExecutable);
    match (count(TrialState::Converged), without_gait) {
        (0, 0) => String::new(),
        (converged, not) => format!("{converged} yes, {not} no"),
    }
}
