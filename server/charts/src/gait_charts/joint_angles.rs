//! Joint angles. Every chart of them is made here, from [`JointAngle`]s, which know the leg over whose cycle they are drawn.

use super::group::Group;
use super::leg_cycle::{Cycle, Leg, Look};
use super::legs::{CYCLE, JOINTS, cycle_of_leg};
use super::overlaid_gait::{OverlaidGait, named, overlaid};
use super::reference_curve::{band_in_words, cycle_of, from_own_heel_strike, with_curve};
use crate::{Chart, Stroke};
use gait_optimizer::{Gait, ReferenceGait};

/// Colour of a reference gait beside several gaits.
const REFERENCE: usize = 7;
/// Meaning of a band.
const ONE_DEVIATION: &str = "one standard deviation";

/// An angle with the leg over whose cycle it is drawn, from the heel strike of that leg.
#[derive(Debug, Clone, Copy)]
struct JointAngle {
    /// Name of the chart of this angle alone.
    title: &'static str,
    leg: Leg,
    /// Index into q.
    coordinate: usize,
    /// Column of the reference gait, which has no angles of the joints of the prosthesis.
    column: Option<usize>,
}

const fn angle(title: &'static str, leg: Leg, coordinate: usize, column: Option<usize>) -> JointAngle {
    JointAngle { title, leg, coordinate, column }
}

/// Each joint on both sides: left, right. The torso leans over the cycle of each leg.
const BOTH_SIDES: [(&str, [JointAngle; 2]); 4] = [
    (JOINTS[0], [angle("Left hip", Leg::Left, 3, Some(1)), angle("Right hip", Leg::Right, 6, Some(4))]),
    (JOINTS[1], [angle("Left knee", Leg::Left, 4, Some(2)), angle("Right knee (prosthesis)", Leg::Right, 7, None)]),
    (JOINTS[2], [angle("Left ankle", Leg::Left, 5, Some(3)), angle("Right ankle (prosthesis)", Leg::Right, 8, None)]),
    ("Torso lean", [angle("Torso lean", Leg::Left, 2, Some(0)), angle("Torso lean", Leg::Right, 2, Some(0))]),
];

/// Every angle once; the torso over the cycle of the right leg.
fn every_angle() -> impl Iterator<Item = JointAngle> {
    let sides = BOTH_SIDES.into_iter().flat_map(|(_, sides)| sides);
    sides.filter(|angle| (angle.title, angle.leg) != ("Torso lean", Leg::Left))
}

impl JointAngle {
    fn with_reference(self, chart: Chart, reference: &ReferenceGait, look: &Look<'_>, band: Option<&str>) -> Chart {
        match self.column {
            Some(column) => with_curve(chart, reference, (column, self.leg), look, band),
            None => chart,
        }
    }

    fn with_gait(self, chart: Chart, cycle: &Cycle<'_>, look: &Look<'_>) -> Chart {
        cycle.with_line(chart, self.leg, look, |point| point.q[self.coordinate].to_degrees())
    }
}

fn chart(title: &str, cycle: &str) -> Chart {
    Chart::new(title, cycle, "angle, °")
}

/// Hip, knee, ankle and torso of a gait, both legs in one chart.
pub(super) fn angles(cycle: &Cycle<'_>, reference: &ReferenceGait) -> Group {
    let draw = |(title, sides): (&str, [JointAngle; 2])| {
        let below = sides.iter().fold(chart(title, CYCLE), |chart, angle| {
            let [label, band] = ["reference", ONE_DEVIATION].map(|what| format!("{what}, {}", angle.leg.name()));
            let look = Look { label: &label, colour: angle.leg.colour(), stroke: Stroke::Dotted };
            angle.with_reference(chart, reference, &look, Some(&band))
        });
        sides.iter().fold(below, |chart, angle| angle.with_gait(chart, cycle, &Look::of(angle.leg)))
    };
    group("Torso lean is drawn over the cycle of each leg.", reference, BOTH_SIDES.into_iter().map(draw).collect())
}

