//! The joint angles of the different gaits of an atlas, as `gaitwright atlas --joint-angles` writes them.

use std::collections::BTreeMap;

use gait_learner::ActionDescriptors;

use crate::problems::GaitOfAction;

/// The joint angles of each gait, by its number.
pub struct JointAngles(BTreeMap<u32, Vec<f64>>);

impl JointAngles {
    /// Reads a table with a row for each gait: its number, then its angles.
    pub fn parse(text: &str) -> Result<Self, String> {
        let row = |line: &str| {
            let (number, angles) = line.split_once(',').ok_or("a row has no angle")?;
            let number = number.parse::<u32>().map_err(|_| format!("{number:?} is not the number of a gait"))?;
            let angle = |text: &str| text.parse::<f64>().map_err(|_| format!("{text:?} is not an angle"));
            Ok((number, angles.split(',').map(angle).collect::<Result<Vec<f64>, String>>()?))
        };
        text.lines().skip(1).map(row).collect::<Result<_, String>>().map(Self)
    }

    /// The angles of the gait of an action.
    pub fn of(&self, gait: &GaitOfAction) -> Option<&[f64]> {
        self.0.get(&gait.number).map(Vec::as_slice)
    }

    /// The angles as descriptors of actions.
    pub fn descriptors(&self, gaits: &[GaitOfAction], lengthscale: f64) -> Result<ActionDescriptors, String> {
        let places: BTreeMap<u32, usize> = self.0.keys().copied().zip(0..).collect();
        let of_action = gaits.iter().map(|gait| places.get(&gait.number).copied()).collect();
        let descriptors: Vec<Vec<f64>> = self.0.values().cloned().collect();
        ActionDescriptors::new(of_action, &descriptors, lengthscale).map_err(|error| error.to_string())
    }
}
