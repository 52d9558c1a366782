//! Background task that certifies the best gaits of a study until one passes. It takes requested gaits first, then
//! studies that have ended.
//!
//! The next gait derives from the record alone, so the task continues after a crash.

use super::belief::Beliefs;
use super::job::JobState;
use super::snapshot::StudySnapshot;
use super::trial_choice::ranking_to_show;
use super::{certification, certified_best};
use crate::error::Error;
use crate::workers::Certify;
use gaitwright_compute::OnPool;
use gaitwright_store::audit::Actor;
use gaitwright_store::{Store, StoreResult, StudyId, TrialId, certificates, consents, events, studies};
use std::collections::BTreeSet;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::{Notify, watch};
use tokio_util::sync::CancellationToken;

/// Certifies gaits one at a time, at lower priority than solves.
pub(super) struct Certifier {
    store: Store,
    certify: Arc<dyn Certify>,
    beliefs: Arc<Beliefs>,
    state: Mutex<State>,
    asked: Notify,
}

/// What to certify next.
enum Next {
    Trial(TrialId),
    Study(StudyId),
}

#[derive(Debug, Default)]
struct State {
    /// Trials whose gaits people wait for, in a lab session or a comparison. The newest comes first.
    asked: BTreeSet<TrialId>,
    /// What of these is being certified, and what gives it up.
    running: Option<(TrialId, CancellationToken)>,
    /// Studies that may have gaits to certify.
    waiting: BTreeSet<StudyId>,
    /// Gaits whose certificates could not be stored.
    refused: BTreeSet<TrialId>,
}

impl Certifier {
    /// Creates the task; [`Self::run`] starts it.
    pub(super) fn new(store: Store, certify: Arc<dyn Certify>, beliefs: Arc<Beliefs>) -> Self {
        Self { store, certify, beliefs, state: Mutex::default(), asked: Notify::new() }
    }

    /// Requests the best gaits of a study. `next` is the first one without a certificate. Returns `false` if that one
    /// cannot be certified.
    pub(super) fn ask(&self, study: StudyId, next: TrialId) -> bool {
        let mut state = self.state();
        if state.refused.contains(&next) {
            return false;
        }
        state.waiting.insert(study);
        self.asked.notify_one();
        true
    }

    /// Requests one gait, ahead of studies that have ended.
    pub(super) fn ask_for(&self, trial: TrialId) {
        let mut state = self.state();
        if !state.refused.contains(&trial) && state.asked.insert(trial) {
            self.asked.notify_one();
        }
    }

    /// The gaits whose certificates were requested, each with the state of its job.
    pub(super) fn jobs(&self) -> Vec<(TrialId, JobState)> {
        let state = self.state();
        let running = state.running.as_ref().map(|(trial, _)| *trial);
        let stands = |trial| if running == Some(trial) { JobState::Running } else { JobState::Queued };
        state.asked.iter().map(|trial| (*trial, stands(*trial))).collect()
    }

    /// Gives up a gait that somebody asked for.
    pub(super) fn cancel(&self, trial: TrialId) {
        let mut state = self.state();
        state.asked.remove(&trial);
        if let Some((running, cancelled)) = &state.running
            && *running == trial
        {
            cancelled.cancel();
        }
    }

    /// Whether a gait of a study is being certified or is queued.
    pub(super) fn is_at(&self, study: StudyId, gait: TrialId) -> bool {
        let state = self.state();
        state.waiting.contains(&study) && !state.refused.contains(&gait)
    }

