//! A reference gait below the curves that are compared with it, with the band of its standard deviation if it has one.

use super::{Chart, Stroke};
use gait_optimizer::ReferenceGait;
use gait_optimizer::reference::REFERENCE_ROWS;

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

/// A chart over the cycle of a leg with one coordinate of a reference, in the colour and with the name of the leg. The
/// cycle begins where that of the gait does, as in Gait RMSE.
pub(crate) fn over_reference_of_leg(
    chart: Chart,
    reference: &ReferenceGait,
    column: usize,
    (colour, leg): (usize, &str),
    begins_percent: f64,
) -> Chart {
    let last = REFERENCE_ROWS - 1;
    let at = |rows: &[[f64; 5]], percent: usize| {
        let place = (begins_percent / 100.0 * last as f64 + percent as f64).rem_euclid(last as f64);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // 0 <= place < last
        let low = (place.floor() as usize).min(last - 1);
        (rows[low][column] + (place - low as f64) * (rows[low + 1][column] - rows[low][column])).to_degrees()
    };
    let mean = |percent: usize| at(&reference.angles_rad, percent);
    let chart = match &reference.standard_deviation_rad {
        Some(deviation) => {
            let band = (0..=last).map(|percent| {
                let deviation = at(deviation, percent);
                (percent as f64, mean(percent) - deviation, mean(percent) + deviation)
            });
            chart.with_band(&format!("one standard deviation, {leg}"), colour, band.collect())
        }
        None => chart,
    };
    let line = (0..=last).map(|percent| (percent as f64, mean(percent))).collect();
    chart.with(&format!("reference, {leg}"), colour, Stroke::Dotted, line)
}

/// A sentence that explains the band.
pub fn band_in_words(reference: &ReferenceGait) -> &'static str {
    if reference.standard_deviation_rad.is_some() {
        "The band shows one standard deviation on either side of the mean."
    } else {
        "The reference gait has no standard deviation, so there is no band."
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reference_of_a_leg_begins_at_its_heel_strike() {
        let mut reference = ReferenceGait::builtin().unwrap();
        reference.standard_deviation_rad = Some(vec![[0.1; 5]; REFERENCE_ROWS]);
        let chart = over_reference_of_leg(Chart::new("", "", ""), &reference, 2, (0, "left"), 49.5);
        let at = |row: usize| reference.angles_rad[row][2].to_degrees();
        let [first, .., last] = chart.series[0].points[..] else { panic!("no line") };
        // The strike is half-way between two rows; the cycle is periodic.
        assert!((first.1 - f64::midpoint(at(49), at(50))).abs() < 1e-9 && (first.1 - last.1).abs() < 1e-9);
        assert!((chart.series[0].points[20].1 - f64::midpoint(at(69), at(70))).abs() < 1e-9);
        let (_, low, high) = chart.bands[0].points[0];
        assert!((high - low - 0.2_f64.to_degrees()).abs() < 1e-9);
    }
}
