//! A gait as a table: one row per mesh point.

use crate::error::Error;
use crate::gait_series::{FORCE_NAMES, MUSCLES, points};
use gait_optimizer::Gait;

const COORDINATES: [&str; 9] = ["px", "pz", "torso", "hip_L", "knee_L", "ankle_L", "hip_R", "knee_R", "ankle_R"];
const JOINTS: [&str; 6] = ["hip_L", "knee_L", "ankle_L", "hip_R", "knee_R", "ankle_R"];

/// Time, domain, q, qd, torques, ground forces (the four points, zero where there is no contact), activations, as CSV.
///
/// # Errors
/// [`Error::Internal`] when it cannot be written.
pub(crate) fn gait_csv(gait: &Gait) -> Result<Vec<u8>, Error> {
    let (header, rows) = header_and_rows(gait);
    csv_bytes(&header, rows)
}

/// A header and rows of as many cells as CSV.
///
/// # Errors
/// [`Error::Internal`] when it cannot be written.
pub(crate) fn csv_bytes<T: AsRef<[u8]>>(header: &[T], rows: Vec<Vec<String>>) -> Result<Vec<u8>, Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let internal = |e: csv::Error| Error::Internal(e.to_string());
    writer.write_record(header).map_err(internal)?;
    for row in rows {
        writer.write_record(&row).map_err(internal)?;
    }
    writer.into_inner().map_err(|e| Error::Internal(e.to_string()))
}

fn header_and_rows(gait: &Gait) -> (Vec<String>, Vec<Vec<String>>) {
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
    let mut rows = Vec::new();
    for point in points(gait) {
        let mut row = vec![point.time_s.to_string(), point.domain.to_owned()];
        row.extend(point.q.iter().chain(point.qd).chain(point.u).chain(&point.forces).map(f64::to_string));
        row.extend(point.activation.iter().flat_map(|a| a.iter()).map(f64::to_string));
        rows.push(row);
    }
    (header, rows)
}
