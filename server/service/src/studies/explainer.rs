//! Background task that explains trials without a gait: requested ones first, then those of ended studies whose best
//! gaits are certified.
//!
//! The next trial derives from the record, so the task continues after a crash. It explains one trial at a time, at
//! lower priority than solves.

use super::explanation::{self, Effort, Elapsed};
use crate::error::Error;
use crate::workers::Explain;
use gait_optimizer::CancelToken;
use gaitwright_compute::priority::behind_solves;
use gaitwright_store::{Store, StoreResult, StudyId, TrialId, commit, consents, events, explanations, trials};
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;
use tokio::sync::{Notify, watch};
use tokio_util::sync::CancellationToken;

/// How many durations the expected duration is the median of.
const TIMED: usize = 9;

/// Explains trials one at a time, at lower priority than solves.
pub(super) struct Explainer {
    store: Store,
    explain: Arc<dyn Explain>,
    state: Mutex<State>,
    told: Notify,
}

#[derive(Debug, Default)]
struct State {
    /// Ended studies whose best gaits are certified.
    ended: BTreeSet<StudyId>,
    /// What is being explained, what gives it up, and when it started.
    running: Option<(TrialId, CancellationToken, Instant)>,
    /// Durations of the newest explanations, oldest first, s.
    seconds: VecDeque<u64>,
    /// What somebody cancelled, until somebody asks for it again.
    cancelled: BTreeSet<TrialId>,
    /// Trials that cannot be explained, with the reason.
    refused: BTreeMap<TrialId, String>,
}

impl State {
    /// Records the duration of an explanation, s.
    fn took(&mut self, seconds: u64) {
        if self.seconds.len() == TIMED {
            self.seconds.pop_front();
        }
        self.seconds.push_back(seconds);
    }

    /// The median of the recorded durations, s.
    fn usual_seconds(&self) -> Option<u64> {
        let mut sorted: Vec<u64> = self.seconds.iter().copied().collect();
        sorted.sort_unstable();
        sorted.get(sorted.len() / 2).copied()
    }
}

/// Cancels the solves when the caller stops waiting.
struct CancelOnDrop(CancelToken);

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.0.cancel();
    }
}

impl Explainer {
    /// Creates the task; [`Self::run`] starts it.
    pub(super) fn new(store: Store, explain: Arc<dyn Explain>) -> Self {
        Self { store, explain, state: Mutex::default(), told: Notify::new() }
    }

    /// Queues an ended study whose best gaits are certified.
    pub(super) fn take_up(&self, study: StudyId) {
        self.state().ended.insert(study);
        self.told.notify_one();
    }

    /// The state of the explanation of a trial in this process.
    pub(super) fn effort(&self, trial: TrialId) -> Effort {
        let state = self.state();
        match state.refused.get(&trial) {
            Some(reason) => Effort::Refused(reason.clone()),
            None if state.cancelled.contains(&trial) => Effort::Cancelled,
            None => match &state.running {
                Some((running, _, since)) if *running == trial => Effort::Running(Elapsed {
                    seconds: since.elapsed().as_secs(),
                    usual_seconds: state.usual_seconds(),
                }),
                _ => Effort::Ready,
            },
        }
    }

    /// Gives up a trial until somebody asks for it again.
    pub(super) fn cancel(&self, trial: TrialId) {
        let mut state = self.state();
        state.cancelled.insert(trial);
        if let Some((running, cancelled, _)) = &state.running
            && *running == trial
        {
            cancelled.cancel();
        }
    }

    /// Takes up a trial again that somebody had cancelled.
    pub(super) fn again(&self, trial: TrialId) {
        if self.state().cancelled.remove(&trial) {
            self.told.notify_one();
        }
    }

    /// Runs forever. `pulse` changes with every change of the record. Calls `changed` after it stored an explanation.
    pub(super) async fn run(&self, mut pulse: watch::Receiver<u64>, changed: impl Fn()) {
        loop {
            pulse.mark_unchanged();
            match self.explain_next(&mut pulse).await {
                Ok(true) => {
                    changed();
                    continue;
                }
                Ok(false) => {}
                Err(error) => tracing::error!(%error, "cannot explain the next trial"),
            }
            tokio::select! {
                _ = pulse.changed() => {}
                () = self.told.notified() => {}
            }
        }
    }

