//! The Runge-Kutta pair of orders 5 and 4 of Dormand and Prince (J. Comput. Appl. Math. 6 (1980) 19), with step-size
//! control and dense output (Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, sections II.4 to
//! II.6).

use nalgebra::SVector;
use thiserror::Error;

/// Relative and absolute tolerance of a step, in the units of the state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Tolerance {
    pub(super) relative: f64,
    pub(super) absolute: f64,
}

/// The reason why an integration stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub(super) enum StepError {
    /// The right-hand side does not exist.
    #[error("contacts, virtual constraints and hip phase do not determine the motion")]
    Singular,
    /// The step size fell below its minimum.
    #[error(
        "the integration step became too small, because the equations of contacts, virtual constraints and hip phase are nearly singular"
    )]
    TooSmall,
}

/// An autonomous system of differential equations.
pub(super) trait System<const N: usize> {
    /// dx/dt at x; `None` if it does not exist.
    fn derivative(&self, x: &SVector<f64, N>) -> Option<SVector<f64, N>>;
}

/// Coefficients of the stages.
const A: [[f64; 6]; 6] = [
    [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];
/// Coefficients of the difference of the embedded solutions.
const E: [f64; 7] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0];
/// Highest coefficient of the dense output.
const D: [f64; 7] = [
    -12715105075.0 / 11282082432.0,
    0.0,
    87487479700.0 / 32700410799.0,
    -10690763975.0 / 1880347072.0,
    701980252875.0 / 199316789632.0,
    -1453857185.0 / 822651844.0,
    69997945.0 / 29380423.0,
];

/// Safety factor, and limits of the change of the step size.
const SAFETY: f64 = 0.9;
const CHANGE: (f64, f64) = (0.2, 5.0);
/// Smallest step, s: far below the shortest domain (5 ms) and far above the rounding error.
const MIN_STEP_S: f64 = 1e-11;

/// A step with its dense output.
pub(super) struct DenseStep<const N: usize> {
    /// Length, s.
    pub(super) length: f64,
    /// State at the start.
    pub(super) start: SVector<f64, N>,
    /// State at the end.
    pub(super) end: SVector<f64, N>,
    stages: [SVector<f64, N>; 7],
}

impl<const N: usize> DenseStep<N> {
    /// A step of a given length from `start`, where the derivative is `first`.
    pub(super) fn take(
        system: &impl System<N>,
        start: &SVector<f64, N>,
        first: &SVector<f64, N>,
        length: f64,
    ) -> Result<Self, StepError> {
        let mut stages = [*first; 7];
        let mut end = *start;
        for (stage, row) in A.iter().enumerate() {
            end = *start;
            for (k, &a) in stages.iter().zip(row).take(stage + 1) {
                end.axpy(length * a, k, 1.0);
            }
            stages[stage + 1] = system.derivative(&end).ok_or(StepError::Singular)?;
        }
        Ok(Self { length, start: *start, end, stages })
    }

    /// A step of another length from the same start.
    pub(super) fn with_length(&self, system: &impl System<N>, length: f64) -> Result<Self, StepError> {
        Self::take(system, &self.start, &self.stages[0], length)
    }

    /// Derivative at the end.
    pub(super) fn last_derivative(&self) -> &SVector<f64, N> {
        &self.stages[6]
    }

    /// Error estimate relative to the tolerance; at most 1 for an accurate step.
    fn error(&self, tolerance: Tolerance) -> f64 {
        let mut sum = 0.0;
        for i in 0..N {
            let error: f64 = self.length * self.stages.iter().zip(E).map(|(k, e)| e * k[i]).sum::<f64>();
            let allowed = tolerance.absolute + tolerance.relative * self.start[i].abs().max(self.end[i].abs());
            sum += (error / allowed).powi(2);
        }
        (sum / N as f64).sqrt()
    }

