//! Tells whether two trials of a subject have the same gait, as when they differ only in a bound that is not active, or
//! when one study is the clone of another.

use gait_optimizer::{SolveReport, TunedBounds};
use gaitwright_store::trials::{Trial, TrialState};

/// Relative difference up to which two results count as the same. Solves that find the same gait from
/// different starts can differ by more than 1e-5.
const TOLERANCE: f64 = 1e-4;
/// Difference up to which two durations count as the same, s. The shortest domains last 20 ms, so a relative tolerance
/// would be less than what the constraints leave open.
const TOLERANCE_S: f64 = 1e-4;

/// Identity of the gait of a trial, in whichever study of the subject it was found.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionIdentity {
    known_by: KnownBy,
    bounds: TunedBounds,
}

#[derive(Debug, Clone, PartialEq)]
enum KnownBy {
    /// The optimiser computed the gait, and these results of its report identify it.
    Results(MotionResults),
    /// A lab script evaluated the bounds with a tool of its own, so nothing but the bounds identifies the gait.
    Bounds,
}

impl MotionIdentity {
    /// The motion of a trial; `None` if the trial has no gait.
    pub fn of(trial: &Trial) -> Option<Self> {
        let known_by =
            trial.report.as_ref().map_or(KnownBy::Bounds, |report| KnownBy::Results(MotionResults::of(report)));
        (trial.state == TrialState::Converged).then_some(Self { known_by, bounds: trial.action })
    }

    /// The bounds of the gait.
    pub fn bounds(&self) -> TunedBounds {
        self.bounds
    }

    /// Whether the gaits of two trials with the same device are the same. If one of them is known by its bounds only,
    /// equal bounds count as the same gait: staff can clear a gait that a report closes without need.
    pub fn is_same(&self, other: &Self) -> bool {
        self.values_agree(other).unwrap_or(self.bounds == other.bounds)
    }

    /// Whether the gaits of two trials with different devices are the same, where equal bounds mean nothing.
    pub fn is_same_with_another_device(&self, other: &Self) -> bool {
        self.values_agree(other).unwrap_or(false)
    }

    fn values_agree(&self, other: &Self) -> Option<bool> {
        match (&self.known_by, &other.known_by) {
            (KnownBy::Results(own), KnownBy::Results(others)) => Some(own.agree(others)),
            _ => None,
        }
    }
}

/// Results of a report that identify a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
struct MotionResults {
    cost_of_transport: f64,
    stride_length_m: f64,
    vhip_m_s: [f64; 4],
    durations_s: [f64; 8],
}

impl MotionResults {
    fn of(report: &SolveReport) -> Self {
        let SolveReport { cost_of_transport, stride_length_m, vhip_m_s, durations_s, .. } = *report;
        Self { cost_of_transport, stride_length_m, vhip_m_s, durations_s }
    }

    fn agree(&self, other: &Self) -> bool {
        let relative = |of: &Self| [of.cost_of_transport, of.stride_length_m].into_iter().chain(of.vhip_m_s);
        let close = |(one, other): (f64, f64)| (one - other).abs() <= TOLERANCE * one.abs().max(other.abs());
        let mut durations = self.durations_s.iter().zip(&other.durations_s);
        relative(self).zip(relative(other)).all(close)
            && durations.all(|(one, other)| (one - other).abs() <= TOLERANCE_S)
    }
}

/// Whether two trials of a study have the same gait.
pub fn is_same_gait(one: &Trial, other: &Trial) -> bool {
    one.id == other.id
        || MotionIdentity::of(one).zip(MotionIdentity::of(other)).is_some_and(|(one, other)| one.is_same(&other))
}

/// Trials with equal actions or identical gaits in one group each, in the order of their first trials.
pub(super) fn pooled(trials: Vec<&Trial>) -> Vec<Vec<&Trial>> {
    let mut pools: Vec<Vec<&Trial>> = Vec::new();
    for trial in trials {
        let is_same = |other: &&Trial| other.action_index == trial.action_index || is_same_gait(other, trial);
        match pools.iter_mut().find(|pool| pool.iter().any(&is_same)) {
            Some(pool) => pool.push(trial),
            None => pools.push(vec![trial]),
        }
    }
    pools
}

#[cfg(test)]
mod tests {
    use super::*;

    const RESULTS: MotionResults =
        MotionResults { cost_of_transport: 0.07, stride_length_m: 1.31, vhip_m_s: [1.0; 4], durations_s: [0.1; 8] };

    fn motion(known_by: KnownBy, a1: f64) -> MotionIdentity {
        MotionIdentity { known_by, bounds: TunedBounds { a1, ..TunedBounds::default() } }
    }

    #[test]
    fn computed_motions_are_compared_by_their_figures_and_not_by_their_bounds() {
        let one = motion(KnownBy::Results(RESULTS), 15.0);
        let scales: [fn(&mut MotionResults, f64); 4] = [
            |results, factor| results.cost_of_transport *= factor,
            |results, factor| results.stride_length_m *= factor,
            |results, factor| results.vhip_m_s[3] *= factor,
            |results, factor| results.durations_s[7] *= factor,
        ];
        for scale in scales {
            let scaled = |factor| {
                let mut results = RESULTS;
                scale(&mut results, factor);
                motion(KnownBy::Results(results), 16.0)
            };
            let (near, far) = (scaled(1.0 + 5e-5), scaled(1.0 + 3e-3));
            assert!(one.is_same(&near) && one.is_same_with_another_device(&near), "{near:?}");
            assert!(!one.is_same(&far) && !one.is_same_with_another_device(&far), "{far:?}");
        }
    }

    #[test]
    fn motions_without_figures_are_the_same_if_their_bounds_are_equal_on_one_device() {
        let computed = motion(KnownBy::Results(RESULTS), 15.0);
        let by_lab = motion(KnownBy::Bounds, 15.0);
        for other in [&computed, &by_lab] {
            assert!(by_lab.is_same(other) && other.is_same(&by_lab));
            assert!(!by_lab.is_same_with_another_device(other) && !other.is_same_with_another_device(&by_lab));
        }
        assert!(!by_lab.is_same(&motion(KnownBy::Bounds, 16.0)));
    }
}
