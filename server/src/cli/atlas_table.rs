//! The atlas as a CSV table with one row for each action.

use super::solve::status_word;
use gait_optimizer::reference::JOINTS;
use gaitwright_charts::csv_table::{CsvCell, CsvTable, cells};
use gaitwright_service::studies::atlas::{GaitMap, GaitValues};

/// The columns after the action, without those of the gait. Scripts rely on them. `gait` numbers the gaits from 1, the root;
/// actions with the same number have the same gait. `iterations` are those of the solve that found it.
const COLUMNS: [&str; 3] = ["gait", "status", "iterations"];

pub(super) fn text(atlas: &GaitMap) -> String {
    let mut table = CsvTable::default();
    let columns = COLUMNS.into_iter().chain(GaitValues::COLUMNS).chain(["active"]);
    table.row(atlas.bounds().chain(columns).map(CsvCell::from));
    for row in atlas.rows() {
        let mut cells: Vec<CsvCell> = row.values.iter().map(CsvCell::from).collect();
        cells.extend(cells![row.number, status_word(row.solved.status), row.solved.iterations]);
        let gait = row.solved.gait.as_ref();
        cells.extend(gait.map_or([None; GaitValues::COLUMNS.len()], GaitValues::numbers).map(CsvCell::from));
        cells.push(CsvCell::from(gait.map_or_else(String::new, |gait| gait.active_bounds().join(" "))));
        table.row(cells);
    }
    table.into_text()
}

/// A row for each different gait: its number, and its joint angles in rad at each tenth of the stride.
pub(super) fn joint_angles(atlas: &GaitMap) -> String {
    let gaits = atlas.gaits();
    let times = gaits.values().next().map_or(0, |gait| gait.joint_angles_rad.len());
    let mut table = CsvTable::default();
    let names = (0..times).flat_map(|time| JOINTS.map(|joint| format!("{joint}_{}", 100 * time / times)));
    let names: Vec<String> = std::iter::once("gait".to_owned()).chain(names).collect();
    table.row(names.iter().map(|name| CsvCell::from(name.as_str())));
    for (number, gait) in gaits {
        let angles = gait.joint_angles_rad.iter().flatten();
        table.row(std::iter::once(CsvCell::from(number)).chain(angles.map(CsvCell::from)));
    }
    table.into_text()
}
