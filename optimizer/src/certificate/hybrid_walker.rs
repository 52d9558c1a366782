//! The closed-loop hybrid system: each of the eight domains is integrated to its guard, followed by its reset.

use super::dormand_prince::{DenseStep, Integrator, StepError, System, Tolerance};
use super::feedback_linearization::{Control, State, StateMatrix, Variational, join_variational, split_variational};
use super::reset::{reset, reset_by_state};
use crate::body::WalkerModel;
use crate::gait::Gait;
use crate::walking::{CYCLE, Impact};
use nalgebra::SVector;
use thiserror::Error;

/// The reason why the simulated walker did not complete a domain.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Fall {
    /// The guard was not reached within a multiple of the planned duration.
    #[error(
        "the simulated walker falls in {domain}: after {elapsed_s:.3} s the event that ends the domain has not occurred (planned: {planned_s:.3} s)"
    )]
    GuardMissed {
        /// `DS2_R`, ...
        domain: &'static str,
        /// Time in the domain, s.
        elapsed_s: f64,
        /// Planned duration, s.
        planned_s: f64,
    },
    /// The domain begins beyond its guard.
    #[error(
        "the simulated walker falls: {domain} begins after the event that should end it (already passed by {amount:.2e})"
    )]
    BeginsBeyondGuard {
        /// `DS2_R`, ...
        domain: &'static str,
        /// Value of the guard, in m, N or phase.
        amount: f64,
    },
    /// The integration cannot continue.
    #[error("the simulation stops in {domain}: {reason}")]
    NotIntegrable {
        /// `DS2_R`, ...
        domain: &'static str,
        /// The reason, as text.
        reason: String,
    },
}

/// A completed domain.
#[derive(Debug, Clone)]
pub(super) struct CompletedDomain {
    /// Duration, s.
    pub(super) duration: f64,
    /// Initial state of the next domain.
    pub(super) after: State,
    /// The impact at the start of the next domain.
    pub(super) impact: Option<Impact>,
}

/// Longest duration of a domain, as a multiple of the planned one.
const MAX_DURATION_RATIO: f64 = 2.0;
/// Longest integration step, as a fraction of the planned duration.
const MAX_STEP: f64 = 0.1;
/// Number of evaluations of the guard within a step.
const GUARD_EVALUATIONS: usize = 8;
/// Number of refinements of an event; each squares the error.
const EVENT_REFINEMENTS: usize = 4;

/// Tolerance for reported numbers: three digits more than are reported.
pub(super) const FINE: Tolerance = Tolerance { relative: 1e-10, absolute: 1e-11 };
/// Tolerance for decisions.
pub(super) const COARSE: Tolerance = Tolerance { relative: 1e-6, absolute: 1e-7 };

/// Observer of a simulation: domain, time in it (s), state.
pub(super) type SimulationObserver<'a> = &'a mut dyn FnMut(usize, f64, &State);

/// The closed loop of a gait.
#[derive(Debug, Clone)]
pub(super) struct HybridWalker<'a> {
    pub(super) model: &'a WalkerModel,
    pub(super) controls: Vec<Control<'a>>,
    pub(super) tolerance: Tolerance,
}

fn walker_part<const N: usize>(z: &SVector<f64, N>) -> State {
    State::from_column_slice(&z.as_slice()[..18])
}

impl<'a> HybridWalker<'a> {
    /// The closed loop of a well-formed gait.
    pub(super) fn new(model: &'a WalkerModel, gait: &Gait) -> Self {
        Self { model, controls: (0..CYCLE.len()).map(|d| Control::new(model, gait, d)).collect(), tolerance: FINE }
    }

    /// The same walker with another tolerance.
    pub(super) fn with_tolerance(&self, tolerance: Tolerance) -> Self {
        Self { tolerance, ..self.clone() }
    }

    /// The same walker with a free hip velocity: if it is an output, the controller keeps its present value.
    pub(super) fn with_free_hip_velocity(&self) -> Self {
        let mut walker = self.clone();
        for control in &mut walker.controls {
            control.hip_gain = 0.0;
        }
        walker
    }

    /// Simulates a domain from a state to its guard and through the reset.
    pub(super) fn passage(
        &self,
        d: usize,
        start: &State,
        watch: SimulationObserver<'_>,
    ) -> Result<CompletedDomain, Fall> {
        let control = &self.controls[d];
        let (duration, before) = self.to_event(d, control, start, watch)?;
        self.after_event(d, duration, before)
    }

    fn after_event(&self, d: usize, duration: f64, before: State) -> Result<CompletedDomain, Fall> {
        let opens = CYCLE[(d + 1) % CYCLE.len()];
        let (after, impact) = reset(self.model, opens, &before)
            .ok_or_else(|| not_integrable(opens.name(), "the contact rows are linearly dependent"))?;
        Ok(CompletedDomain { duration, after, impact })
    }

