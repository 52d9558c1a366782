//! A reference gait below the curves that are compared with it, with the band of its standard deviation if it has one.

use super::{Chart, Stroke};
use gait_optimizer::ReferenceGait;

/// Colour of a reference.
const COLOUR: usize = 7;

/// A chart over the gait cycle with one coordinate of a reference.
pub fn over_reference(chart: Chart, reference: &ReferenceGait, column: usize) -> Chart {
    let mean = |row: usize| reference.angles_rad[row][column].to_degrees();
    let rows = 0..reference.angles_rad.len();
    let chart = match &reference.standard_deviation_rad {
        Some(deviation) => {
            let band = rows.clone().map(|row| {
                let deviation = deviation[row][column].to_degrees();
                (row as f64, mean(row) - deviation, mean(row) + deviation)
            });
            chart.with_band("one standard deviation", COLOUR, band.collect())
        }
        None => chart,
    };
    chart.with("reference", COLOUR, Stroke::Dotted, rows.map(|row| (row as f64, mean(row))).collect())
}

/// A sentence that explains the band.
pub fn band_in_words(reference: &ReferenceGait) -> &'static str {
    if reference.standard_deviation_rad.is_some() {
        "The band is one standard deviation of the reference gait over its strides."
    } else {
        "The reference gait has no standard deviation, so there is no band."
    }
}
