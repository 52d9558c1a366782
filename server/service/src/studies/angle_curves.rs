//! The columns of a file of joint angles before it is read as such: the column of each angle, and its curve, beside which a
//! reversed sign is seen.

use super::angle_columns::{self, ChosenColumns};
use super::signal_extremes::extremes;
use crate::error::Error;
use gait_optimizer::angle_table::{AngleColumn, AngleTable};
use gait_optimizer::limit_cycle::JOINTS;
use gait_optimizer::reference::{
    AngleUnit, HeelStrikes, MAX_ANGLE_RAD, MotionRecording, doubtful_curve, doubtful_range, mean_cycle,
};
use std::f64::consts::PI;

/// The joints from which right heel strikes are found.
const OF_HEEL_STRIKES: [&str; 3] = ["torso", "hip_R", "knee_R"];

/// The columns of a file, with what was chosen or guessed.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnChoice {
    /// Names of the columns, without the time.
    pub columns: Vec<String>,
    /// The column of each angle.
    pub chosen: ChosenColumns,
    /// The unit of the angles: given, of the header, or taken from their size.
    pub unit: AngleUnit,
    /// Whether the unit was taken from the size of the angles.
    pub is_unit_guessed: bool,
    /// The chosen angles, in the order of [`JOINTS`].
    pub curves: Vec<AngleCurve>,
}

/// A chosen angle.
#[derive(Debug, Clone, PartialEq)]
pub struct AngleCurve {
    /// The joint, one of [`JOINTS`].
    pub joint: &'static str,
    /// The angle over the mean stride, at 0, 1, ..., 100 % from right heel strike, °; empty if there is none.
    pub cycle: Vec<f64>,
    /// Smallest and largest angle, °, of intervals over time, s.
    pub points: Vec<(f64, f64)>,
    /// Why its sign looks reversed.
    pub doubt: Option<String>,
}

