//! The choice of a column for each joint angle, in the forms for joint angles of a walk and for reference gaits.

use super::page_chart::{PageChart, shared_legend};
use crate::figures::lab_charts::joint_name;
use crate::figures::recording_traces::angle_over_time;
use crate::form_errors;
use gait_optimizer::ReferenceGait;
use gait_optimizer::limit_cycle::JOINTS;
use gait_optimizer::reference::AngleUnit;
use gaitwright_charts::{Chart, gait_charts};
use gaitwright_service::error::Error;
use gaitwright_service::studies::angle_columns::{ChosenColumn, ChosenColumns};
use gaitwright_service::studies::angle_curves::{AngleCurve, ColumnChoice};
use serde::Deserialize;
use std::collections::BTreeMap;

/// The joints without which a recording is no reference gait.
pub(super) const OF_REFERENCE: [&str; 5] = ["torso", "hip_L", "knee_L", "ankle_L", "hip_R"];
/// The joints that a reference gait can use.
pub(super) const USED_BY_REFERENCE: [&str; 6] = ["torso", "hip_L", "knee_L", "ankle_L", "hip_R", "knee_R"];

/// The entries as typed: the column of each joint (`column_knee_L`), and whether its sign is reversed (`reversed_knee_L`).
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(transparent)]
pub(super) struct AngleColumnFields(BTreeMap<String, String>);

impl AngleColumnFields {
    /// Whether the form asked for columns.
    pub(super) fn are_asked_for(&self) -> bool {
        self.0.keys().any(|name| name.starts_with("column_"))
    }

    pub(super) fn read(&self) -> Result<ChosenColumns, Error> {
        let is_known = |name: &str| {
            let joint = name.strip_prefix("column_").or_else(|| name.strip_prefix("reversed_"));
            joint.is_some_and(|joint| JOINTS.contains(&joint))
        };
        if let Some(unknown) = self.0.keys().find(|name| !is_known(name)) {
            return Err(form_errors::unknown_field(unknown).into());
        }
        let chosen = JOINTS.into_iter().filter_map(|joint| {
            let column = self.0.get(&format!("column_{joint}")).filter(|column| !column.is_empty())?.clone();
            let reversed = self.0.contains_key(&format!("reversed_{joint}"));
            Some((joint.to_owned(), ChosenColumn { column, reversed }))
        });
        Ok(chosen.collect())
    }
}

/// The columns of a file, as the page shows them.
#[derive(Debug)]
pub(super) struct ColumnsPage {
    pub(super) columns: Vec<String>,
    pub(super) angles: Vec<AngleChoice>,
    pub(super) legend: Vec<(String, String)>,
    /// Whether the unit was taken from the size of the angles.
    pub(super) is_unit_guessed: bool,
    /// How many signs look reversed.
    pub(super) doubts: usize,
    /// The reference gait beside which the angles are drawn.
    pub(super) normal: String,
}

/// An angle and its column.
#[derive(Debug)]
pub(super) struct AngleChoice {
    pub(super) joint: &'static str,
    pub(super) name: &'static str,
    /// Whether the file is of no use without it.
    pub(super) is_needed: bool,
    pub(super) column: String,
    pub(super) reversed: bool,
    /// Why its sign looks reversed; empty if it does not.
    pub(super) doubt: String,
    pub(super) chart: Option<PageChart>,
}

impl ColumnsPage {
    /// The choice for these joints, of which some are needed.
    pub(super) fn new(choice: &ColumnChoice, joints: &[&'static str], needed: &[&str]) -> Result<Self, Error> {
        let normal = ReferenceGait::builtin()?;
        let angle = |joint: &'static str| {
            let chosen = choice.chosen.get(joint);
            let curve = choice.curves.iter().find(|curve| curve.joint == joint);
            AngleChoice {
                joint,
                name: joint_name(joint),
                is_needed: needed.contains(&joint),
                column: chosen.map(|chosen| chosen.column.clone()).unwrap_or_default(),
                reversed: chosen.is_some_and(|chosen| chosen.reversed),
                doubt: curve.and_then(|curve| curve.doubt.clone()).unwrap_or_default(),
                chart: curve.and_then(|curve| chart(curve, &normal)).map(|chart| PageChart::new(&chart)),
            }
        };
        let mut angles: Vec<AngleChoice> = joints.iter().copied().map(angle).collect();
        let mut charts: Vec<PageChart> = angles.iter_mut().filter_map(|angle| angle.chart.take()).collect();
        let legend = shared_legend(&mut charts);
        let mut charts = charts.into_iter();
        for angle in &mut angles {
            if choice.curves.iter().any(|curve| curve.joint == angle.joint) {
                angle.chart = charts.next();
            }
        }
        Ok(Self {
            columns: choice.columns.clone(),
            doubts: angles.iter().filter(|angle| !angle.doubt.is_empty()).count(),
            angles,
            legend,
            is_unit_guessed: choice.is_unit_guessed,
            normal: normal.name,
        })
    }
}

/// The name of a unit in the form.
pub(super) fn unit_word(unit: AngleUnit) -> &'static str {
    match unit {
        AngleUnit::Degrees => "degrees",
        AngleUnit::Radians => "radians",
    }
}

/// An angle over the mean stride beside normal walking, or over time beside the range of normal walking.
fn chart(curve: &AngleCurve, normal: &ReferenceGait) -> Option<Chart> {
    let joint = JOINTS.iter().position(|known| *known == curve.joint)?;
    let title = joint_name(curve.joint);
    if !curve.cycle.is_empty() {
        return gait_charts::measured_beside_reference(title, joint, &curve.cycle, normal);
    }
    let angles = (0..=100).map(|percent| normal.seven_angles(f64::from(percent) / 100.0)[joint].to_degrees());
    let range = angles.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), angle| (low.min(angle), high.max(angle)));
    Some(angle_over_time(title, &curve.points, range))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fields(entries: &[(&str, &str)]) -> AngleColumnFields {
        AngleColumnFields(entries.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect())
    }

    #[test]
    fn entries_are_read_by_joint_and_others_are_refused() {
        let typed = fields(&[("column_torso", ""), ("column_knee_L", "L Knee"), ("reversed_knee_L", "on")]);
        assert!(typed.are_asked_for());
        let chosen = typed.read().unwrap();
        assert_eq!(chosen.len(), 1);
        assert_eq!(chosen["knee_L"], ChosenColumn { column: "L Knee".to_owned(), reversed: true });
        let refused = fields(&[("column_elbow", "x")]).read().unwrap_err().to_string();
        assert_eq!(refused, "The form has no field column_elbow.");
        assert!(!fields(&[]).are_asked_for());
    }
}
