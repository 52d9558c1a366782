//! Which column of a file is which joint angle, for files whose columns do not have the names of their format.

use super::column_names::{ColumnName, NamedSide};
use crate::error::{Error, FieldError};
use gait_optimizer::angle_table::{AngleColumn, AngleTable};
use gait_optimizer::limit_cycle::JOINTS;
use gait_optimizer::reference::{AngleUnit, REFERENCE_COLUMNS};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// The column of a joint angle.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, Serialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ChosenColumn {
    /// Name of the column in the file.
    pub column: String,
    /// Whether the sign of the column is opposite to that of the walker, in which forward lean, flexion and dorsiflexion are
    /// positive.
    #[serde(default)]
    pub reversed: bool,
}

/// The column of each chosen angle, by joint.
pub type ChosenColumns = BTreeMap<String, ChosenColumn>;

/// Words in the names of columns of each part of the body.
const PARTS: [(&str, &[&str]); 4] = [
    ("torso", &["torso", "trunk", "thorax", "pelvis_tilt", "pelvictilt", "pelvis tilt"]),
    ("hip", &["hip"]),
    ("knee", &["knee"]),
    ("ankle", &["ankle"]),
];
/// Parts of the names of columns that are no angle in the plane of walking.
const OTHER_THAN_FLEXION: [&str; 22] = [
    "moment",
    "moments",
    "torque",
    "power",
    "force",
    "velocity",
    "vel",
    "acc",
    "speed",
    "adduction",
    "abduction",
    "add",
    "abd",
    "rotation",
    "rot",
    "beta",
    "obliquity",
    "list",
    "bending",
    "y",
    "z",
    "u",
];
/// Parts of the names of columns of angles in the plane of walking.
const FLEXION: [&str; 10] =
    ["flexion", "flex", "extension", "angle", "angles", "dorsiflexion", "sagittal", "tilt", "lean", "x"];
/// Columns of OpenSim's gait models whose sign is opposite to that of the walker.
const REVERSED: [&str; 3] = ["knee_angle_l", "knee_angle_r", "pelvis_tilt"];

/// The columns as the reading of a file takes them.
///
/// # Errors
/// [`Error::Invalid`] for an unknown joint, and for a column of two joints.
pub(super) fn columns_of<'a>(field: &str, chosen: &'a ChosenColumns) -> Result<Vec<AngleColumn<'a>>, Error> {
    if let Some(unknown) = chosen.keys().find(|joint| !JOINTS.contains(&joint.as_str())) {
        return Err(Error::invalid(field, unknown.as_str(), &format!("one of {}", JOINTS.join(", "))));
    }
    let mut taken: Vec<(&str, &str)> = Vec::new();
    for (joint, ChosenColumn { column, .. }) in chosen {
        if let Some((other, _)) = taken.iter().find(|(_, known)| known == column) {
            let message = format!(
                "Column {column:?} is chosen for both {} and {}. Each angle needs its own column.",
                in_words(other),
                in_words(joint)
            );
            return Err(FieldError::in_words(field, &message).into());
        }
        taken.push((joint, column));
    }
    let column = |(joint, chosen): (&'a String, &'a ChosenColumn)| AngleColumn {
        joint,
        column: &chosen.column,
        reversed: chosen.reversed,
    };
    Ok(chosen.iter().map(column).collect())
}

/// Checks that every angle of a reference gait has a column.
///
/// # Errors
/// [`Error::Invalid`] naming the missing angles.
pub(super) fn check_complete(field: &str, chosen: &ChosenColumns) -> Result<(), Error> {
    let joints = REFERENCE_COLUMNS.map(|column| column.trim_end_matches("_rad"));
    let missing = joints.into_iter().filter(|joint| !chosen.contains_key(*joint));
    let missing: Vec<String> = missing.map(|joint| format!("{} ({joint})", in_words(joint))).collect();
    if missing.is_empty() {
        return Ok(());
    }
    Err(FieldError::in_words(field, &format!("Choose a column for each of these angles: {}.", missing.join(", ")))
        .into())
}

/// The unit of the angles: that of the header or the given one, which must agree.
///
/// # Errors
/// [`Error::Invalid`] naming the field of the unit.
pub(super) fn unit_of(field: &str, file: &AngleTable, given: Option<AngleUnit>) -> Result<AngleUnit, Error> {
    match (file.unit(), given) {
        (Some(of_file), Some(given)) if of_file != given => {
            let message = "The header of the file gives another unit of the angles.";
            Err(FieldError::in_words(field, message).into())
        }
        (Some(unit), _) | (None, Some(unit)) => Ok(unit),
        (None, None) => Err(FieldError::in_words(field, "Give the unit of the angles: degrees or radians.").into()),
    }
}