    /// State at a fraction of the step, 0 to 1, by dense output of order four.
    pub(super) fn at(&self, share: f64) -> SVector<f64, N> {
        let rest = 1.0 - share;
        let difference = self.end - self.start;
        let first = self.stages[0] * self.length - difference;
        let second = difference - self.stages[6] * self.length - first;
        let mut third = SVector::<f64, N>::zeros();
        for (k, d) in self.stages.iter().zip(D) {
            third.axpy(self.length * d, k, 1.0);
        }
        self.start + (difference + (first + (second + third * rest) * share) * rest) * share
    }
}

/// Advances a state step by step.
pub(super) struct Integrator<'a, const N: usize, S> {
    system: &'a S,
    tolerance: Tolerance,
    state: SVector<f64, N>,
    derivative: SVector<f64, N>,
    next_length: f64,
    longest: f64,
}

impl<'a, const N: usize, S: System<N>> Integrator<'a, N, S> {
    /// Starts from a state with a largest step in s, which bounds the search for events in a step.
    pub(super) fn new(
        system: &'a S,
        state: &SVector<f64, N>,
        tolerance: Tolerance,
        longest: f64,
    ) -> Result<Self, StepError> {
        let derivative = system.derivative(state).ok_or(StepError::Singular)?;
        Ok(Self { system, tolerance, state: *state, derivative, next_length: 0.1 * longest, longest })
    }

    /// The next step that keeps the tolerance.
    pub(super) fn step(&mut self) -> Result<DenseStep<N>, StepError> {
        loop {
            if self.next_length < MIN_STEP_S {
                return Err(StepError::TooSmall);
            }
            let step = DenseStep::take(self.system, &self.state, &self.derivative, self.next_length)?;
            let error = step.error(self.tolerance);
            let factor = if error > 0.0 { SAFETY * error.powf(-0.2) } else { CHANGE.1 };
            let accepted = error <= 1.0;
            // A NaN error rejects the step and shortens it.
            let change = if factor.is_nan() { CHANGE.0 } else { factor.clamp(CHANGE.0, CHANGE.1) };
            self.next_length = (self.next_length * if accepted { change } else { change.min(1.0) }).min(self.longest);
            if accepted {
                self.state = step.end;
                self.derivative = *step.last_derivative();
                return Ok(step);
            }
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    /// A pendulum of unit length and unit gravity: (angle, rate).
    struct Pendulum;

    impl System<2> for Pendulum {
        fn derivative(&self, x: &SVector<f64, 2>) -> Option<SVector<f64, 2>> {
            Some(SVector::from([x[1], -x[0].sin()]))
        }
    }

    fn energy(x: &SVector<f64, 2>) -> f64 {
        0.5 * x[1] * x[1] - x[0].cos()
    }

    #[test]
    fn pendulum_conserves_its_energy() {
        let start = SVector::from([1.2, 0.0]);
        let tolerance = Tolerance { relative: 1e-11, absolute: 1e-12 };
        let mut integrator = Integrator::new(&Pendulum, &start, tolerance, 0.1).unwrap();
        let mut elapsed = 0.0;
        while elapsed < 20.0 {
            let step = integrator.step().unwrap();
            elapsed += step.length;
            assert!((energy(&step.end) - energy(&start)).abs() < 1e-9);
            // The dense output interpolates both ends and has order four between them.
            assert_eq!(step.at(0.0), step.start);
            assert!((step.at(1.0) - step.end).amax() < 1e-15);
            assert!((energy(&step.at(0.4)) - energy(&start)).abs() < 1e-7);
        }
    }

    #[test]
    fn error_has_order_five() {
        let start = SVector::from([1.0, 0.3]);
        let run = |steps: usize| {
            let mut x = start;
            for _ in 0..steps {
                let first = Pendulum.derivative(&x).unwrap();
                x = DenseStep::take(&Pendulum, &x, &first, 2.0 / steps as f64).unwrap().end;
            }
            x
        };
        let exact = run(2000);
        let (coarse, fine) = ((run(20) - exact).norm(), (run(40) - exact).norm());
        assert!((coarse / fine).log2() > 4.7, "{}", (coarse / fine).log2());
    }
}
