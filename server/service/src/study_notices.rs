//! Notices of studies: runs a program when a study finishes, stops or pauses, or has waited for an answer for a minute.

use crate::error::Error;
use crate::supervise::Task;
use gaitwright_store::studies::{self, StudyState};
use gaitwright_store::{Store, StudyId};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::Duration;
use tokio::process::Command;
use tokio::time::{Instant, sleep, timeout};

/// Time between two looks at the studies.
const LOOK_INTERVAL: Duration = Duration::from_secs(1);
/// How long a study waits before its notice. Somebody who answers one comparison after the other needs none.
const WAIT_BEFORE_NOTICE: Duration = Duration::from_mins(1);
/// Time after which the program is killed.
const PROGRAM_TIMEOUT: Duration = Duration::from_mins(1);

/// Runs `program STUDY STATE` for each notice. The program gets nothing else about the study. What happened while the service
/// was not running has no notice.
///
/// # Errors
/// Errors of the database. Failures of the program are logged.
pub async fn give_notices(store: Store, program: PathBuf, task: Task) -> Result<(), Error> {
    let mut watched = WatchedStudies::default();
    watched.ignore(studies::states(&mut *store.read().await?).await?, Instant::now());
    loop {
        task.works();
        for (study, state) in watched.look(studies::states(&mut *store.read().await?).await?, Instant::now()) {
            run(&program, study, state).await;
        }
        sleep(LOOK_INTERVAL).await;
    }
}

async fn run(program: &Path, study: StudyId, state: StudyState) {
    let mut command = Command::new(program);
    command.arg(study.to_string()).arg(state.as_str()).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    // Settings of the service can contain passwords.
    let settings = std::env::vars_os().map(|(name, _)| name);
    for name in settings.filter(|name| name.to_string_lossy().starts_with("GAITWRIGHT_")) {
        command.env_remove(name);
    }
    let ended = timeout(PROGRAM_TIMEOUT, command.kill_on_drop(true).status()).await;
    match ended {
        Ok(Ok(status)) if status.success() => {}
        Ok(Ok(status)) => tracing::warn!(%study, "the notify program failed: {status}"),
        Ok(Err(error)) => tracing::warn!(%study, "the notify program cannot be started: {error}"),
        Err(_) => tracing::warn!(%study, "the notify program was killed, because it ran for longer than a minute"),
    }
}

/// The state of each study at the last look.
#[derive(Debug, Default)]
struct WatchedStudies(HashMap<StudyId, Watched>);

#[derive(Debug)]
struct Watched {
    state: StudyState,
    since: Instant,
    needs_notice: bool,
}

impl WatchedStudies {
    /// Looks at the studies without notices.
    fn ignore(&mut self, states: Vec<(StudyId, StudyState)>, now: Instant) {
        self.0 = states
            .into_iter()
            .map(|(study, state)| (study, Watched { state, since: now, needs_notice: false }))
            .collect();
    }

    /// The notices that are due.
    fn look(&mut self, states: Vec<(StudyId, StudyState)>, now: Instant) -> Vec<(StudyId, StudyState)> {
        let mut due = Vec::new();
        for (study, state) in states {
            let watched = self.0.entry(study).or_insert(Watched { state, since: now, needs_notice: true });
            if watched.state != state {
                *watched = Watched { state, since: now, needs_notice: true };
            }
            let is_due = match state {
                StudyState::Finished | StudyState::Stopped | StudyState::Paused => true,
                StudyState::Waiting => now.duration_since(watched.since) >= WAIT_BEFORE_NOTICE,
                StudyState::NotStarted | StudyState::Running => false,
            };
            if is_due && watched.needs_notice {
                watched.needs_notice = false;
                due.push((study, state));
            }
        }
        due
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use StudyState::{Finished, Paused, Running, Waiting};

    #[test]
    fn each_end_and_each_long_wait_has_one_notice() {
        let (start, [old, new]) = (Instant::now(), [StudyId::fresh(), StudyId::fresh()]);
        let after = |seconds| start + Duration::from_secs(seconds);
        let mut watched = WatchedStudies::default();
        watched.ignore(vec![(old, Finished)], start);
        let mut look = |seconds, state| watched.look(vec![(old, Finished), (new, state)], after(seconds));
        assert_eq!(look(1, Running), []);
        assert_eq!(look(2, Waiting), []);
        assert_eq!(look(61, Waiting), []);
        assert_eq!(look(62, Waiting), [(new, Waiting)]);
        assert_eq!(look(63, Waiting), []);
        assert_eq!(look(64, Running), []);
        assert_eq!(look(65, Waiting), []);
        assert_eq!(look(100, Running), [], "somebody answered in time");
        assert_eq!(look(101, Waiting), []);
        assert_eq!(look(102, Paused), [(new, Paused)]);
        assert_eq!(look(103, Running), []);
        assert_eq!(look(104, Finished), [(new, Finished)]);
        assert_eq!(look(105, Finished), []);
    }
}