impl ColumnChoice {
    /// Reads the chosen columns of a file, or those that their names tell. Heel strikes that are not given are found from the
    /// angles, unless the sign of an angle that they depend on is doubtful.
    pub(super) fn of(
        file: &AngleTable,
        chosen: &ChosenColumns,
        unit: Option<AngleUnit>,
        given_s: &[f64],
    ) -> Result<Self, Error> {
        let columns = file.columns();
        let mut known = chosen.clone();
        known.retain(|_, chosen| columns.contains(&chosen.column));
        let chosen = if known.is_empty() { angle_columns::guessed(columns) } else { known };
        let of_file = file.unit().or(unit);
        let unit = of_file.unwrap_or_else(|| unit_by_size(file, &chosen));
        let time_s = file.times();
        let mut angles: Vec<(&'static str, Vec<f64>)> = Vec::new();
        for column in angle_columns::columns_of("columns", &chosen)? {
            let joint = JOINTS.into_iter().find(|joint| *joint == column.joint);
            angles.extend(joint.zip(radians(file, &column, unit)));
        }
        angles.sort_by_key(|(joint, _)| JOINTS.iter().position(|known| known == joint));
        let doubts: Vec<Option<String>> = angles.iter().map(|(joint, angle)| doubtful_range(joint, angle)).collect();
        let is_certain =
            |joint: &&str| angles.iter().zip(&doubts).any(|((known, _), doubt)| known == joint && doubt.is_none());
        let are_certain = OF_HEEL_STRIKES.iter().all(is_certain);
        let strides = if given_s.is_empty() && !are_certain { Vec::new() } else { strides(&time_s, &angles, given_s) };
        let curve = |((joint, angle), doubt): (&(&'static str, Vec<f64>), &Option<String>)| {
            let cycle = mean_cycle(&time_s, angle, &strides);
            let by_curve = if cycle.is_empty() { None } else { doubtful_curve(joint, &cycle)? };
            let point = |(row, angle): (usize, f64)| (time_s[row], angle.to_degrees());
            Ok(AngleCurve {
                joint,
                cycle: cycle.into_iter().map(f64::to_degrees).collect(),
                points: extremes(angle).into_iter().map(point).collect(),
                doubt: doubt.clone().or(by_curve),
            })
        };
        let curves = angles.iter().zip(&doubts).map(curve).collect::<Result<_, Error>>()?;
        Ok(Self { columns: columns.to_vec(), chosen, unit, is_unit_guessed: of_file.is_none(), curves })
    }
}

/// Degrees if an angle would be implausible in radians.
fn unit_by_size(file: &AngleTable, chosen: &ChosenColumns) -> AngleUnit {
    let is_large = |value: &f64| value.abs() > MAX_ANGLE_RAD;
    let mut values = chosen.values().filter_map(|chosen| file.values(&chosen.column));
    if values.any(|values| values.iter().any(is_large)) { AngleUnit::Degrees } else { AngleUnit::Radians }
}

fn radians(file: &AngleTable, column: &AngleColumn<'_>, unit: AngleUnit) -> Option<Vec<f64>> {
    let factor = match unit {
        AngleUnit::Degrees => PI / 180.0,
        AngleUnit::Radians => 1.0,
    };
    let sign = if column.reversed { -factor } else { factor };
    Some(file.values(column.column)?.into_iter().map(|value| sign * value).collect())
}

/// The strides between right heel strikes that are as long as strides are, s.
fn strides(time_s: &[f64], angles: &[(&'static str, Vec<f64>)], given_s: &[f64]) -> Vec<(f64, f64)> {
    let angle = |joint: &str, row: usize| {
        angles.iter().find(|(known, _)| *known == joint).and_then(|(_, angle)| angle.get(row)).copied().unwrap_or(0.0)
    };
    let row = |row: usize| [angle("torso", row), 0.0, 0.0, 0.0, angle("hip_R", row)];
    let motion = MotionRecording {
        what: String::new(),
        time_s: time_s.to_vec(),
        // The position of the right heel does not depend on the left leg.
        angles_rad: (0..time_s.len()).map(row).collect(),
        knee_r_rad: angles.iter().find(|(joint, _)| *joint == "knee_R").map(|(_, angle)| angle.clone()),
        right_force: None,
        steps: Vec::new(),
    };
    let how = if given_s.is_empty() { HeelStrikes::Kinematics } else { HeelStrikes::Given(given_s.to_vec()) };
    let strikes = motion.heel_strikes(&how).unwrap_or_default();
    let used = motion.strides(&strikes).into_iter().filter(|stride| stride.is_used);
    used.map(|stride| (stride.start_s, stride.end_s)).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::studies::angle_columns::ChosenColumn;
    use gait_optimizer::ReferenceGait;
    use std::fmt::Write;

    /// Eight strides of the built-in reference gait, 1.1 s each, in degrees, with these names of columns.
    fn file(names: [&str; 7], signs: [f64; 7]) -> AngleTable {
        let reference = ReferenceGait::builtin().unwrap();
        let mut text = format!("Time,{}\n", names.join(","));
        for row in 0..880 {
            let time = f64::from(row) / 100.0;
            write!(text, "{time}").unwrap();
            for (angle, sign) in reference.seven_angles(time / 1.1).iter().zip(signs) {
                write!(text, ",{:.6}", sign * angle.to_degrees()).unwrap();
            }
            text.push('\n');
        }
        AngleTable::from_csv("a.csv", &text).unwrap()
    }

    const NAMES: [&str; 7] = ["Trunk", "L Hip", "L Knee", "L Ankle", "R Hip", "R Knee", "R Ankle"];

    fn choice(signs: [f64; 7], reversed: &[&str]) -> ColumnChoice {
        let file = file(NAMES, signs);
        let mut chosen = angle_columns::guessed(file.columns());
        for joint in reversed {
            chosen.get_mut(*joint).unwrap().reversed = true;
        }
        ColumnChoice::of(&file, &chosen, None, &[]).unwrap()
    }

    fn doubted(choice: &ColumnChoice) -> Vec<&'static str> {
        choice.curves.iter().filter(|curve| curve.doubt.is_some()).map(|curve| curve.joint).collect()
    }

    #[test]
    fn columns_are_guessed_and_their_mean_strides_are_those_of_the_recording() {
        let found = ColumnChoice::of(&file(NAMES, [1.0; 7]), &ChosenColumns::new(), None, &[]).unwrap();
        assert_eq!((found.unit, found.is_unit_guessed, found.chosen.len()), (AngleUnit::Degrees, true, 7));
        assert!(found.curves.iter().map(|curve| curve.joint).eq(JOINTS));
        assert_eq!(doubted(&found), [""; 0]);
        // The peak of the left knee over the cycle, which the heel strikes of kinematics shift by a few percent.
        let peak = |curve: &[f64]| curve.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let builtin = ReferenceGait::builtin().unwrap();
        let expected: Vec<f64> = builtin.angles_rad.iter().map(|row| row[2].to_degrees()).collect();
        assert!((peak(&found.curves[2].cycle) - peak(&expected)).abs() < 0.5, "{}", peak(&found.curves[2].cycle));
    }

    #[test]
    fn reversed_sign_is_doubted_until_it_is_reversed() {
        let with_ankle = choice([1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0], &[]);
        assert_eq!(doubted(&with_ankle), ["ankle_L"]);
        assert!(with_ankle.curves[3].doubt.as_ref().unwrap().starts_with("moves opposite to normal walking"));
        assert_eq!(doubted(&choice([1.0, 1.0, 1.0, -1.0, 1.0, 1.0, 1.0], &["ankle_L"])), [""; 0]);
        // Without a certain sign of the right leg there are no heel strikes, so the angles are shown over time.
        let with_knees = choice([1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0], &[]);
        assert_eq!(doubted(&with_knees), ["knee_L", "knee_R"]);
        assert!(with_knees.curves.iter().all(|curve| curve.cycle.is_empty() && !curve.points.is_empty()));
    }

    #[test]
    fn column_that_the_file_lacks_is_chosen_anew() {
        let gone = ChosenColumn { column: "gone".to_owned(), reversed: true };
        let chosen = ChosenColumns::from([("torso".to_owned(), gone)]);
        let found = ColumnChoice::of(&file(NAMES, [1.0; 7]), &chosen, Some(AngleUnit::Degrees), &[]).unwrap();
        assert_eq!((found.chosen["torso"].column.as_str(), found.is_unit_guessed), ("Trunk", false));
    }
}
