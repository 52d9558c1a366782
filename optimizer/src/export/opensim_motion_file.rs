//! OpenSim motion files (.mot) with the coordinate names of the planar gait models (gait10dof18musc).
//!
//! In OpenSim, pelvis_tilt and lumbar_extension are positive backwards and knee_angle is negative in flexion. The
//! walker has one link for pelvis and torso, so lumbar_extension is 0, and hip_flexion is the hip angle of the walker.

use super::samples::samples;
use crate::gait::Gait;
use crate::model_error::ModelError;
use std::fmt::Write;

/// The columns: name, index into q, sign.
const COLUMNS: [(&str, usize, f64); 9] = [
    ("pelvis_tilt", 2, -1.0),
    ("pelvis_tx", 0, 1.0),
    ("pelvis_ty", 1, 1.0),
    ("hip_flexion_r", 6, 1.0),
    ("knee_angle_r", 7, -1.0),
    ("ankle_angle_r", 8, 1.0),
    ("hip_flexion_l", 3, 1.0),
    ("knee_angle_l", 4, -1.0),
    ("ankle_angle_l", 5, 1.0),
];

/// The motion file of one stride from right heel strike, angles in degrees, at a sampling rate.
///
/// # Errors
/// [`ModelError`] if the gait is malformed or the rate is outside [`super::RATE_RANGE_HZ`].
pub fn motion_file(gait: &Gait, rate_hz: f64) -> Result<String, ModelError> {
    let rows = samples(gait, rate_hz)?;
    let mut text = format!(
        "Gaitwright gait\nversion=1\nnRows={}\nnColumns={}\ninDegrees=yes\n\nOne stride from right heel strike. Angles in \
         degrees, translations in m. The right leg wears the prosthesis.\nendheader\ntime",
        rows.len(),
        COLUMNS.len() + 2
    );
    for (name, _, _) in COLUMNS {
        text.push('\t');
        text.push_str(name);
    }
    text.push_str("\tlumbar_extension\n");
    for (time, instant) in rows {
        let mut line = format!("{time:.8}");
        for (_, index, sign) in COLUMNS {
            let value = sign * instant.q[index];
            let shown = if index < 2 { value } else { value.to_degrees() };
            // Writing to a String cannot fail.
            let _ = write!(line, "\t{shown:.8}");
        }
        line.push_str("\t0.00000000\n");
        text.push_str(&line);
    }
    Ok(text)
}
