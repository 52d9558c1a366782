//! Synthetic recordings of walking.

#![allow(dead_code)] // Each test file uses some of it.

use std::f64::consts::TAU;
use std::fmt::Write;

/// An OpenSim file in degrees with `strides` strides of 1.1 s at 100 Hz; the legs are in antiphase.
pub(crate) fn opensim(strides: usize) -> String {
    format!(
        "synthetic\nversion=1\nnRows={}\nnColumns=10\ninDegrees=yes\nendheader\ntime\tpelvis_tilt\thip_flexion_r\t\
         knee_angle_r\tankle_angle_r\thip_flexion_l\tknee_angle_l\tankle_angle_l\tlumbar_extension\tright_vy\n{}",
        110 * strides + 1,
        opensim_rows(strides, 1.0)
    )
}

/// The rows of such a file, with angles multiplied by `scale`.
pub(crate) fn opensim_rows(strides: usize, scale: f64) -> String {
    let mut text = String::new();
    for k in 0..=110 * strides {
        let time = k as f64 / 100.0;
        let phase = TAU * time / 1.1;
        let leg = |phase: f64| [10.0 + 25.0 * phase.cos(), -(25.0 - 20.0 * phase.cos()), 5.0 * phase.sin()];
        write!(text, "{time:.4}").unwrap();
        for angle in [[-3.0].as_slice(), &leg(phase), &leg(phase + 0.5 * TAU), &[-4.0]].concat() {
            write!(text, "\t{:.9}", scale * angle).unwrap();
        }
        let force = if (phase / TAU).fract() < 0.6 { 700.0 } else { 0.0 };
        writeln!(text, "\t{force:.1}").unwrap();
    }
    text
}

/// The same strides as a table of Camargo 2021.
pub(crate) fn camargo(strides: usize) -> String {
    let names = "Header,pelvis_tilt,hip_flexion_r,knee_angle_r,ankle_angle_r,hip_flexion_l,knee_angle_l,ankle_angle_l,\
                 lumbar_extension,right_vy\n";
    names.to_owned() + &opensim_rows(strides, 1.0).replace('\t', ",")
}

/// Two strides as Gaitwright's table, after a comment.
pub(crate) fn own_table() -> String {
    let mut text = "# one adult\ntime_s,torso_rad,hip_L_rad,knee_L_rad,ankle_L_rad,hip_R_rad,knee_R_rad\n".to_owned();
    for k in 0..=220 {
        let phase = TAU * f64::from(k) / 110.0;
        let (time_s, hip, knee) = (f64::from(k) / 100.0, phase.cos() / 3.0, 0.4 - 0.2 * phase.sin());
        writeln!(text, "{time_s},0.1,{:.6},{knee:.6},0.05,{hip:.6},0.3", -hip).unwrap();
    }
    text
}

/// Two EMG channels and a heel switch, 1 s at 1000 Hz.
pub(crate) fn electromyogram() -> String {
    let mut text = "time_s,TA_L,BF_L,heel\n".to_owned();
    for k in 0..1000 {
        let phase = TAU * f64::from(k) / 12.0;
        writeln!(text, "{},{:.6},{:.6},{}", f64::from(k) / 1000.0, phase.sin(), phase.cos(), u8::from(k % 500 > 200))
            .unwrap();
    }
    text
}
