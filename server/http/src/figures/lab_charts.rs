//! The charts of a lab session: muscle activity over the cycle, limit cycles.

use gait_optimizer::Gait;
use gait_optimizer::emg::{CHANNELS, CycleActivity, CycleStart, muscle_of};
use gait_optimizer::limit_cycle::JOINTS;
use gaitwright_charts::gait_charts::{self, MeasuredAngle};
use gaitwright_charts::{Chart, Figure, Stroke};
use gaitwright_service::studies::lab::{LabSessionView, LimitCycles, ProcessedEmg, WalkCondition};

/// Names of the joints, in the order of [`JOINTS`] and of the gait's coordinates after the hip position.
const JOINT_NAMES: [&str; 7] =
    ["Torso lean", "Left hip", "Left knee", "Left ankle", "Right hip", "Right knee", "Right ankle"];

/// The condition of a walk, or its number while it is blinded.
pub(crate) fn walk_name(session: &LabSessionView, walk: u8) -> String {
    let condition = session.walks.iter().find(|known| known.number == walk).and_then(|known| known.condition);
    match condition {
        Some(WalkCondition::Normal) => "without the device".to_owned(),
        Some(WalkCondition::GaitA) => "gait A".to_owned(),
        Some(WalkCondition::GaitB) => "gait B".to_owned(),
        None => format!("walk {walk}"),
    }
}

/// The name of a channel.
pub(crate) fn muscle_name(channel: &str) -> &str {
    muscle_of(channel).unwrap_or(channel)
}

/// Each EMG channel and its muscle.
pub(crate) fn muscles() -> [(&'static str, &'static str); 6] {
    CHANNELS.map(|channel| (channel, muscle_name(channel)))
}

/// The name of a joint, one of [`JOINTS`].
pub(crate) fn joint_name(joint: &str) -> &str {
    JOINTS.iter().zip(JOINT_NAMES).find(|(known, _)| **known == joint).map_or(joint, |(_, name)| name)
}

/// The axis of a channel.
fn cycle(activity: &CycleActivity) -> &'static str {
    match activity.begins_at {
        CycleStart::RightHeelStrike => "gait cycle from right heel strike, %",
        CycleStart::LeftHeelStrike | CycleStart::AssumedLeftHeelStrike => "gait cycle from left heel strike, %",
    }
}

/// Muscle activity over the gait cycle (figure 6 of the paper): a chart for each channel with mean and standard deviation
/// of each walk, and the activation of the model after unblinding.
pub(crate) fn emg(session: &LabSessionView, emg: &ProcessedEmg) -> Vec<Figure> {
    let Some(normal) = emg.result.walks.first() else { return Vec::new() };
    let chart = |(place, channel): (usize, &CycleActivity)| {
        let mut chart = Chart::new(
            &format!("EMG, {}", muscle_name(&channel.channel)),
            cycle(channel),
            "share of the peak without the device",
        );
        for walk in &emg.result.walks {
            let Some(activity) = walk.channels.get(place) else { continue };
            let name = walk_name(session, walk.walk);
            let (colour, stroke) = look(walk.walk);
            let mean = activity.mean.iter().enumerate().map(|(point, value)| (point as f64, *value)).collect();
            if walk.walk == 1 {
                let band = activity.mean.iter().zip(&activity.standard_deviation).enumerate();
                let band = band.map(|(point, (mean, sd))| (point as f64, mean - sd, mean + sd)).collect();
                chart = chart.with_band("one standard deviation", colour, band);
            }
            chart = chart.with(&name, colour, stroke, mean);
        }
        for walk in &emg.model {
            let Some(muscle) = walk.muscles.iter().find(|muscle| muscle.channel == channel.channel) else { continue };
            let label = format!("model, {}: {}", walk_name(session, walk.walk), muscle.muscle);
            let line = muscle.activation.iter().enumerate().map(|(point, value)| (point as f64, *value)).collect();
            chart = chart.with(&label, 2 + usize::from(walk.walk), Stroke::Dashed, line);
        }
        Figure::chart("", chart)
    };
    normal.channels.iter().enumerate().map(chart).collect()
}