    /// Simulates a stride from the start of DS2_R.
    pub(super) fn stride(&self, start: &State, watch: SimulationObserver<'_>) -> Result<Vec<CompletedDomain>, Fall> {
        let mut passages: Vec<CompletedDomain> = Vec::with_capacity(CYCLE.len());
        for d in 0..CYCLE.len() {
            let from = passages.last().map_or(*start, |p| p.after);
            passages.push(self.passage(d, &from, watch)?);
        }
        Ok(passages)
    }

    /// The state a stride later.
    pub(super) fn after_stride(&self, start: &State) -> Result<State, Fall> {
        let passages = self.stride(start, &mut |_, _, _| {})?;
        Ok(passages.last().map_or(*start, |p| p.after))
    }

    /// The state a stride later, and its derivative with respect to the initial state.
    ///
    /// In each domain the derivative is the variational flow, then the projection along the motion onto the guard (a
    /// changed state reaches it at another time), then the derivative of the reset: the saltation matrix, restricted to
    /// the sections.
    pub(super) fn stride_with_derivative(&self, start: &State) -> Result<(State, StateMatrix), Fall> {
        let (mut x, mut derivative) = (*start, StateMatrix::identity());
        for (d, control) in self.controls.iter().enumerate() {
            let name = control.domain.name();
            let singular = || not_integrable(name, "the motion is not determined at the end of the domain");
            let system = Variational(control);
            let begin = join_variational(&x, &StateMatrix::identity());
            let (duration, end) = self.to_event(d, &system, &begin, &mut |_, _, _| {})?;
            let (before, flow) = split_variational(&end);
            let motion = control.derivative(&before).ok_or_else(singular)?;
            let gradient = control.guard_gradient(&before).ok_or_else(singular)?;
            let projection = StateMatrix::identity() - motion * gradient.transpose() / gradient.dot(&motion);
            let opens = CYCLE[(d + 1) % CYCLE.len()];
            let jump = reset_by_state(self.model, opens, &before).ok_or_else(singular)?;
            derivative = jump * projection * flow * derivative;
            x = self.after_event(d, duration, before)?.after;
        }
        Ok((x, derivative))
    }

    /// Integrates domain `d` to its guard. Returns time and state there.
    fn to_event<const N: usize, S: System<N>>(
        &self,
        d: usize,
        system: &S,
        start: &SVector<f64, N>,
        watch: SimulationObserver<'_>,
    ) -> Result<(f64, SVector<f64, N>), Fall> {
        let control = &self.controls[d];
        let name = control.domain.name();
        let failed = |e: StepError| not_integrable(name, &e.to_string());
        let guard =
            |z: &SVector<f64, N>| control.guard_value(&walker_part(z)).ok_or_else(|| failed(StepError::Singular));
        let mut last = guard(start)?;
        if last <= 0.0 {
            return Err(Fall::BeginsBeyondGuard { domain: name, amount: -last });
        }
        let planned = control.nominal_duration;
        let mut integrator = Integrator::new(system, start, self.tolerance, MAX_STEP * planned).map_err(failed)?;
        let mut elapsed = 0.0;
        watch(d, elapsed, &walker_part(start));
        while elapsed < MAX_DURATION_RATIO * planned {
            let step = integrator.step().map_err(failed)?;
            for look in 1..=GUARD_EVALUATIONS {
                let share = look as f64 / GUARD_EVALUATIONS as f64;
                let value = guard(&step.at(share))?;
                if value <= 0.0 {
                    let from = share - 1.0 / GUARD_EVALUATIONS as f64;
                    let guess = from + (share - from) * last / (last - value);
                    let event = refine(control, system, &step, guess * step.length)?;
                    watch(d, elapsed + event.length, &walker_part(&event.end));
                    return Ok((elapsed + event.length, event.end));
                }
                last = value;
            }
            elapsed += step.length;
            watch(d, elapsed, &walker_part(&step.end));
        }
        Err(Fall::GuardMissed { domain: name, elapsed_s: elapsed, planned_s: planned })
    }
}

/// Shortens a step such that it ends on the guard, by Newton's method for its length.
fn refine<const N: usize, S: System<N>>(
    control: &Control<'_>,
    system: &S,
    step: &DenseStep<N>,
    guess: f64,
) -> Result<DenseStep<N>, Fall> {
    let name = control.domain.name();
    let failed = |e: StepError| not_integrable(name, &e.to_string());
    let singular = || failed(StepError::Singular);
    let mut length = guess.clamp(0.0, step.length);
    for _ in 0..EVENT_REFINEMENTS {
        let x = walker_part(&step.with_length(system, length).map_err(failed)?.end);
        let value = control.guard_value(&x).ok_or_else(singular)?;
        let gradient = control.guard_gradient(&x).ok_or_else(singular)?;
        let rate = gradient.dot(&control.derivative(&x).ok_or_else(singular)?);
        if rate >= 0.0 {
            return Err(not_integrable(name, "the trajectory only grazes the event that ends the domain"));
        }
        length = (length - value / rate).clamp(0.0, step.length);
    }
    step.with_length(system, length).map_err(failed)
}

fn not_integrable(domain: &'static str, reason: &str) -> Fall {
    Fall::NotIntegrable { domain, reason: reason.to_owned() }
}
