//! An execution report as a sentence.

use super::execution_report::{ExecutionReport, SimulatedWalksOnGround};

impl SimulatedWalksOnGround {
    /// The ground, as in "ground uneven by ±5 mm".
    pub fn ground_in_words(&self) -> String {
        match 1000.0 * self.ground_height_m {
            0.0 => "level ground".to_owned(),
            millimetres => format!("ground uneven by ±{millimetres} mm"),
        }
    }
}

impl ExecutionReport {
    /// How many walks were complete on each kind of ground.
    pub fn sentence(&self) -> String {
        let mut grounds: Vec<String> = self
            .grounds
            .iter()
            .map(|on| {
                format!(
                    "{} of {} simulated walks on {}",
                    on.completed,
                    on.number_of_simulated_walks,
                    on.ground_in_words()
                )
            })
            .collect();
        let strides = if self.strides == 1 { "1 stride".to_owned() } else { format!("{} strides", self.strides) };
        match (grounds.pop(), grounds.is_empty()) {
            (None, _) => "No walk with random disturbances was simulated.".to_owned(),
            (Some(only), true) => format!("{only} lasted {strides}."),
            (Some(last), false) => format!("{} and {last} lasted {strides}.", grounds.join(", ")),
        }
    }
}
