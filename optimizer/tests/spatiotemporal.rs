//! Spatiotemporal parameters of golden gaits against their domains.

#![allow(clippy::unwrap_used)]

mod golden_gaits;

use gait_optimizer::spatiotemporal::Spatiotemporal;
use golden_gaits::golden_gait;

#[test]
fn parameters_agree_with_each_other_and_with_the_domains() {
    for (subject, muscles) in [(1, false), (2, true)] {
        let (_, gait) = golden_gait(subject, muscles);
        let found = Spatiotemporal::of(&gait).unwrap();
        let close = |one: f64, other: f64| assert!((one - other).abs() < 1e-9, "{one} {other}: {found:?}");
        let (left, right) = (found.left, found.right);
        close(left.step_length_m + right.step_length_m, found.stride_length_m);
        close(left.step_time_s + right.step_time_s, found.stride_time_s);
        close(found.speed_m_s * found.stride_time_s, found.stride_length_m);
        close(found.cadence_per_min * found.stride_time_s, 120.0);
        // Both feet together are on the ground for the whole stride and once more in double support.
        close(left.stance_percent + right.stance_percent, 100.0 + found.double_support_percent);
        let share = |name: &str| {
            let domain = gait.domains.iter().find(|domain| domain.name == name).unwrap();
            100.0 * domain.duration_s / gait.stride_time_s
        };
        close(found.double_support_percent, ["DS2_R", "DS3_R", "DS2_L", "DS3_L"].map(share).iter().sum());
        // The left foot swings while the right leg alone carries the weight.
        close(100.0 - left.stance_percent, share("SS2_R") + share("SS1_R"));
        let left_strike_s = gait.domains.iter().find(|domain| domain.name == "DS2_L").unwrap().time_s[0];
        close(left.step_time_s, left_strike_s);
    }
}