    /// Explains the next trial. Returns `false` if there is none.
    async fn explain_next(&self, pulse: &mut watch::Receiver<u64>) -> Result<bool, Error> {
        let Some(trial) = self.next().await? else { return Ok(false) };
        let cancelled = CancellationToken::new();
        let since = Instant::now();
        self.state().running = Some((trial, cancelled.clone(), since));
        let explained = cancelled.run_until_cancelled(self.explain(trial, pulse)).await;
        {
            let mut state = self.state();
            state.running = None;
            if explained.is_some() {
                state.took(since.elapsed().as_secs());
            }
        }
        match explained.unwrap_or(Ok(())) {
            Ok(()) => {}
            Err(error) if error.is_of_machine() => return Err(error),
            Err(error) => self.refuse(trial, &error).await?,
        }
        Ok(true)
    }

    /// Requested trials come first, in order, then the newest study, because somebody is likely to look at it soon.
    async fn next(&self) -> StoreResult<Option<TrialId>> {
        let refused: BTreeSet<TrialId> = {
            let state = self.state();
            state.refused.keys().chain(&state.cancelled).copied().collect()
        };
        let mut reader = self.store.read().await?;
        if let Some(trial) = explanations::next_requested(&mut reader, &refused).await? {
            return Ok(Some(trial));
        }
        loop {
            let Some(study) = self.state().ended.last().copied() else { return Ok(None) };
            if let Some(trial) = explanations::next_of_ended(&mut reader, study, &refused).await? {
                return Ok(Some(trial));
            }
            self.state().ended.remove(&study);
        }
    }

    /// Explains a trial and stores the explanation, unless the subject withdraws consent in the meantime. Dropping the
    /// future cancels the solves.
    async fn explain(&self, trial: TrialId, pulse: &mut watch::Receiver<u64>) -> Result<(), Error> {
        let mut store = self.store.clone();
        let mut reader = store.read().await?;
        let study = trials::get(&mut reader, trial).await?.study_id;
        let packed = explanation::unexplained(&mut reader, trial).await?;
        drop(reader);
        let (solve, problem) = store.compute(move |pool| packed.unpack(pool)).await??;
        let (explain, cancel) = (Arc::clone(&self.explain), CancelToken::new());
        let _cancels = CancelOnDrop(cancel.clone());
        let mut told = behind_solves("explainer", move || explain.explain(&solve, &cancel))
            .map_err(|e| Error::Internal(format!("cannot start a thread for an explanation: {e}")))?;
        let found = loop {
            tokio::select! {
                found = &mut told => break found.map_err(|_| Error::Internal("the explanation panicked".to_owned()))?,
                Ok(()) = pulse.changed() => {
                    if consents::is_withdrawn(&mut *self.store.read().await?, study).await? {
                        return Ok(());
                    }
                }
            }
        };
        let nothing = || Error::Internal("the explanation ended without a result".to_owned());
        explanation::record(&self.store, trial, &problem, &found?.ok_or_else(nothing)?).await
    }

    /// Records that a trial cannot be explained.
    async fn refuse(&self, trial: TrialId, error: &Error) -> Result<(), Error> {
        tracing::warn!(%trial, %error, "a trial cannot be explained");
        let reason = error.to_string();
        self.state().refused.insert(trial, reason.clone());
        let mut writer = self.store.write().await?;
        let row = trials::get(&mut writer, trial).await?;
        let payload = json!({ "trial_id": trial, "number": row.number, "reason": reason });
        events::append(&mut writer, row.study_id, "trial_not_explained", &payload).await?;
        Ok(commit(writer).await?)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // The state is whole between any two statements that hold the lock.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for Explainer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Explainer").field("state", &self.state).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn usual_duration_is_median_of_newest_explanations() {
        let mut state = State::default();
        assert_eq!(state.usual_seconds(), None);
        for seconds in [1000, 1000, 1000, 10, 11, 12, 13, 14, 90, 95, 5, 6] {
            state.took(seconds);
        }
        assert_eq!((state.seconds.len(), state.usual_seconds()), (TIMED, Some(12)));
    }
}
