//! The gait as the controllers store it: set points and feed-forward torques, sampled at their rate.

use super::control_period::CONTROL_PERIOD_S;
use crate::gait::Gait;
use crate::gait::between_nodes::instant;

/// Set points and feed-forward torques at one instant.
#[derive(Debug, Clone, Copy)]
pub(super) struct SetPoint {
    pub(super) q: [f64; 9],
    pub(super) qd: [f64; 9],
    pub(super) u: [f64; 6],
}

/// A domain: equidistant samples, from its start to its end.
#[derive(Debug, Clone)]
struct SampledDomain {
    start_s: f64,
    period_s: f64,
    samples: Vec<SetPoint>,
}

/// The stride of a gait over time.
#[derive(Debug, Clone)]
pub(super) struct PlannedStride {
    domains: Vec<SampledDomain>,
    /// Stride time, s.
    pub(super) duration_s: f64,
}

impl PlannedStride {
    /// The stride of a well-formed gait.
    pub(super) fn new(gait: &Gait) -> Self {
        let mut duration_s = 0.0;
        let domains = gait
            .domains
            .iter()
            .map(|domain| {
                let start_s = duration_s;
                duration_s += domain.duration_s;
                #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // a duration within its limits
                let parts = (domain.duration_s / CONTROL_PERIOD_S).ceil().max(1.0) as usize;
                let sample = |k: usize| {
                    let instant = instant(domain, k as f64 / parts as f64);
                    SetPoint { q: instant.q, qd: instant.qd, u: instant.u }
                };
                let samples = (0..=parts).map(sample).collect();
                SampledDomain { start_s, period_s: domain.duration_s / parts as f64, samples }
            })
            .collect();
        Self { domains, duration_s }
    }

    /// Start of a domain, s.
    pub(super) fn start_s(&self, domain: usize) -> f64 {
        self.domains.get(domain).map_or(self.duration_s, |domain| domain.start_s)
    }

    /// The plan at a time of the stride; times are clamped to the stride.
    pub(super) fn at(&self, time_s: f64) -> SetPoint {
        let zero = SetPoint { q: [0.0; 9], qd: [0.0; 9], u: [0.0; 6] };
        let started = self.domains.iter().rev().find(|domain| domain.start_s <= time_s);
        started.or(self.domains.first()).map_or(zero, |domain| domain.at(time_s))
    }

    /// The plan at a time, which continues with the next stride at the end.
    pub(super) fn ahead(&self, time_s: f64) -> SetPoint {
        self.at(if time_s >= self.duration_s { time_s - self.duration_s } else { time_s })
    }
}

impl SampledDomain {
    fn at(&self, time_s: f64) -> SetPoint {
        let last = self.samples.len() - 1;
        let position = ((time_s - self.start_s) / self.period_s).clamp(0.0, last as f64);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // clamped to the samples
        let before = (position.floor() as usize).min(last - 1);
        let share = position - before as f64;
        let (a, b) = (&self.samples[before], &self.samples[before + 1]);
        let between = |a: f64, b: f64| a + share * (b - a);
        SetPoint {
            q: std::array::from_fn(|i| between(a.q[i], b.q[i])),
            qd: std::array::from_fn(|i| between(a.qd[i], b.qd[i])),
            u: std::array::from_fn(|i| between(a.u[i], b.u[i])),
        }
    }
}
