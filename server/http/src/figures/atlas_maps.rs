//! Maps of an atlas over two tuned bounds, the others held: Gait RMSE, cost of transport and active bounds.

use super::maps_over_two_bounds::{AxisChoice, DimensionChoice};
use crate::bound_units::{self, meaning};
use gait_learner::{ActionIndex, Dimension, LearnerError, SearchSpace};
use gaitwright_charts::{HeatMap, Tile};
use gaitwright_service::error::Error;
use gaitwright_service::studies::atlas::{AtlasResult, StudyAtlas};
use std::collections::BTreeSet;

/// Value, text and the text below it of a tile.
type TileContent = (f64, String, String);
/// The tile of a result in a map; `None` without a gait.
type Shown<'a> = &'a dyn Fn(AtlasResult<'_>) -> Option<TileContent>;

/// So many active bounds are named in a tile.
const NAMED: usize = 4;

/// The two dimensions of the maps: the requested ones, by default the first ones that are active in a gait. `None` if there is
/// only one dimension.
pub(crate) fn chosen(
    atlas: &StudyAtlas,
    space: &SearchSpace,
    choice: &AxisChoice,
) -> Result<Option<(usize, usize)>, Error> {
    let results: Vec<AtlasResult<'_>> = atlas.results().collect();
    let active: BTreeSet<&str> = results.iter().flat_map(AtlasResult::active_bounds).collect();
    let places = |is_active: bool| {
        let tuned = space.dimensions().iter().enumerate().filter(|(_, dimension)| dimension.values.len() > 1);
        tuned.filter(move |(_, one)| active.contains(one.name.as_str()) == is_active).map(|(place, _)| place)
    };
    let ranked: Vec<usize> = places.clone()(true).chain(places(false)).collect();
    choice.places(space, &ranked)
}

/// Each bound, and whether an axis shows it.
pub(crate) fn dimensions(space: &SearchSpace, (x, y): (usize, usize)) -> Vec<DimensionChoice> {
    let of = |(place, dimension): (usize, &Dimension)| DimensionChoice {
        name: dimension.name.clone(),
        meaning: meaning(&dimension.name),
        x: place == x,
        y: place == y,
    };
    space.dimensions().iter().enumerate().map(of).collect()
}

/// The maps, with the other bounds as in this action, whose tile has a frame.
pub(crate) fn maps(
    atlas: &StudyAtlas,
    space: &SearchSpace,
    (right, down): (usize, usize),
    held: ActionIndex,
) -> Result<Vec<HeatMap>, LearnerError> {
    let rmse =
        |result: AtlasResult<'_>| result.trial.gait_rmse_rad.map(|rmse| (rmse, format!("{rmse:.3}"), String::new()));
    let cost = |result: AtlasResult<'_>| {
        result.trial.cost_of_transport.map(|cost| (cost, format!("{cost:.3}"), String::new()))
    };
    let active = |result: AtlasResult<'_>| {
        let names = result.active_bounds();
        let below = if names.len() > NAMED { String::new() } else { names.join(" ") };
        result.gait.map(|_| (names.len() as f64, names.len().to_string(), below))
    };
    let of: [(&str, Shown<'_>, bool); 3] =
        [("Gait RMSE, rad", &rmse, true), ("Cost of transport", &cost, true), ("Active bounds", &active, false)];
    let axis = |place: usize| {
        let dimension = &space.dimensions()[place];
        let label = format!("{}: {}", dimension.name, meaning(&dimension.name));
        (label, bound_units::all_shown(&dimension.name, &dimension.values))
    };
    of.into_iter()
        .map(|(title, value, has_contours)| {
            let cells = tiles(atlas, space, (right, down), held, value)?;
            let values = || cells.iter().flatten().map(|tile| tile.value).filter(|value| value.is_finite());
            let range = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
            Ok(HeatMap { title: title.to_owned(), columns: axis(right), rows: axis(down), cells, range, has_contours })
        })
        .collect()
}

fn tiles(
    atlas: &StudyAtlas,
    space: &SearchSpace,
    (right, down): (usize, usize),
    held: ActionIndex,
    value: Shown<'_>,
) -> Result<Vec<Vec<Tile>>, LearnerError> {
    let tile = |row: usize, column: usize| {
        let mut levels = space.levels(held);
        (levels[down], levels[right]) = (row, column);
        let action = space.index_of_levels(&levels)?;
        let framed = action == held;
        Ok(match atlas.result_of(action) {
            None => Tile { value: f64::NAN, text: "–".to_owned(), below: String::new(), framed },
            Some(result) => match value(result) {
                Some((value, text, below)) => Tile { value, text, below, framed },
                None => Tile { value: f64::NAN, text: "no gait".to_owned(), below: String::new(), framed },
            },
        })
    };
    let columns = space.dimensions()[right].values.len();
    (0..space.dimensions()[down].values.len())
        .map(|row| (0..columns).map(|column| tile(row, column)).collect())
        .collect()
}
