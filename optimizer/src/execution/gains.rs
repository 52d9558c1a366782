//! Proportional-derivative gains.

/// Stiffness and damping of a tracked angle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gains {
    stiffness_n_m_rad: f64,
    damping_n_m_s_rad: f64,
}

impl Gains {
    pub(super) const fn new(stiffness_n_m_rad: f64, damping_n_m_s_rad: f64) -> Self {
        Self { stiffness_n_m_rad, damping_n_m_s_rad }
    }

    /// The torque for an error of the angle, rad, and of its rate, rad/s.
    pub(super) fn torque(&self, (error, error_rate): (f64, f64)) -> f64 {
        self.stiffness_n_m_rad * error + self.damping_n_m_s_rad * error_rate
    }
}
