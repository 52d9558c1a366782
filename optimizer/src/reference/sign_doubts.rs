//! Whether the sign of a measured angle looks reversed, by its range and by its curve over the cycle.

use super::reference_gait::{JOINTS, REFERENCE_ROWS, ReferenceGait};
use crate::model_error::ModelError;
use crate::statistics::{correlation, extremes};

/// Correlation with the built-in curve below which an angle moves opposite to it.
const OPPOSITE: f64 = -0.4;
/// Lean backwards, on the whole, beyond which the sign of the torso is doubtful, rad.
const LEAN_BACKWARDS_RAD: f64 = 0.1;

/// Why the sign of an angle, rad, looks reversed by its range, if it does. In walking, hips and knees are flexed for most of
/// their range, and the torso does not lean backwards. The range of an ankle does not tell its sign.
pub fn doubtful_range(joint: &str, angle_rad: &[f64]) -> Option<String> {
    let (low, high) = extremes(angle_rad);
    let middle = 0.5 * (low + high);
    let (part, _) = joint.split_once('_').unwrap_or((joint, ""));
    let usual = match part {
        "hip" | "knee" if middle < 0.0 => "in walking it is mostly flexed, which is positive",
        "torso" if middle < -LEAN_BACKWARDS_RAD => "a lean backwards is unusual; forward lean is positive",
        _ => return None,
    };
    let range = format!("{:.0}° to {:.0}°", low.to_degrees(), high.to_degrees()).replace('-', "\u{2212}");
    Some(format!("ranges from {range}, but {usual}. Is its sign reversed?"))
}

/// Why the sign of an angle looks reversed by its curve at 0, 1, ..., 100 % of the cycle from right heel strike, if it does. The
/// shape of the torso curve differs between people.
///
/// # Errors
/// As [`ReferenceGait::builtin`].
pub fn doubtful_curve(joint: &str, curve: &[f64]) -> Result<Option<String>, ModelError> {
    let Some(place) = JOINTS.iter().position(|known| *known == joint).filter(|place| *place > 0) else {
        return Ok(None);
    };
    let builtin = ReferenceGait::builtin()?;
    let usual = |row: usize| builtin.seven_angles(row as f64 / (REFERENCE_ROWS - 1) as f64)[place];
    let usual: Vec<f64> = (0..REFERENCE_ROWS).map(usual).collect();
    let is_opposite = correlation(curve, &usual).is_some_and(|found| found < OPPOSITE);
    Ok(is_opposite.then(|| "moves opposite to normal walking. Is its sign reversed?".to_owned()))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn builtin(joint: usize, sign: f64) -> Vec<f64> {
        let reference = ReferenceGait::builtin().unwrap();
        let angle = |row: usize| sign * reference.seven_angles(row as f64 / (REFERENCE_ROWS - 1) as f64)[joint];
        (0..REFERENCE_ROWS).map(angle).collect()
    }

    #[test]
    fn reversed_sign_of_every_leg_joint_is_doubted_and_the_right_one_is_not() {
        for (place, joint) in JOINTS.iter().enumerate().skip(1) {
            let doubts = |sign| {
                let curve = builtin(place, sign);
                (doubtful_range(joint, &curve).is_some(), doubtful_curve(joint, &curve).unwrap().is_some())
            };
            assert_eq!(doubts(1.0), (false, false), "{joint}");
            assert_eq!(doubts(-1.0), (!joint.starts_with("ankle"), true), "{joint}");
        }
    }

    #[test]
    fn lean_backwards_is_doubted() {
        assert_eq!(doubtful_range("torso", &[0.05, 0.1]), None);
        let doubt = doubtful_range("torso", &[-0.3, -0.2]).unwrap();
        assert!(
            doubt.starts_with("ranges from \u{2212}17° to \u{2212}11°, but a lean backwards is unusual"),
            "{doubt}"
        );
        assert_eq!(doubtful_curve("torso", &builtin(0, -1.0)).unwrap(), None);
    }
}
