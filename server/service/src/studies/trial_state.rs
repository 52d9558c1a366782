//! The life of a trial, as a pure function: what each thing that happens to its job makes of it.

use gait_optimizer::SolveStatus;
use gaitwright_store::jobs::Troubles;
use gaitwright_store::trials::TrialState;
use thiserror::Error;

/// How often a job may fail or be lost and run again.
pub const RETRIES: u32 = 2;

/// Something that happens to a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Happening {
    /// A worker takes it.
    Leased,
    /// Its solve ended by itself.
    Solved(SolveStatus),
    /// The program failed; so many times before, this one not counted.
    Broke(Troubles),
    /// Its worker was not heard of again; so many times before, this one not counted.
    Silent(Troubles),
    /// The process that ran it ended. Says nothing about the trial, and is not counted.
    Interrupted,
    /// A person ended it.
    Cancelled,
    /// A person lets it run once more.
    Retried,
}

/// The happening makes no sense in this state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("a trial that is {} cannot take {happening:?}", state.as_str())]
pub struct Impossible {
    /// Where the trial stands.
    pub state: TrialState,
    /// What happened.
    pub happening: Happening,
}

/// Whether a solve status is a result for the learner, and which.
///
/// A solve that ran out of time says how fast the machine is, not how good the action is; one that was
/// cancelled says nothing at all.
pub fn result_of(status: SolveStatus) -> Option<TrialState> {
    match status {
        SolveStatus::Converged => Some(TrialState::Converged),
        SolveStatus::Infeasible | SolveStatus::Stalled | SolveStatus::IterationLimit => Some(TrialState::NotConverged),
        SolveStatus::TimeLimit | SolveStatus::Cancelled => None,
    }
}

/// Where a trial stands after something happened.
///
/// # Errors
/// [`Impossible`]: for one, nothing changes a result.
pub fn after(state: TrialState, happening: Happening) -> Result<TrialState, Impossible> {
    use TrialState::{Cancelled, Failed, Lost, Queued, Running};
    match (state, happening) {
        (Queued, Happening::Leased) => Ok(Running),
        (Running, Happening::Solved(status)) => result_of(status).ok_or(Impossible { state, happening }),
        (Running, Happening::Broke(before)) => Ok(if before.failures < RETRIES { Queued } else { Failed }),
        (Running, Happening::Silent(before)) => Ok(if before.losses < RETRIES { Queued } else { Lost }),
        (Running, Happening::Interrupted) | (Failed | Lost | Cancelled, Happening::Retried) => Ok(Queued),
        (Queued | Running, Happening::Cancelled) => Ok(Cancelled),
        _ => Err(Impossible { state, happening }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any_happening() -> impl Strategy<Value = Happening> {
        prop_oneof![
            Just(Happening::Leased),
            Just(Happening::Solved(SolveStatus::Converged)),
            Just(Happening::Solved(SolveStatus::Infeasible)),
            Just(Happening::Solved(SolveStatus::TimeLimit)),
            (0_u32..4).prop_map(|failures| Happening::Broke(Troubles { failures, losses: 0 })),
            (0_u32..4).prop_map(|losses| Happening::Silent(Troubles { failures: 0, losses })),
            Just(Happening::Interrupted),
            Just(Happening::Cancelled),
            Just(Happening::Retried),
        ]
    }

    proptest! {
        #[test]
        fn results_are_final_and_only_solves_make_them(
            happenings in proptest::collection::vec(any_happening(), 0..60)
        ) {
            let mut state = TrialState::Queued;
            for happening in happenings {
                let Ok(next) = after(state, happening) else { continue };
                prop_assert!(!state.is_result(), "{:?} left {:?}", happening, state);
                if next.is_result() {
                    prop_assert!(matches!(happening, Happening::Solved(_)));
                }
                if next == TrialState::Running {
                    prop_assert_eq!(happening, Happening::Leased);
                }
                state = next;
            }
        }
    }

    #[test]
    fn a_job_that_keeps_failing_is_given_up_after_two_retries() {
        let mut runs = 0;
        let mut state = TrialState::Queued;
        while state == TrialState::Queued {
            state = after(state, Happening::Leased).unwrap();
            state = after(state, Happening::Broke(Troubles { failures: runs, losses: 0 })).unwrap();
            runs += 1;
        }
        assert_eq!((state, runs), (TrialState::Failed, 3));
    }
}
