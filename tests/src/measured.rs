//! Synthetic files like those of a motion laboratory.

use gait_optimizer::ReferenceGait;
use std::f64::consts::TAU;
use std::fmt::Write;

/// Six seconds of strides of 1.1 s at 1000 Hz: each channel is an oscillation whose amplitude varies over the stride,
/// that of the left tibialis anterior by a factor, and a switch under the right heel.
pub fn electromyogram(strength: f64) -> String {
    let mut text = "time_s,RF_L,TA_L,BF_L,GAS_L,RF_R,BF_R,heel\n".to_owned();
    for k in 0..6000_u32 {
        let phase = TAU * f64::from(k) / 1100.0;
        write!(text, "{}", f64::from(k) / 1000.0).unwrap();
        for channel in 0..6 {
            let swing = 1.0 + (phase + f64::from(channel)).cos();
            let carrier = (TAU * 0.083 * f64::from(k) + f64::from(channel)).sin();
            write!(text, ",{:.6}", (if channel == 1 { strength } else { 1.0 }) * swing * carrier).unwrap();
        }
        writeln!(text, ",{}", u8::from(k % 1100 > 400)).unwrap();
    }
    text
}

/// Ten seconds of the prosthetic joints at 100 Hz.
pub fn joint_angles() -> String {
    let mut text = "time_s,knee_R_rad,ankle_R_rad\n".to_owned();
    for k in 0..1000 {
        let phase = TAU * f64::from(k) / 110.0;
        writeln!(text, "{},{:.6},{:.6}", f64::from(k) / 100.0, 0.4 + 0.4 * phase.cos(), 0.2 * phase.sin()).unwrap();
    }
    text
}

/// Four strides of 1.1 s as a table for a reference gait, each a little higher than the one before.
pub fn four_strides(per_second: u32) -> String {
    let mut text = "time_s,torso_rad,hip_L_rad,knee_L_rad,ankle_L_rad,hip_R_rad,knee_R_rad\n".to_owned();
    for k in 0..=(44 * per_second / 10) {
        let time = f64::from(k) / f64::from(per_second);
        let phase = TAU * time / 1.1;
        let swing = phase.cos();
        let (hip, knee) = (0.2 + 0.4 * swing, 0.4 - 0.35 * swing);
        let (left_hip, left_knee, ankle) =
            (0.2 - 0.4 * swing, 0.4 + 0.35 * swing, 0.05 + 0.1 * phase.sin() + 0.02 * time);
        writeln!(text, "{time},0.1,{left_hip:.6},{left_knee:.6},{ankle:.6},{hip:.6},{knee:.6}").unwrap();
    }
    text
}

/// Eight strides of the built-in reference gait, 1.1 s each, in degrees under names of a laboratory. `signs` are those of
/// the torso and of the hip, knee and ankle of the left and of the right leg.
pub fn laboratory_angles(signs: [f64; 7]) -> String {
    let reference = ReferenceGait::builtin().unwrap();
    let mut text = "Time,Trunk,L Hip,L Knee,L Ankle,R Hip,R Knee,R Ankle\n".to_owned();
    for row in 0..880 {
        let time = f64::from(row) / 100.0;
        write!(text, "{time}").unwrap();
        for (angle, sign) in reference.seven_angles(time / 1.1).iter().zip(signs) {
            write!(text, ",{:.6}", sign * angle.to_degrees()).unwrap();
        }
        text.push('\n');
    }
    text
}
