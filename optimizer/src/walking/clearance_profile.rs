//! The profile of the swing clearance, `z >= c (4 w (1 - w))^2` for heel and toe, with w from 0 at the start to 1 at the
//! end of the swing.

/// The profile `(4 w (1 - w))^2` with its first two derivatives.
pub(crate) fn clearance_profile(w: f64) -> [f64; 3] {
    let bump = 4.0 * w * (1.0 - w);
    let slope = 4.0 * (1.0 - 2.0 * w);
    [bump * bump, 2.0 * bump * slope, 2.0 * slope * slope - 16.0 * bump]
}

#[cfg(test)]
mod tests {
    use super::clearance_profile;

    #[test]
    fn profile_is_one_at_mid_swing_and_zero_at_the_ends() {
        assert_eq!([0.0, 0.5, 1.0].map(|w| clearance_profile(w)[0]), [0.0, 1.0, 0.0]);
    }
}