    /// Runs forever. `pulse` changes with every change of the record. Calls `changed` after it stored a certificate,
    /// and `through` when a study has no gait left to certify.
    pub(super) async fn run(&self, mut pulse: watch::Receiver<u64>, changed: impl Fn(), through: impl Fn(StudyId)) {
        // Start with the gaits that were requested, and the studies that ended, before this process started.
        let (mut requested, mut heard) = (false, 0);
        loop {
            if !requested {
                match self.hear_of_requested().await {
                    Ok(()) => requested = true,
                    Err(error) => tracing::error!(%error, "cannot read which certificates were requested"),
                }
            }
            if let Err(error) = self.hear_of_ended(&mut heard).await {
                tracing::error!(%error, "cannot read which studies have ended");
            }
            let next = tokio::select! {
                next = self.next() => next,
                _ = pulse.changed() => continue,
            };
            let study = match next {
                Next::Study(study) => study,
                Next::Trial(trial) => {
                    let cancelled = CancellationToken::new();
                    self.state().running = Some((trial, cancelled.clone()));
                    let certified = cancelled.run_until_cancelled(self.certify(trial)).await;
                    self.state().running = None;
                    if let Some(Err(error)) = certified {
                        tracing::error!(%trial, %error, "cannot certify a gait that people are waiting for");
                        if !error.is_of_machine() {
                            self.state().refused.insert(trial);
                        }
                    }
                    self.state().asked.remove(&trial);
                    changed();
                    continue;
                }
            };
            match self.certify_next(study).await {
                Ok(true) => {
                    changed();
                    continue;
                }
                Ok(false) => {}
                Err(error) => tracing::error!(%study, %error, "cannot certify the gaits of a study"),
            }
            self.state().waiting.remove(&study);
            through(study);
        }
    }

    /// Queues the gaits whose certificates were requested and not made.
    async fn hear_of_requested(&self) -> StoreResult<()> {
        let requested = certificates::requested(&mut *self.store.read().await?).await?;
        self.state().asked.extend(requested);
        Ok(())
    }

    /// Queues studies that have ended since the event `heard`.
    async fn hear_of_ended(&self, heard: &mut i64) -> StoreResult<()> {
        let (ended, newest) = events::of_ended_studies(&mut *self.store.read().await?, *heard).await?;
        *heard = newest;
        self.state().waiting.extend(ended);
        Ok(())
    }

    /// Requested gaits come first, then the newest study, because somebody is likely to look at it soon.
    async fn next(&self) -> Next {
        loop {
            {
                let state = self.state();
                if let Some(trial) = state.asked.last() {
                    return Next::Trial(*trial);
                }
                if let Some(study) = state.waiting.last() {
                    return Next::Study(*study);
                }
            }
            self.asked.notified().await;
        }
    }

    /// Certifies the gait of a trial. If that is impossible, the trial gets a failed certificate that says why.
    async fn certify(&self, trial: TrialId) -> Result<(), Error> {
        match certification::aside(&mut self.store.clone(), &Actor::program(), trial, &self.certify).await {
            // The trial has no gait, or the subject withdrew consent in the meantime.
            Err(Error::Conflict(_) | Error::NotFound { .. }) => Ok(()),
            other => other,
        }
    }

    /// Certifies the next gait of a study. Returns `false` if there is none.
    async fn certify_next(&self, id: StudyId) -> Result<bool, Error> {
        let mut store = self.store.clone();
        let mut reader = store.read().await?;
        if consents::is_withdrawn(&mut reader, id).await? {
            return Ok(false);
        }
        let study = studies::get(&mut reader, id).await?;
        let snapshot = StudySnapshot::read(&mut reader, study).await?;
        drop(reader);
        if snapshot.waits_for_first_answer() {
            // The study recommends no gait yet.
            return Ok(false);
        }
        let beliefs = Arc::clone(&self.beliefs);
        let rank = move |pool: &OnPool| ranking_to_show(pool, &snapshot, &beliefs);
        let ranking = store.compute(rank).await?.map_err(Error::Learner)?;
        let refused = self.state().refused.clone();
        let next = certified_best::next_to_certify(&mut *self.store.read().await?, &ranking, &refused).await?;
        let Some(trial) = next else { return Ok(false) };
        self.certify(trial).await?;
        Ok(true)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // The state is consistent between statements, so a poisoned lock is usable.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for Certifier {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Certifier").field("state", &self.state).finish_non_exhaustive()
    }
}
