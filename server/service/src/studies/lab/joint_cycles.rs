//! Measured joint angles over the gait cycle: the mean of the strides of each leg, from its own heel strike. Heel strikes are found
//! from the angles of torso, hip and knee of that leg.

use super::file_format::WHAT;
use gait_optimizer::limit_cycle::JointRecording;
use gait_optimizer::reference::{HeelStrikes, MotionRecording, RecordedStride, mean_cycle};

/// A leg of the walker.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WalkingLeg {
    /// The left leg.
    Left,
    /// The right leg, which has the prosthesis.
    Right,
}

impl WalkingLeg {
    /// The leg over whose cycle a joint is drawn: its own; the torso over that of the right leg.
    pub fn of_joint(joint: &str) -> Self {
        if joint.ends_with("_L") { Self::Left } else { Self::Right }
    }
}

/// A measured joint angle at 0, 1, ..., 100 % of the gait cycle of its leg.
#[derive(Debug, Clone, PartialEq)]
pub struct JointCycle {
    /// Name of the joint, one of [`gait_optimizer::limit_cycle::JOINTS`].
    pub joint: &'static str,
    /// Number of strides.
    pub strides: usize,
    /// Mean angle, rad.
    pub mean_rad: Vec<f64>,
    /// Standard deviation, rad; zero for a single stride.
    pub standard_deviation_rad: Vec<f64>,
}

/// Heel strikes of a leg, s, and the strides between them; `None` without the angles of torso, hip and knee, or if no heel strike
/// can be found.
pub(super) fn strides(recording: &JointRecording, leg: WalkingLeg) -> Option<(Vec<f64>, Vec<RecordedStride>)> {
    let joint = |name: &str| recording.joints.iter().find(|(known, _)| *known == name).map(|(_, angles)| angles);
    let [hip, knee] = match leg {
        WalkingLeg::Left => ["hip_L", "knee_L"],
        WalkingLeg::Right => ["hip_R", "knee_R"],
    };
    let (torso, hip, knee) = (joint("torso")?, joint(hip)?, joint(knee)?);
    let motion = MotionRecording {
        what: WHAT.to_owned(),
        time_s: times(recording),
        // The leg takes the place of the right one. The position of its heel does not depend on the other leg.
        angles_rad: torso.iter().zip(hip).map(|(torso, hip)| [*torso, 0.0, 0.0, 0.0, *hip]).collect(),
        knee_r_rad: Some(knee.clone()),
        right_force: None,
        steps: Vec::new(),
    };
    let strikes = motion.heel_strikes(&HeelStrikes::Kinematics).ok()?;
    let strides = motion.strides(&strikes);
    Some((strikes, strides))
}

fn times(recording: &JointRecording) -> Vec<f64> {
    let samples = recording.joints.first().map_or(0, |(_, angles)| angles.len());
    (0..samples).map(|sample| sample as f64 / recording.rate_hz).collect()
}

/// The cycle of each recorded joint whose leg has plausible strides.
pub(super) fn joint_cycles(recording: &JointRecording) -> Vec<JointCycle> {
    let used = |leg| -> Vec<(f64, f64)> {
        let found = strides(recording, leg).map_or_else(Vec::new, |(_, strides)| strides);
        found.iter().filter(|stride| stride.is_used).map(|stride| (stride.start_s, stride.end_s)).collect()
    };
    let (left, right) = (used(WalkingLeg::Left), used(WalkingLeg::Right));
    let times = times(recording);
    let cycle = |(joint, angles): &(&'static str, Vec<f64>)| {
        let strides = if WalkingLeg::of_joint(joint) == WalkingLeg::Left { &left } else { &right };
        let mean_rad = mean_cycle(&times, angles, strides);
        let each: Vec<Vec<f64>> = strides.iter().map(|stride| mean_cycle(&times, angles, &[*stride])).collect();
        let deviation = |(percent, mean): (usize, &f64)| {
            let squares: f64 = each.iter().filter_map(|one| one.get(percent)).map(|angle| (angle - mean).powi(2)).sum();
            (squares / (each.len().max(2) - 1) as f64).sqrt()
        };
        let standard_deviation_rad = mean_rad.iter().enumerate().map(deviation).collect();
        JointCycle { joint, strides: strides.len(), mean_rad, standard_deviation_rad }
    };
    recording.joints.iter().map(cycle).filter(|cycle| cycle.strides > 0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Twelve seconds of legs that swing once in 1.2 s, the left one 0.48 s after the right one.
    fn recording() -> JointRecording {
        let samples = |lag_s: f64, angle: fn(f64) -> f64| -> Vec<f64> {
            (0..1200).map(|sample| angle(TAU * (f64::from(sample) / 100.0 - lag_s) / 1.2)).collect()
        };
        let joints = vec![
            ("torso", samples(0.0, |_| 0.02)),
            ("hip_L", samples(0.48, |phase| 0.4 * phase.cos())),
            ("knee_L", samples(0.48, |phase| 0.4 * phase.cos())),
            ("hip_R", samples(0.0, |phase| 0.4 * phase.cos())),
            ("knee_R", samples(0.0, |phase| 0.4 * phase.cos())),
            ("ankle_R", samples(0.0, |phase| 0.2 * phase.sin())),
        ];
        JointRecording { rate_hz: 100.0, joints }
    }

    #[test]
    fn each_leg_has_its_own_cycle() {
        let cycles = joint_cycles(&recording());
        let of = |joint: &str| cycles.iter().find(|cycle| cycle.joint == joint);
        let (left, right) = (of("knee_L"), of("knee_R"));
        let (Some(left), Some(right)) = (left, right) else { panic!("{cycles:?}") };
        assert_eq!(left.mean_rad.len(), 101);
        // The legs move alike, so they do over their own cycles, whatever lies between their heel strikes.
        let differ = left.mean_rad.iter().zip(&right.mean_rad).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(differ < 0.02, "{differ}");
        assert!(left.standard_deviation_rad.iter().all(|deviation| *deviation < 0.02));
        assert!(left.strides >= 7 && right.strides >= 7, "{} {}", left.strides, right.strides);
    }

    #[test]
    fn joints_of_a_leg_without_heel_strikes_have_no_cycle() {
        let mut recording = recording();
        recording.joints.retain(|(joint, _)| *joint != "hip_L");
        let joints: Vec<_> = joint_cycles(&recording).into_iter().map(|cycle| cycle.joint).collect();
        assert_eq!(joints, ["torso", "hip_R", "knee_R", "ankle_R"]);
    }
}