/// A joint in words, such as *left knee*.
pub(super) fn in_words(joint: &str) -> String {
    match joint.split_once('_') {
        Some((part, "L")) => format!("left {part}"),
        Some((part, _)) => format!("right {part}"),
        None => joint.to_owned(),
    }
}

/// The column of each joint that the name of a column tells.
pub(super) fn guessed(columns: &[String]) -> ChosenColumns {
    let mut found = ChosenColumns::new();
    for joint in JOINTS {
        let exact = format!("{joint}_rad");
        let column = columns.iter().find(|column| **column == exact).or_else(|| named(joint, columns));
        if let Some(column) = column {
            let reversed = REVERSED.contains(&column.as_str());
            found.insert(joint.to_owned(), ChosenColumn { column: column.clone(), reversed });
        }
    }
    found
}

/// The column whose name tells this joint best.
fn named<'a>(joint: &str, columns: &'a [String]) -> Option<&'a String> {
    let (part, side) = match joint.split_once('_') {
        Some((part, "L")) => (part, Some(NamedSide::Left)),
        Some((part, _)) => (part, Some(NamedSide::Right)),
        None => (joint, None),
    };
    let (_, words) = PARTS.iter().find(|(known, _)| *known == part)?;
    let likeness = |column: &String| {
        let name = ColumnName::read(column);
        let is_of_part = words.iter().any(|word| name.contains(word));
        let is_of_side = side.is_none_or(|side| words.iter().any(|word| name.side_with(word) == Some(side)));
        if !is_of_part || !is_of_side || name.has_part_of(&OTHER_THAN_FLEXION) {
            return None;
        }
        Some(u8::from(name.has_part_of(&FLEXION)))
    };
    let mut best: Option<(&String, u8)> = None;
    for column in columns {
        if let Some(found) = likeness(column)
            && best.is_none_or(|(_, known)| found > known)
        {
            best = Some((column, found));
        }
    }
    best.map(|(column, _)| column)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn guesses(columns: &[&str]) -> Vec<(String, String, bool)> {
        let columns: Vec<String> = columns.iter().map(|column| (*column).to_owned()).collect();
        guessed(&columns).into_iter().map(|(joint, chosen)| (joint, chosen.column, chosen.reversed)).collect()
    }

    #[test]
    fn angles_are_found_by_usual_names_and_other_quantities_are_not_taken() {
        let found = guesses(&[
            "Trunk lean",
            "LHipAngles_Y",
            "LHipAngles_X",
            "Left knee moment",
            "Left knee flexion",
            "ankle_angle_l",
            "hip_adduction_r",
            "hip_flexion_r",
            "knee_angle_r",
        ]);
        let expected = [
            ("ankle_L", "ankle_angle_l", false),
            ("hip_L", "LHipAngles_X", false),
            ("hip_R", "hip_flexion_r", false),
            ("knee_L", "Left knee flexion", false),
            ("knee_R", "knee_angle_r", true),
            ("torso", "Trunk lean", false),
        ];
        let expected = expected.map(|(joint, column, reversed)| (joint.to_owned(), column.to_owned(), reversed));
        assert_eq!(found, expected);
        assert!(guesses(&["a", "b", "knee"]).is_empty(), "without a side");
    }

    #[test]
    fn unknown_joints_and_columns_taken_twice_are_refused() {
        let chosen = |pairs: &[(&str, &str)]| -> ChosenColumns {
            let column = |column: &str| ChosenColumn { column: column.to_owned(), reversed: false };
            pairs.iter().map(|(joint, name)| ((*joint).to_owned(), column(name))).collect()
        };
        let refused = |pairs: &[(&str, &str)]| columns_of("columns", &chosen(pairs)).unwrap_err().to_string();
        assert!(refused(&[("elbow", "a")]).starts_with("columns is \"elbow\"; it must be one of torso, hip_L"));
        let twice = refused(&[("knee_L", "a"), ("knee_R", "a")]);
        assert_eq!(twice, "Column \"a\" is chosen for both left knee and right knee. Each angle needs its own column.");
        assert_eq!(columns_of("columns", &chosen(&[("knee_L", "a"), ("torso", "b")])).unwrap().len(), 2);
    }
}
