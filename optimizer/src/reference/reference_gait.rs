//! A reference gait: mean joint angles over the gait cycle, and whose they are.

use crate::model_error::ModelError;
use crate::subject::Subject;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// One healthy adult, the default. The headers of these files state source, licence and processing.
const FALISSE_2019_CSV: &str = include_str!("../../data/reference_gait_falisse_2019.csv");
/// The median of 24 healthy adults.
const FUKUCHI_2018_CSV: &str = include_str!("../../data/reference_gait_fukuchi_2018.csv");
/// Largest plausible joint angle, rad. Angles in degrees exceed it.
pub const MAX_ANGLE_RAD: f64 = PI;
/// Number of rows of a reference gait: 0, 1, ..., 100 % of the cycle.
pub const REFERENCE_ROWS: usize = 101;
/// The joints of the walker and their columns in Gaitwright's table. Forward lean, flexion and dorsiflexion are
/// positive; hip angles are relative to the torso.
pub const JOINTS: [&str; 7] = ["torso", "hip_L", "knee_L", "ankle_L", "hip_R", "knee_R", "ankle_R"];
/// Names of the columns after the percentage.
pub const REFERENCE_COLUMNS: [&str; 5] = ["torso_rad", "hip_L_rad", "knee_L_rad", "ankle_L_rad", "hip_R_rad"];
/// Names of the optional columns of standard deviations.
pub const DEVIATION_COLUMNS: [&str; 5] =
    ["torso_sd_rad", "hip_L_sd_rad", "knee_L_sd_rad", "ankle_L_sd_rad", "hip_R_sd_rad"];

/// Mean joint angles over one gait cycle from right heel strike, in rad and in the convention of the walker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReferenceGait {
    /// Name.
    pub name: String,
    /// Citation, licence and processing of the data.
    pub provenance: String,
    /// 101 rows (0 to 100 % of the cycle) of torso, hip_L, knee_L, ankle_L and hip_R, rad.
    pub angles_rad: Vec<[f64; 5]>,
    /// Standard deviation over strides, if there were several, rad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub standard_deviation_rad: Option<Vec<[f64; 5]>>,
    /// Height of the person, if known, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f64>,
    /// Body mass of the person, if known, kg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_mass_kg: Option<f64>,
}

impl ReferenceGait {
    /// The built-in reference gait: one healthy adult of Falisse et al. 2019 (MIT licence).
    ///
    /// # Errors
    /// If the built-in file is invalid; a test excludes it.
    pub fn builtin() -> Result<Self, ModelError> {
        // The source has the mass but not the height.
        let reference = Self::from_csv("Falisse 2019, subject 1", FALISSE_2019_CSV)?;
        Ok(Self { body_mass_kg: Some(62.0), ..reference })
    }

