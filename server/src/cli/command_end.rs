//! How a command ends, and its exit code.

use super::output::tell;
use gaitwright_service::error::Error;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::studies::StudyState;
use gaitwright_store::trials::{Trial, TrialState};
use std::process::ExitCode;

/// Exit code for invalid input, as for every usage error.
const INPUT_FAULT: u8 = 2;

/// Exit code after Ctrl-C or SIGTERM, as in shells.
const INTERRUPTED: u8 = 130;

/// How a command ended that did not fail with an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CommandEnd {
    /// It succeeded.
    Done,
    /// A person stopped it.
    Interrupted,
    /// Part of it failed because of the program or the machine.
    Failed,
}

impl CommandEnd {
    pub(super) fn exit_code(self) -> ExitCode {
        match self {
            Self::Done => ExitCode::SUCCESS,
            Self::Interrupted => ExitCode::from(INTERRUPTED),
            Self::Failed => ExitCode::FAILURE,
        }
    }
}

/// Why a study did not give every trial a result, which makes its command fail. A trial without a gait has a result.
pub(super) fn without_result(StudySnapshot { study, trials, .. }: &StudySnapshot) -> Option<String> {
    let failed = |trial: &&Trial| matches!(trial.state, TrialState::Failed | TrialState::Lost);
    if study.state != StudyState::Finished {
        return Some(format!("the study is {}: {}", study.state.as_str(), study.state_reason));
    }
    let last = trials.iter().rev().find(failed)?;
    let all = trials.len();
    Some(match trials.iter().filter(failed).count() {
        1 => format!("trial {} of {all} failed: {}", last.number, last.message),
        count => {
            format!("{count} of {all} trials failed; the last of them was trial {}: {}", last.number, last.message)
        }
    })
}

/// Reports an error. Returns the exit code of the command that it ended.
pub(super) fn report(error: &Error) -> ExitCode {
    tell(&format!("gaitwright: {error}"));
    let wrong_file = matches!(error, Error::Store(error) if error.is_wrong_file());
    if error.is_input() || wrong_file { ExitCode::from(INPUT_FAULT) } else { ExitCode::FAILURE }
}
