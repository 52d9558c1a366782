//! A gait as a CSV table with one row for each node.

use crate::csv_table::{CsvCell, CsvTable, cells};
use crate::gait_series::{FORCE_NAMES, MUSCLES, points};
use gait_optimizer::Gait;

const COORDINATES: [&str; 9] = ["px", "pz", "torso", "hip_L", "knee_L", "ankle_L", "hip_R", "knee_R", "ankle_R"];
const JOINTS: [&str; 6] = ["hip_L", "knee_L", "ankle_L", "hip_R", "knee_R", "ankle_R"];

/// The CSV table of time, domain, coordinates, velocities, torques, ground forces (zero without contact) and
/// activations.
pub fn gait_csv(gait: &Gait) -> String {
    let unit = |name: &str| if name.starts_with('p') { "m" } else { "rad" };
    let mut header = vec!["time_s".to_owned(), "domain".to_owned()];
    header.extend(COORDINATES.iter().map(|name| format!("{name}_{}", unit(name))));
    header.extend(COORDINATES.iter().map(|name| format!("d{name}_{}_s", unit(name))));
    header.extend(JOINTS.iter().map(|name| format!("torque_{name}_Nm")));
    header.extend(FORCE_NAMES.iter().map(|name| format!("{name}_N")));
    let muscles = gait.domains.iter().any(|domain| domain.muscles.is_some());
    if muscles {
        header.extend(MUSCLES.iter().map(|name| format!("activation_{name}")));
    }
    let mut table = CsvTable::new(header);
    for point in points(gait) {
        let mut row = cells![point.time_s, point.domain];
        row.extend(point.q.iter().chain(point.qd).chain(point.u).chain(&point.forces).map(CsvCell::from));
        row.extend(point.activation.iter().flat_map(|a| a.iter()).map(CsvCell::from));
        table.row(row);
    }
    table.into_text()
}
