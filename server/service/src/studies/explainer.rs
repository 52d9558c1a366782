//! The job that explains a trial without a gait: requested ones, then those of ended studies whose best gaits are
//! certified.

use super::explanation::{self, Elapsed, ExplanationEffort};
use super::job_queue::TrialJobState;
use super::trial_jobs::{TrialJob, run_cancellable};
use crate::error::Error;
use crate::workers::Explain;
use gait_optimizer::CancelToken;
use gaitwright_compute::priority::BACKGROUND_NICENESS;
use gaitwright_store::accessible_studies::Reach;
use gaitwright_store::{Store, StoreResult, StudyId, TrialId, cancelled_jobs, commit, events, explanations, trials};
use serde_json::json;
use std::collections::{BTreeSet, VecDeque};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;
use tokio_util::sync::CancellationToken;

/// Explains one trial.
pub(super) struct Explainer {
    store: Store,
    explain: Arc<dyn Explain>,
    durations: Mutex<Durations>,
}

/// Durations of the newest explanations, oldest first, s.
#[derive(Debug, Default)]
struct Durations(VecDeque<u64>);

impl Durations {
    /// The expected duration is the median of at most this many durations.
    const MAX_DURATIONS: usize = 9;

    /// Records the duration of an explanation, s.
    fn add(&mut self, seconds: u64) {
        if self.0.len() == Self::MAX_DURATIONS {
            self.0.pop_front();
        }
        self.0.push_back(seconds);
    }

    /// The median of the recorded durations, s.
    fn median(&self) -> Option<u64> {
        let mut sorted: Vec<u64> = self.0.iter().copied().collect();
        sorted.sort_unstable();
        sorted.get(sorted.len() / 2).copied()
    }
}

impl Explainer {
    /// For the trials of a record.
    pub(super) fn new(store: Store, explain: Arc<dyn Explain>) -> Self {
        Self { store, explain, durations: Mutex::default() }
    }

    /// The state of the explanation of a trial. The record says what is queued.
    pub(super) fn effort(&self, state: TrialJobState<()>) -> ExplanationEffort {
        match state {
            TrialJobState::None | TrialJobState::Queued(()) => ExplanationEffort::Ready,
            TrialJobState::Running { since, .. } => ExplanationEffort::Running(Elapsed {
                seconds: since.elapsed().as_secs(),
                usual_seconds: self.durations.lock().unwrap_or_else(PoisonError::into_inner).median(),
            }),
            TrialJobState::Cancelled => ExplanationEffort::Cancelled,
            TrialJobState::Failed(reason) => ExplanationEffort::Refused(reason),
        }
    }
}

impl TrialJob for Explainer {
    const NAME: &'static str = "explanation";
    const READS_REQUESTS: bool = true;
    const KEEPS_PARTS: bool = true;
    type Request = ();

    async fn requested(&self) -> StoreResult<Vec<(TrialId, ())>> {
        let requested = explanations::requested(&mut *self.store.read().await?, Reach::Every).await?;
        Ok(requested.into_iter().map(|(trial, _)| (trial, ())).collect())
    }

    async fn cancelled(&self) -> StoreResult<Vec<TrialId>> {
        cancelled_jobs::trials(&mut *self.store.read().await?, "explanation", explanations::REQUESTED).await
    }

    async fn next_of(&self, study: StudyId, skipped: BTreeSet<TrialId>) -> Result<Option<(TrialId, ())>, Error> {
        let trial = explanations::next_of_ended(&mut *self.store.read().await?, study, &skipped).await?;
        Ok(trial.map(|trial| (trial, ())))
    }

    async fn carry_out(&self, trial: TrialId, (): (), cancelled: CancellationToken) -> Result<(), Error> {
        let since = Instant::now();
        let mut store = self.store.clone();
        let packed = explanation::unexplained(&mut *store.read().await?, trial).await?;
        let (solve, problem) = store.compute(move |pool| packed.unpack(pool)).await??;
        let explain = Arc::clone(&self.explain);
        let work = move |cancel: &CancelToken| explain.explain(&solve, cancel);
        let Some(found) = run_cancellable(("explainer", BACKGROUND_NICENESS), &cancelled, work).await?? else {
            let nothing = || Error::Internal("the explanation ended without a result".to_owned());
            return if cancelled.is_cancelled() { Ok(()) } else { Err(nothing()) };
        };
        explanation::record(&self.store, trial, &problem, &found).await?;
        if !found.stopped_early {
            self.durations.lock().unwrap_or_else(PoisonError::into_inner).add(since.elapsed().as_secs());
        }
        Ok(())
    }

    async fn record_failure(&self, trial: TrialId, reason: &str) -> Result<(), Error> {
        let mut writer = self.store.write().await?;
        let row = trials::get(&mut writer, trial).await?;
        let payload = json!({ "trial_id": trial, "number": row.number, "reason": reason });
        events::append(&mut writer, row.study_id, "trial_not_explained", &payload).await?;
        Ok(commit(writer).await?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn usual_duration_is_median_of_newest_explanations() {
        let mut durations = Durations::default();
        assert_eq!(durations.median(), None);
        for seconds in [1000, 1000, 1000, 10, 11, 12, 13, 14, 90, 95, 5, 6] {
            durations.add(seconds);
        }
        assert_eq!((durations.0.len(), durations.median()), (Durations::MAX_DURATIONS, Some(12)));
    }
}