    /// Every built-in reference gait with its name on the command line, the default first: `falisse-2019`, one adult,
    /// and `fukuchi-2018`, the median of 24 young adults of Fukuchi et al. 2018 (CC BY 4.0).
    ///
    /// # Errors
    /// If a built-in file is invalid; a test excludes it.
    pub fn all_builtin() -> Result<[(&'static str, Self); 2], ModelError> {
        let fukuchi = Self::from_csv("Fukuchi 2018, median of 24 adults", FUKUCHI_2018_CSV)?;
        Ok([("falisse-2019", Self::builtin()?), ("fukuchi-2018", fukuchi)])
    }

    /// Parses a table with the columns `pct_rhs,torso_rad,hip_L_rad,knee_L_rad,ankle_L_rad,hip_R_rad` and 101 rows.
    /// Columns of standard deviations, `torso_sd_rad,hip_L_sd_rad,knee_L_sd_rad,ankle_L_sd_rad,hip_R_sd_rad`, are
    /// optional. Lines that begin with `#` before the names are the provenance.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with line and reason.
    pub fn from_csv(name: &str, text: &str) -> Result<Self, ModelError> {
        let malformed = |line: u64, reason: String| ModelError::Malformed {
            what: format!("reference gait {name:?}, line {line}"),
            reason,
        };
        let comments: Vec<&str> = text.lines().take_while(|l| l.starts_with('#')).collect();
        let header_line = comments.len() as u64 + 1;
        let provenance = comments.iter().map(|l| l.trim_start_matches('#').trim()).collect::<Vec<_>>().join("\n");
        let mut reader =
            csv::ReaderBuilder::new().comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
        let headers = reader.headers().map_err(|e| malformed(header_line, e.to_string()))?.clone();
        let places = |wanted: [&'static str; 5]| -> Result<[usize; 5], ModelError> {
            let mut found = [0; 5];
            for (place, wanted) in found.iter_mut().zip(wanted) {
                *place = headers
                    .iter()
                    .position(|h| h == wanted)
                    .ok_or_else(|| malformed(header_line, format!("column {wanted} is missing")))?;
            }
            Ok(found)
        };
        let angles = places(REFERENCE_COLUMNS)?;
        let has_deviations = headers.iter().any(|h| DEVIATION_COLUMNS.contains(&h));
        let deviations = has_deviations.then(|| places(DEVIATION_COLUMNS)).transpose()?;
        let mut angles_rad = Vec::with_capacity(REFERENCE_ROWS);
        let mut deviations_rad = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|e| malformed(e.position().map_or(0, csv::Position::line), e.to_string()))?;
            let cells = |places: [usize; 5], names: [&str; 5], least: f64| {
                let mut row = [0.0; 5];
                for ((value, place), wanted) in row.iter_mut().zip(places).zip(names) {
                    let cell = record.get(place).unwrap_or("");
                    *value =
                        cell.parse::<f64>().ok().filter(|angle| (least..=MAX_ANGLE_RAD).contains(angle)).ok_or_else(
                            || {
                                let range = format!("from {least:.2} to {MAX_ANGLE_RAD:.2} rad");
                                let line = record.position().map_or(0, csv::Position::line);
                                malformed(line, format!("{wanted} is {cell:?}; it must be an angle {range}"))
                            },
                        )?;
                }
                Ok(row)
            };
            angles_rad.push(cells(angles, REFERENCE_COLUMNS, -MAX_ANGLE_RAD)?);
            if let Some(places) = deviations {
                deviations_rad.push(cells(places, DEVIATION_COLUMNS, 0.0)?);
            }
        }
        let reference = Self {
            name: name.to_owned(),
            provenance,
            angles_rad,
            standard_deviation_rad: has_deviations.then_some(deviations_rad),
            height_m: None,
            body_mass_kg: None,
        };
        reference.validate()?;
        Ok(reference)
    }

    /// Parses and validates a reference gait in JSON; `what` is the name of the file.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with line and column, or the reason.
    pub fn from_json(what: &str, text: &str) -> Result<Self, ModelError> {
        let reference: Self = serde_json::from_str(text).map_err(|e| ModelError::Malformed {
            what: what.to_owned(),
            reason: format!("not a reference gait: {e}"),
        })?;
        reference.validate()?;
        Ok(reference)
    }

    /// Checks numbers of rows, angles, standard deviations, height and mass.
    ///
    /// # Errors
    /// [`ModelError`] with the field.
    pub fn validate(&self) -> Result<(), ModelError> {
        check_curves("angles_rad", &self.angles_rad, -MAX_ANGLE_RAD)?;
        if let Some(deviation) = &self.standard_deviation_rad {
            check_curves("standard_deviation_rad", deviation, 0.0)?;
        }
        MeasuredPerson { height_m: self.height_m, body_mass_kg: self.body_mass_kg }.validate()
    }

    /// The five angles at a fraction of the stride, rad; periodic, interpolated linearly.
    pub fn at(&self, fraction: f64) -> [f64; 5] {
        let intervals = REFERENCE_ROWS - 1;
        let position = fraction.rem_euclid(1.0) * intervals as f64;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 0 <= position < 100
        let low = (position.floor() as usize).min(intervals - 1);
        let share = position - low as f64;
        let (a, b) = (&self.angles_rad[low], &self.angles_rad[low + 1]);
        std::array::from_fn(|i| a[i] + share * (b[i] - a[i]))
    }

    /// All seven joint angles of the walker at a fraction of the stride, rad. Right knee and ankle are the left ones
    /// shifted by half a stride, because a reference gait does not have them.
    pub fn seven_angles(&self, fraction: f64) -> [f64; 7] {
        let [torso, hip_l, knee_l, ankle_l, hip_r] = self.at(fraction);
        let [_, _, knee_r, ankle_r, _] = self.at(fraction + 0.5);
        [torso, hip_l, knee_l, ankle_l, hip_r, knee_r, ankle_r]
    }
}

/// Height and mass of the measured person, if known.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MeasuredPerson {
    /// Body height, m.
    pub height_m: Option<f64>,
    /// Body mass, kg.
    pub body_mass_kg: Option<f64>,
}

impl MeasuredPerson {
    /// Checks height and mass.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] with the field.
    pub fn validate(&self) -> Result<(), ModelError> {
        for (field, value, (low, high)) in [
            ("height_m", self.height_m, Subject::HEIGHT_RANGE_M),
            ("body_mass_kg", self.body_mass_kg, Subject::BODY_MASS_RANGE_KG),
        ] {
            if let Some(value) = value {
                ModelError::check_range(field, value, low, high)?;
            }
        }
        Ok(())
    }
}

/// Checks five curves over the cycle: 101 rows with values from `least` to the largest plausible angle.
fn check_curves(field: &str, curves: &[[f64; 5]], least: f64) -> Result<(), ModelError> {
    if curves.len() != REFERENCE_ROWS {
        let reason = format!("the number of rows is {}; it must be {REFERENCE_ROWS}", curves.len());
        return Err(ModelError::Malformed { what: field.to_owned(), reason });
    }
    for (row, values) in curves.iter().enumerate() {
        for (column, value) in values.iter().enumerate() {
            ModelError::check_range(&format!("{field}[{row}][{column}]"), *value, least, MAX_ANGLE_RAD)?;
        }
    }
    Ok(())
}
