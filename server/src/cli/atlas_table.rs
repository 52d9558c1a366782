//! The atlas as a CSV table with one row for each action.

use super::solve::status_word;
use gait_optimizer::reference::JOINTS;
use gaitwright_charts::csv_table::{CsvCell, CsvTable, cells};
use gaitwright_service::studies::atlas::GaitMap;

/// The columns after the action. Scripts rely on them. `gait` numbers the gaits from 1, the root; actions with the same
/// number have the same gait. `iterations` are those of the solve that found it. `active` lists the bounds that could not
/// move without changing the gait.
const COLUMNS: [&str; 13] = [
    "gait",
    "status",
    "iterations",
    "objective",
    "cost_of_transport",
    "gait_rmse_rad",
    "gait_rmse_other_rad",
    "speed_m_s",
    "stride_length_m",
    "double_support_percent",
    "step_time_asymmetry",
    "peak_hip_torque_nm_kg",
    "active",
];

pub(super) fn text(atlas: &GaitMap) -> String {
    let mut table = CsvTable::default();
    table.row(atlas.bounds().chain(COLUMNS).map(CsvCell::from));
    for row in atlas.rows() {
        let mut cells: Vec<CsvCell> = row.values.iter().map(CsvCell::from).collect();
        cells.extend(cells![row.number, status_word(row.solved.status), row.solved.iterations]);
        match &row.solved.gait {
            Some(gait) => {
                let active =
                    gait.unchanged_bounds.iter().filter(|bound| bound.least.is_some() && bound.least == bound.most);
                let active: Vec<&str> = active.map(|bound| bound.bound.as_str()).collect();
                cells.extend(cells![
                    gait.objective,
                    gait.cost_of_transport,
                    gait.gait_rmse_rad,
                    gait.gait_rmse_other_rad,
                    gait.speed_m_s,
                    gait.stride_length_m,
                    gait.double_support_percent,
                    gait.step_time_asymmetry,
                    gait.peak_hip_torque_nm_kg,
                    active.join(" "),
                ]);
            }
            None => cells.extend(COLUMNS.iter().skip(3).map(|_| CsvCell::from(""))),
        }
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
