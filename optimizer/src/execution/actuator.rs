//! Actuators: the drives of the prosthesis, and the muscles of a human joint as a lag.

/// Torque of a drive, limited in magnitude and rate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Drive {
    limit_n_m: f64,
    rate_limit_n_m_s: f64,
    pub(super) torque_n_m: f64,
    /// Whether the last command exceeded the limit.
    pub(super) saturated: bool,
    /// Whether the last command was out of reach at the rate limit.
    pub(super) rate_limited: bool,
}

impl Drive {
    /// A drive that needs `rise_s` from zero to its limit.
    pub(super) fn new(limit_n_m: f64, rise_s: f64) -> Self {
        let rate_limit_n_m_s = limit_n_m / rise_s;
        Self { limit_n_m, rate_limit_n_m_s, torque_n_m: 0.0, saturated: false, rate_limited: false }
    }

    pub(super) fn follow(&mut self, command_n_m: f64, period_s: f64) {
        self.saturated = command_n_m.abs() > self.limit_n_m;
        let reach = self.rate_limit_n_m_s * period_s;
        let change = command_n_m.clamp(-self.limit_n_m, self.limit_n_m) - self.torque_n_m;
        self.rate_limited = change.abs() > reach;
        self.torque_n_m += change.clamp(-reach, reach);
    }
}

/// Torque of a human joint: a first-order lag between limits.
#[derive(Debug, Clone, Copy)]
pub(super) struct LaggedJoint {
    range_n_m: (f64, f64),
    lag_s: f64,
    pub(super) torque_n_m: f64,
}

impl LaggedJoint {
    pub(super) fn new(range_n_m: (f64, f64), lag_s: f64) -> Self {
        Self { range_n_m, lag_s, torque_n_m: 0.0 }
    }

    pub(super) fn follow(&mut self, command_n_m: f64, period_s: f64) {
        let wanted = command_n_m.clamp(self.range_n_m.0, self.range_n_m.1);
        self.torque_n_m += (1.0 - (-period_s / self.lag_s).exp()) * (wanted - self.torque_n_m);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drive_respects_its_torque_and_rate_limits() {
        let mut drive = Drive::new(80.0, 0.04);
        let mut before = 0.0_f64;
        for k in 0..200 {
            let command = if k < 100 { 500.0 } else { -90.0 };
            drive.follow(command, 1e-3);
            assert!(drive.torque_n_m.abs() <= 80.0);
            assert!((drive.torque_n_m - before).abs() <= 2.0 + 1e-12);
            assert!(drive.saturated);
            before = drive.torque_n_m;
        }
        assert_eq!(before, -80.0);
        drive.follow(-79.0, 1e-3);
        assert!(!drive.saturated && !drive.rate_limited);
    }

    #[test]
    fn human_joint_reaches_two_thirds_of_its_torque_after_its_lag() {
        let mut joint = LaggedJoint::new((-50.0, 100.0), 0.025);
        for _ in 0..25 {
            joint.follow(1e3, 1e-3);
        }
        assert!((joint.torque_n_m - 63.2).abs() < 0.1, "{}", joint.torque_n_m);
    }
}
