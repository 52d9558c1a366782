//! Choices of the command line whose types belong to the rules of studies, which know no command line.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use serde::de::DeserializeOwned;
use serde_json::Value;

/// A name and its help.
type FlagChoice = (&'static str, &'static str);

/// Formats of a file of joint angles.
pub(super) const JOINT_ANGLE_FORMATS: [FlagChoice; 3] = [
    ("opensim", "OpenSim motion or storage file (.mot, .sto) of a gait model"),
    (
        "camargo",
        "The `data` table of an `ik` file from the Camargo 2021 data set, exported as CSV with MATLAB's writetable",
    ),
    (
        "csv",
        "CSV file with the columns time_s, torso_rad, hip_L_rad, knee_L_rad, ankle_L_rad, hip_R_rad, and optionally knee_R_rad and right_force_n",
    ),
];
/// Units of angles.
pub(super) const ANGLE_UNITS: [FlagChoice; 2] = [("degrees", "Angles in degrees"), ("radians", "Angles in radians")];
/// Ways to find right heel strikes.
pub(super) const HEEL_STRIKES: [FlagChoice; 3] = [
    ("force", "Whenever the vertical force under the right foot rises above 20 N"),
    ("kinematics", "Whenever the right heel is farthest ahead of the pelvis"),
    ("ends", "At the first and the last row: the file is one stride"),
];
/// Formats of an EMG recording.
pub(super) const EMG_FORMATS: [FlagChoice; 2] =
    [("csv", "CSV file whose header names the columns"), ("opensim", "OpenSim storage file (.sto)")];

/// The gaits from which trials can be warm-started.
pub(super) const WARM_STARTS: [FlagChoice; 2] = [
    ("incumbent", "The best gait so far, as in the paper"),
    (
        "root",
        "The first gait, which has the default bounds, so that the gait of an action does not depend on other trials",
    ),
];

/// Effects of simulated walks in a study.
pub(super) const SIMULATED_WALKS: [FlagChoice; 4] = [
    ("none", "No walks are simulated"),
    ("report", "Each gait gets an execution report; trials are not affected"),
    ("tie_break", "Two gaits with nearly the same Gait RMSE are compared by their mean strides"),
    ("label", "A gait with too few mean strides is labelled not executable and is never recommended"),
];

/// Reads one of these names as the REST interface reads it.
pub(super) fn one_of<T>(choices: impl IntoIterator<Item = FlagChoice>) -> impl TypedValueParser<Value = T>
where
    T: DeserializeOwned + Clone + Send + Sync + 'static,
{
    let values = choices.into_iter().map(|(name, help)| PossibleValue::new(name).help(help));
    PossibleValuesParser::new(values).try_map(|name| serde_json::from_value::<T>(Value::String(name)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gaitwright_service::studies::lab::MeasurementFormat;
    use gaitwright_service::studies::reference_import::{JointAngleFormat, Strikes, Unit};
    use gaitwright_store::studies::{SimulatedWalksEffect, WarmStartFrom};

    fn all_are_known<T: DeserializeOwned>(choices: &[FlagChoice]) {
        for (name, _) in choices {
            assert!(serde_json::from_value::<T>(Value::from(*name)).is_ok(), "{name}");
        }
    }

    #[test]
    fn every_choice_is_a_value_of_the_rest_interface() {
        all_are_known::<JointAngleFormat>(&JOINT_ANGLE_FORMATS);
        all_are_known::<Unit>(&ANGLE_UNITS);
        all_are_known::<Strikes>(&HEEL_STRIKES);
        all_are_known::<MeasurementFormat>(&EMG_FORMATS);
        all_are_known::<WarmStartFrom>(&WARM_STARTS);
        all_are_known::<SimulatedWalksEffect>(&SIMULATED_WALKS);
        assert_eq!(SIMULATED_WALKS.map(|(name, _)| name), SimulatedWalksEffect::ALL.map(SimulatedWalksEffect::as_str));
    }
}
