//! Tells whether two trials have the same motion, as when they differ only in a bound that is not active, or when one
//! study is the fork of another.

use gait_optimizer::SolveReport;
use gaitwright_store::trials::Trial;

/// Relative difference up to which two motions count as the same.
const TOLERANCE: f64 = 1e-5;

/// Figures that identify a motion of a subject, in whichever study it was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion(Vec<f64>);

impl Motion {
    /// The motion of a trial; `None` if the record has no gait of it.
    pub fn of(trial: &Trial) -> Option<Self> {
        let SolveReport { cost_of_transport, stride_length_m, durations_s, vhip_m_s, .. } = trial.report.as_ref()?;
        let single = [*cost_of_transport, *stride_length_m];
        Some(Self(single.iter().chain(durations_s).chain(vhip_m_s).copied().collect()))
    }

    /// Whether all figures agree within the tolerance.
    pub fn is_same(&self, other: &Self) -> bool {
        let close = |(one, other): (&f64, &f64)| (one - other).abs() <= TOLERANCE * one.abs().max(other.abs());
        self.0.len() == other.0.len() && self.0.iter().zip(&other.0).all(close)
    }
}

/// Whether two trials have the same motion.
pub fn is_same_gait(one: &Trial, other: &Trial) -> bool {
    one.id == other.id || Motion::of(one).zip(Motion::of(other)).is_some_and(|(one, other)| one.is_same(&other))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motions_differ_beyond_the_tolerance_in_any_figure() {
        let motion = |figures: [f64; 3]| Motion(figures.to_vec());
        let one = motion([0.07, 1.31, 0.4]);
        assert!(one.is_same(&motion([0.07, 1.31 * (1.0 + 1e-6), 0.4])));
        assert!(!one.is_same(&motion([0.07, 1.31 * (1.0 + 1e-4), 0.4])));
        assert!(!one.is_same(&Motion(vec![0.07, 1.31])));
    }
}
