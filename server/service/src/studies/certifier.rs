//! What the service certifies by itself: the best gaits of studies that have ended, and of those whose recommendation was
//! asked for, until one passes.
//!
//! Which gait comes next follows from the record alone, so a process that is killed goes on where it was.

use super::belief::Beliefs;
use super::choice::ranking_to_show;
use super::snapshot::StudySnapshot;
use super::{certification, recommended};
use crate::error::Error;
use crate::workers::Certify;
use gaitwright_compute::OnPool;
use gaitwright_store::audit::Actor;
use gaitwright_store::{Store, StoreResult, StudyId, TrialId, consents, events, studies};
use std::collections::BTreeSet;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::{Notify, watch};

/// Certifies gaits one after the other, beside the solves.
pub(super) struct Certifier {
    store: Store,
    certify: Arc<dyn Certify>,
    beliefs: Arc<Beliefs>,
    state: Mutex<State>,
    asked: Notify,
}

/// What is certified next.
enum Next {
    Trial(TrialId),
    Study(StudyId),
}

#[derive(Debug, Default)]
struct State {
    /// Trials whose gaits somebody asked for, for people to walk with or to be asked about; the newest comes first.
    asked: BTreeSet<TrialId>,
    /// Studies with gaits to look at.
    waiting: BTreeSet<StudyId>,
    /// Gaits whose certificates could not be written.
    refused: BTreeSet<TrialId>,
}

impl Certifier {
    /// Over a record; [`Self::run`] sets it to work.
    pub(super) fn new(store: Store, certify: Arc<dyn Certify>, beliefs: Arc<Beliefs>) -> Self {
        Self { store, certify, beliefs, state: Mutex::default(), asked: Notify::new() }
    }

    /// Asks for the best gaits of a study; `next` is the one that the record has no certificate of. `false`: that one cannot
    /// be certified.
    pub(super) fn ask(&self, study: StudyId, next: TrialId) -> bool {
        let mut state = self.state();
        if state.refused.contains(&next) {
            return false;
        }
        state.waiting.insert(study);
        self.asked.notify_one();
        true
    }

    /// Asks for one gait, before those of studies that have ended.
    pub(super) fn ask_for(&self, trial: TrialId) {
        let mut state = self.state();
        if !state.refused.contains(&trial) && state.asked.insert(trial) {
            self.asked.notify_one();
        }
    }

    /// Whether a gait of a study is being certified, or waits for that.
    pub(super) fn is_at(&self, study: StudyId, gait: TrialId) -> bool {
        let state = self.state();
        state.waiting.contains(&study) && !state.refused.contains(&gait)
    }

    /// Works for ever. `pulse` changes whenever something was recorded; `changed` tells that something was, `through` that a
    /// study has no gait left to certify.
    pub(super) async fn run(&self, mut pulse: watch::Receiver<u64>, changed: impl Fn(), through: impl Fn(StudyId)) {
        // Beginning with every study that ended before this process did.
        let mut heard = 0;
        loop {
            if let Err(error) = self.hear_of_ended(&mut heard).await {
                tracing::error!(%error, "cannot tell which studies have ended");
            }
            let next = tokio::select! {
                next = self.next() => next,
                _ = pulse.changed() => continue,
            };
            let study = match next {
                Next::Study(study) => study,
                Next::Trial(trial) => {
                    if let Err(error) = self.certify(trial).await {
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

    /// Looks at studies in which something happened and that have ended.
    async fn hear_of_ended(&self, heard: &mut i64) -> StoreResult<()> {
        let (ended, newest) = events::of_ended_studies(&mut *self.store.read().await?, *heard).await?;
        *heard = newest;
        self.state().waiting.extend(ended);
        Ok(())
    }

    /// What somebody waits for comes first, then the newest study: it is the one that somebody is about to look at.
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

    /// Certifies the gait of a trial. What cannot be certified has failed, and its certificate says why.
    async fn certify(&self, trial: TrialId) -> Result<(), Error> {
        match certification::aside(&mut self.store.clone(), &Actor::program(), trial, &self.certify).await {
            // There is nothing to certify, or the subject withdrew meanwhile.
            Err(Error::Conflict(_) | Error::NotFound { .. }) => Ok(()),
            other => other,
        }
    }

    /// Certifies the next gait of a study. `false`: there is none.
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
            // Nothing is recommended yet.
            return Ok(false);
        }
        let beliefs = Arc::clone(&self.beliefs);
        let rank = move |pool: &OnPool| ranking_to_show(pool, &snapshot, &beliefs);
        let ranking = store.compute(rank).await?.map_err(Error::Learner)?;
        let refused = self.state().refused.clone();
        let next = recommended::next_to_certify(&mut *self.store.read().await?, &ranking, &refused).await?;
        let Some(trial) = next else { return Ok(false) };
        self.certify(trial).await?;
        Ok(true)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // The state is whole between any two statements that hold the lock.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for Certifier {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Certifier").field("state", &self.state).finish_non_exhaustive()
    }
}
