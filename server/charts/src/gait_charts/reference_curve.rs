//! The curve of a reference gait over the cycle of a leg, with the band of its standard deviation if it has one.

use super::leg_cycle::{Leg, Look};
use crate::{Chart, LegCycle};
use gait_optimizer::ReferenceGait;
use gait_optimizer::reference::REFERENCE_ROWS;

/// The row of a reference gait at which the cycle of a leg begins. A reference gait has heel strikes of the right foot only;
/// the left foot strikes half a stride later, as in [`ReferenceGait::seven_angles`].
fn first_row(leg: Leg) -> usize {
    match leg {
        Leg::Left => (REFERENCE_ROWS - 1) / 2,
        Leg::Right => 0,
    }
}

/// A curve over the cycle of a leg, with percent: what comes before its heel strike follows the end of the stride. The left foot
/// is taken to strike like that of a reference gait.
pub(super) fn from_own_heel_strike(leg: Leg, from_right_heel_strike: &[f64]) -> Vec<(f64, f64)> {
    let last = REFERENCE_ROWS - 1;
    let place = |row: usize| if row > last { row - last } else { row };
    let value = |percent: usize| from_right_heel_strike.get(place(first_row(leg) + percent)).copied();
    (0..=last).filter_map(|percent| Some((percent as f64, value(percent)?))).collect()
}

/// Adds one coordinate of a reference gait, over the cycle of a leg. `band` is the name of its band; `None`: without one.
pub(super) fn with_curve(
    chart: Chart,
    reference: &ReferenceGait,
    (column, leg): (usize, Leg),
    look: &Look<'_>,
    band: Option<&str>,
) -> Chart {
    let last = REFERENCE_ROWS - 1;
    let rows = (0..=last).map(|percent| {
        let row = first_row(leg) + percent;
        // The stride is periodic: its start follows its end.
        (percent as f64, if row > last { row - last } else { row })
    });
    let mean = |row: usize| reference.angles_rad[row][column].to_degrees();
    let chart = match band.zip(reference.standard_deviation_rad.as_ref()) {
        Some((name, deviation)) => {
            let band = rows.clone().map(|(percent, row)| {
                let deviation = deviation[row][column].to_degrees();
                (percent, mean(row) - deviation, mean(row) + deviation)
            });
            chart.with_band(name, look.colour, band.collect())
        }
        None => chart,
    };
    chart.with(look.label, look.colour, look.stroke, rows.map(|(percent, row)| (percent, mean(row))).collect())
}

/// The cycle of a leg of a reference gait on an axis that begins with its heel strike.
pub(super) fn cycle_of(leg: Leg, look: &Look<'_>) -> LegCycle {
    LegCycle { colour: Some(look.colour), begins_percent: first_row(leg) as f64, toe_off_percent: None }
}

/// A sentence that explains the band.
pub fn band_in_words(reference: &ReferenceGait) -> &'static str {
    if reference.standard_deviation_rad.is_some() {
        "The band shows one standard deviation on either side of the mean."
    } else {
        "The reference gait has no standard deviation, so there is no band."
    }
}