/// Mean muscle activity over the gait cycle of a file that is not stored yet, in the unit of the file.
pub(crate) fn cycles_of_file(cycles: &[CycleActivity]) -> Vec<Chart> {
    let chart = |activity: &CycleActivity| {
        let title = format!("EMG, {}", muscle_name(&activity.channel));
        let points = activity.mean.iter().zip(&activity.standard_deviation).enumerate();
        let band = points.clone().map(|(point, (mean, sd))| (point as f64, mean - sd, mean + sd)).collect();
        let mean = points.map(|(point, (mean, _))| (point as f64, *mean)).collect();
        Chart::new(&title, cycle(activity), "activity, in the unit of the file")
            .with_band("one standard deviation", 0, band)
            .with("mean of the strides", 0, Stroke::Solid, mean)
    };
    cycles.iter().map(chart).collect()
}

/// The colour and stroke of a walk.
fn look(walk: u8) -> (usize, Stroke) {
    match walk {
        1 => (7, Stroke::Dashed),
        2 => (0, Stroke::Solid),
        _ => (1, Stroke::Solid),
    }
}

/// Measured joint angles over the cycle of each leg: a chart for each joint with every walk, and the angles of the gait where it is
/// known.
pub(crate) fn joint_angles(session: &LabSessionView, measured: &[(LimitCycles, Option<Gait>)]) -> Vec<Figure> {
    let names: Vec<String> = measured.iter().map(|(walk, _)| walk_name(session, walk.walk)).collect();
    let chart = |(place, joint): (usize, &&str)| {
        let walks: Vec<MeasuredAngle<'_>> = measured
            .iter()
            .zip(&names)
            .filter_map(|((walk, gait), name)| {
                let cycle = walk.cycles.iter().find(|cycle| cycle.joint == *joint)?;
                let (colour, stroke) = look(walk.walk);
                Some(MeasuredAngle {
                    name,
                    colour,
                    stroke,
                    mean_rad: &cycle.mean_rad,
                    standard_deviation_rad: &cycle.standard_deviation_rad,
                    gait: gait.as_ref().map(|gait| (gait, 2 + usize::from(walk.walk))),
                })
            })
            .collect();
        let chart = gait_charts::measured_beside_gaits(JOINT_NAMES[place], place, &walks)?;
        (!walks.is_empty()).then(|| Figure::chart("angle", chart))
    };
    JOINTS.iter().enumerate().filter_map(chart).collect()
}

/// Measured limit cycles (figure 5 of the paper): a chart per joint and walk, over the limit cycle of the gait where it is known.
pub(crate) fn limit_cycles(session: &LabSessionView, measured: &[(LimitCycles, Option<Gait>)]) -> Vec<Figure> {
    let mut charts = Vec::new();
    for (place, joint) in JOINTS.iter().enumerate() {
        for (walk, gait) in measured {
            let Some(limit_cycle) = walk.joints.iter().find(|limit_cycle| limit_cycle.joint == *joint) else {
                continue;
            };
            let name = walk_name(session, walk.walk);
            let line = limit_cycle.angle_rad.iter().zip(&limit_cycle.velocity_rad_s);
            let line = line.map(|(angle, velocity)| (angle.to_degrees(), velocity.to_degrees())).collect();
            let title = format!("{}, {name}", JOINT_NAMES[place]);
            let mut chart = Chart::new(&title, "angle, °", "velocity, °/s").with("measured", 7, Stroke::Solid, line);
            if let Some(gait) = gait {
                chart =
                    chart.with("limit cycle of the gait", 1, Stroke::Solid, gait_charts::limit_cycle(gait, place + 2));
            }
            charts.push(Figure::chart("limit-cycle", chart));
        }
    }
    charts
}