/// The same angles of several gaits, a chart for each joint of each leg.
pub(super) fn angles_of_several(gaits: &[OverlaidGait<'_>], reference: &ReferenceGait) -> Group {
    group("Torso lean is drawn over the cycle of the right leg.", reference, charts_of_several(gaits, reference))
}

fn group(torso: &str, reference: &ReferenceGait, charts: Vec<Chart>) -> Group {
    let hint = format!(
        "Flexion, dorsiflexion and forward lean are positive. {torso} Reference gait: {}. {} There is no reference for the joints of the prosthesis.",
        reference.name,
        band_in_words(reference)
    );
    Group::new("angles", "Joint angles", hint, charts)
}

/// The joint angles of a reference gait alone, both legs in one chart.
pub fn of_reference(reference: &ReferenceGait) -> Vec<Chart> {
    let draw = |(title, sides): (&str, [JointAngle; 2])| {
        let known = sides.iter().filter(|angle| angle.column.is_some());
        known.fold(chart(title, CYCLE), |chart, angle| {
            let label = format!("{} leg", angle.leg.name());
            let look = Look { label: &label, ..Look::of(angle.leg) };
            let band = format!("{ONE_DEVIATION}, {}", angle.leg.name());
            let mut chart = angle.with_reference(chart, reference, &look, Some(&band));
            chart.cycles.push(cycle_of(angle.leg, &look));
            chart
        })
    };
    BOTH_SIDES.into_iter().map(draw).collect()
}

/// The joint angles of a reference gait in one chart.
pub fn of_reference_in_one_chart(reference: &ReferenceGait) -> Chart {
    let known = every_angle().filter(|angle| angle.column.is_some()).enumerate();
    known.fold(chart("Reference gait", CYCLE), |chart, (place, angle)| {
        let label = angle.title.to_lowercase();
        let look = Look { label: &label, colour: place, stroke: Stroke::DISTINCT[place % Stroke::DISTINCT.len()] };
        angle.with_reference(chart, reference, &look, None)
    })
}

/// The joint angles of gaits over those of a reference gait, a chart for each joint. Each gait comes with its name.
pub fn with_reference(gaits: &[(&str, &Gait)], reference: &ReferenceGait) -> Vec<Chart> {
    charts_of_several(&overlaid(&named(gaits)), reference)
}

fn charts_of_several(gaits: &[OverlaidGait<'_>], reference: &ReferenceGait) -> Vec<Chart> {
    let draw = |angle: JointAngle| {
        let chart = chart(angle.title, &cycle_of_leg(angle.leg));
        let look = Look { label: "reference", colour: REFERENCE, stroke: Stroke::Dotted };
        let chart = angle.with_reference(chart, reference, &look, Some(ONE_DEVIATION));
        let with = |chart, gait: &OverlaidGait<'_>| {
            gait.with_line(chart, angle.leg, |point| point.q[angle.coordinate].to_degrees())
        };
        gaits.iter().fold(chart, with)
    };
    every_angle().map(draw).collect()
}

/// The curves of a reference gait beside which a measured angle of each joint is drawn: column, the leg over whose cycle the
/// reference has it, and the leg of the joint. Right knee and ankle have the curves of the left ones.
const MEASURED: [(usize, Leg, Leg); 7] = [
    (0, Leg::Right, Leg::Right),
    (1, Leg::Left, Leg::Left),
    (2, Leg::Left, Leg::Left),
    (3, Leg::Left, Leg::Left),
    (4, Leg::Right, Leg::Right),
    (2, Leg::Left, Leg::Right),
    (3, Leg::Left, Leg::Right),
];

/// A measured angle, °, over the cycle of its leg beside a reference gait. `joint` is its place among the joints of the walker,
/// and `from_right_heel_strike` has a value for each percent of the stride.
pub fn measured_beside_reference(
    title: &str,
    joint: usize,
    from_right_heel_strike: &[f64],
    reference: &ReferenceGait,
) -> Option<Chart> {
    let (column, of_reference, leg) = *MEASURED.get(joint)?;
    let chart = chart(title, &format!("gait cycle from {} heel strike, %", leg.name()));
    let look = Look { label: "normal walking", colour: REFERENCE, stroke: Stroke::Dotted };
    let chart = with_curve(chart, reference, (column, of_reference), &look, Some(ONE_DEVIATION));
    let measured = from_own_heel_strike(leg, from_right_heel_strike);
    Some(chart.with("this file", 0, Stroke::Solid, measured))
}

/// A measured angle at 0, 1, ..., 100 % of the cycle of the leg of its joint.
#[derive(Debug, Clone, Copy)]
pub struct MeasuredAngle<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// Colour of the measured line.
    pub colour: usize,
    /// Stroke of the measured line.
    pub stroke: Stroke,
    /// Mean, rad.
    pub mean_rad: &'a [f64],
    /// Standard deviation, rad.
    pub standard_deviation_rad: &'a [f64],
    /// The gait of the walk, if it is known, with the colour of its line.
    pub gait: Option<(&'a Gait, usize)>,
}

/// Measured angles over the cycle of their leg, each beside the computed angle of its gait. `joint` is its place among the joints of
/// the walker.
pub fn measured_beside_gaits(title: &str, joint: usize, walks: &[MeasuredAngle<'_>]) -> Option<Chart> {
    let (_, _, leg) = *MEASURED.get(joint)?;
    let line = |angles: &[f64]| angles.iter().enumerate().map(|(at, angle)| (at as f64, angle.to_degrees())).collect();
    let with = |chart: Chart, walk: &MeasuredAngle<'_>| {
        let band = walk.mean_rad.iter().zip(walk.standard_deviation_rad).enumerate();
        let band =
            band.map(|(at, (mean, sd))| (at as f64, (mean - sd).to_degrees(), (mean + sd).to_degrees())).collect();
        let chart = chart.with_band(&format!("{ONE_DEVIATION}, {}", walk.name), walk.colour, band);
        let chart = chart.with(&format!("measured, {}", walk.name), walk.colour, walk.stroke, line(walk.mean_rad));
        match walk.gait {
            Some((gait, colour)) => {
                let label = format!("computed, {}", walk.name);
                let look = Look { label: &label, colour, stroke: Stroke::Dashed };
                Cycle::of(gait).with_line(chart, leg, &look, |point| point.q[joint + 2].to_degrees())
            }
            None => chart,
        }
    };
    Some(walks.iter().fold(chart(title, &cycle_of_leg(leg)), with))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gait_optimizer::reference::REFERENCE_ROWS;

    /// Every chart of joint angles of a reference gait with a standard deviation, beside no gait.
    fn charts() -> (ReferenceGait, Vec<Chart>) {
        let mut reference = ReferenceGait::builtin().unwrap();
        reference.standard_deviation_rad = Some(vec![[0.1; 5]; REFERENCE_ROWS]);
        let mut charts = of_reference(&reference);
        charts.extend(with_reference(&[], &reference));
        charts.push(of_reference_in_one_chart(&reference));
        (reference, charts)
    }

    #[test]
    fn left_swing_peak_of_the_knee_follows_the_left_heel_strike() {
        let (_, charts) = charts();
        let knees = charts.iter().flat_map(|chart| {
            let is_knee =
                |label: &str| chart.title == "Knee" || format!("{} {label}", chart.title).contains("eft knee");
            chart.series.iter().filter(move |series| is_knee(&series.label))
        });
        let peaks: Vec<f64> =
            knees.map(|series| series.points.iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap().0).collect();
        assert_eq!(peaks.len(), 3, "with both legs, beside gaits, and with all angles");
        // A knee is most flexed in swing, at about 70 % of the cycle of its leg.
        assert!(peaks.iter().all(|peak| (65.0..80.0).contains(peak)), "{peaks:?}");
    }

    #[test]
    fn reference_of_the_left_leg_begins_half_a_stride_later() {
        let (reference, charts) = charts();
        let (knee, at) = (&charts[1], |row: usize| reference.angles_rad[row][2].to_degrees());
        assert_eq!(knee.series.len(), 1, "a reference gait has no right knee");
        let heights: Vec<f64> = [0, 20, 50, 51, 100].map(|percent| knee.series[0].points[percent].1).into();
        assert_eq!(heights, [at(50), at(70), at(100), at(1), at(50)]);
        let (_, low, high) = knee.bands[0].points[0];
        assert!((high - low - 0.2_f64.to_degrees()).abs() < 1e-9);
        assert_eq!((knee.cycles[0].begins_percent, knee.cycles[0].colour), (50.0, Some(Leg::Left.colour())));
    }

    #[test]
    fn torso_has_the_band_of_each_leg() {
        let (_, charts) = charts();
        let torso = charts.iter().find(|chart| chart.title == "Torso lean").unwrap();
        let names: Vec<&str> = torso.bands.iter().map(|band| band.label.as_str()).collect();
        assert_eq!(names, ["one standard deviation, left", "one standard deviation, right"]);
    }

    #[test]
    fn every_joint_beside_gaits_has_a_chart_even_without_a_reference() {
        let titles: Vec<String> = with_reference(&[], &charts().0).into_iter().map(|chart| chart.title).collect();
        let expected =
            "Left hip, Right hip, Left knee, Right knee (prosthesis), Left ankle, Right ankle (prosthesis), Torso lean";
        assert_eq!(titles.join(", "), expected);
    }

    #[test]
    fn measured_angles_are_drawn_over_the_cycle_of_their_leg_like_the_reference() {
        let reference = ReferenceGait::builtin().unwrap();
        for joint in 0..7 {
            let angle = |row: usize| reference.seven_angles(row as f64 / 100.0)[joint].to_degrees();
            let measured: Vec<f64> = (0..REFERENCE_ROWS).map(angle).collect();
            let chart = measured_beside_reference("", joint, &measured, &reference).unwrap();
            let [normal, file] = &chart.series[..] else { panic!("{:?}", chart.series) };
            let differ = normal.points.iter().zip(&file.points).map(|(a, b)| (a.1 - b.1).abs()).fold(0.0, f64::max);
            // The stride of the built-in gait is not closed exactly.
            assert!(differ < 1.0 && file.points.len() == REFERENCE_ROWS, "joint {joint}: {differ}");
        }
        assert!(measured_beside_reference("", 7, &[], &reference).is_none());
    }
}
