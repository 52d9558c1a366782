//! The state machine of a trial, as a pure function of what happens to its job.

use gait_optimizer::SolveStatus;
use gaitwright_store::solve_jobs::FailureCounts;
use gaitwright_store::trials::{Label, TrialState};
use thiserror::Error;

/// How often a failed or lost job is retried.
pub const RETRIES: u32 = 2;

/// An event in the life of a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TrialEvent {
    /// A worker takes the job.
    Leased,
    /// The solve ended by itself.
    Solved(SolveStatus),
    /// The program failed. Has the number of earlier failures.
    Broke(FailureCounts),
    /// The worker stopped responding. Has the number of earlier failures.
    Silent(FailureCounts),
    /// The process of the solve ended, which is not counted as a failure.
    Interrupted,
    /// A person cancels the trial.
    Cancelled,
    /// A person retries the trial.
    Retried,
}

/// The event is not possible in this state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("The trial {}, so it cannot be {}.", has_state(*state), participle(*event))]
pub struct Impossible {
    /// The state of the trial.
    pub state: TrialState,
    /// The event.
    pub event: TrialEvent,
}

/// The predicate of a sentence about a trial: `has the state “not converged”`.
pub(super) fn has_state(state: TrialState) -> String {
    format!("has the state \u{201c}{}\u{201d}", state.as_str().replace('_', " "))
}

/// The event of a trial as a participle.
fn participle(event: TrialEvent) -> &'static str {
    match event {
        TrialEvent::Leased => "started",
        TrialEvent::Solved(_) => "solved",
        TrialEvent::Broke(_) => "marked as failed",
        TrialEvent::Silent(_) => "marked as lost",
        TrialEvent::Interrupted => "interrupted",
        TrialEvent::Cancelled => "cancelled",
        TrialEvent::Retried => "retried",
    }
}

/// The label of a trial whose solve ended with this status, if that is a result.
///
/// A time limit depends on the speed of the machine, not on the action, and a cancelled solve says nothing. Neither is
/// a result.
pub fn label_of(status: SolveStatus) -> Option<Label> {
    match status {
        SolveStatus::Converged => Some(Label::Converged),
        SolveStatus::Infeasible | SolveStatus::Stalled | SolveStatus::IterationLimit => Some(Label::NotConverged),
        SolveStatus::TimeLimit | SolveStatus::Cancelled => None,
    }
}

/// The state of a trial after an event.
///
/// # Errors
/// [`Impossible`], for example for any event after a result.
pub fn after(state: TrialState, event: TrialEvent) -> Result<TrialState, Impossible> {
    use TrialState::{Cancelled, Failed, Lost, Queued, Running};
    match (state, event) {
        (Queued, TrialEvent::Leased) => Ok(Running),
        (Running, TrialEvent::Solved(status)) => label_of(status).map(Into::into).ok_or(Impossible { state, event }),
        (Running, TrialEvent::Broke(before)) => Ok(if before.failures < RETRIES { Queued } else { Failed }),
        (Running, TrialEvent::Silent(before)) => Ok(if before.losses < RETRIES { Queued } else { Lost }),
        (Running, TrialEvent::Interrupted) | (Failed | Lost | Cancelled, TrialEvent::Retried) => Ok(Queued),
        (Queued | Running, TrialEvent::Cancelled) => Ok(Cancelled),
        _ => Err(Impossible { state, event }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any_event() -> impl Strategy<Value = TrialEvent> {
        prop_oneof![
            Just(TrialEvent::Leased),
            Just(TrialEvent::Solved(SolveStatus::Converged)),
            Just(TrialEvent::Solved(SolveStatus::Infeasible)),
            Just(TrialEvent::Solved(SolveStatus::TimeLimit)),
            (0_u32..4).prop_map(|failures| TrialEvent::Broke(FailureCounts { failures, losses: 0 })),
            (0_u32..4).prop_map(|losses| TrialEvent::Silent(FailureCounts { failures: 0, losses })),
            Just(TrialEvent::Interrupted),
            Just(TrialEvent::Cancelled),
            Just(TrialEvent::Retried),
        ]
    }

    proptest! {
        #[test]
        fn results_are_final_and_come_from_solves_only(
            events in proptest::collection::vec(any_event(), 0..60)
        ) {
            let mut state = TrialState::Queued;
            for event in events {
                let Ok(next) = after(state, event) else { continue };
                prop_assert!(!state.is_result(), "{:?} left {:?}", event, state);
                if next.is_result() {
                    prop_assert!(matches!(event, TrialEvent::Solved(_)));
                }
                if next == TrialState::Running {
                    prop_assert_eq!(event, TrialEvent::Leased);
                }
                state = next;
            }
        }
    }

    #[test]
    fn failing_or_lost_job_is_given_up_after_two_retries() {
        let broke = |failures| TrialEvent::Broke(FailureCounts { failures, losses: 0 });
        let silent = |losses| TrialEvent::Silent(FailureCounts { failures: 0, losses });
        let cases: [(&dyn Fn(u32) -> TrialEvent, TrialState); 2] =
            [(&broke, TrialState::Failed), (&silent, TrialState::Lost)];
        for (event, end) in cases {
            let mut runs = 0;
            let mut state = TrialState::Queued;
            while state == TrialState::Queued && runs < 10 {
                state = after(state, TrialEvent::Leased).unwrap();
                state = after(state, event(runs)).unwrap();
                runs += 1;
            }
            assert_eq!((state, runs), (end, 3));
        }
    }
}
