//! The job that certifies a gait: requested ones, then the best ones of ended studies until one passes.

use super::analysis::Analyses;
use super::job_queue::RequestOrder;
use super::recommended_trial::ranking_to_show;
use super::snapshot::StudySnapshot;
use super::trial_jobs::TrialJob;
use super::{certification, certified_best};
use crate::error::Error;
use crate::workers::Certify;
use gaitwright_compute::OnPool;
use gaitwright_store::audit::Actor;
use gaitwright_store::{Store, StoreResult, StudyId, TrialId, cancelled_jobs, certificates, consents, events, studies};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use tokio_util::sync::CancellationToken;

/// Certifies one gait.
pub(super) struct Certifier {
    store: Store,
    certify: Arc<dyn Certify>,
    analyses: Arc<Analyses>,
    /// The last event that was searched for ended studies.
    newest_event: AtomicI64,
}

impl Certifier {
    /// For the gaits of a record.
    pub(super) fn new(store: Store, certify: Arc<dyn Certify>, analyses: Arc<Analyses>) -> Self {
        Self { store, certify, analyses, newest_event: AtomicI64::new(0) }
    }
}

impl TrialJob for Certifier {
    const NAME: &'static str = "certificate";
    /// People wait for the gaits of new trials, in a lab session or a comparison.
    const ORDER: RequestOrder = RequestOrder::NewestTrial;
    type Request = ();

    async fn requested(&self) -> StoreResult<Vec<(TrialId, ())>> {
        let requested = certificates::requested(&mut *self.store.read().await?).await?;
        Ok(requested.into_iter().map(|trial| (trial, ())).collect())
    }

    async fn cancelled(&self) -> StoreResult<Vec<TrialId>> {
        cancelled_jobs::trials(&mut *self.store.read().await?, "certificate", certificates::REQUESTED).await
    }

    async fn ended(&self) -> StoreResult<Vec<StudyId>> {
        let newest_event = self.newest_event.load(Ordering::Relaxed);
        let (ended, newest) = events::of_ended_studies(&mut *self.store.read().await?, newest_event).await?;
        self.newest_event.store(newest, Ordering::Relaxed);
        Ok(ended)
    }

    async fn next_of(&self, id: StudyId, skipped: BTreeSet<TrialId>) -> Result<Option<(TrialId, ())>, Error> {
        let mut store = self.store.clone();
        let mut reader = store.read().await?;
        if consents::is_withdrawn(&mut reader, id).await? {
            return Ok(None);
        }
        let study = studies::get(&mut reader, id).await?;
        let snapshot = StudySnapshot::read(&mut reader, study).await?;
        drop(reader);
        if snapshot.waits_for_first_answer() {
            // The study recommends no gait yet.
            return Ok(None);
        }
        let analyses = Arc::clone(&self.analyses);
        let rank = move |pool: &OnPool| ranking_to_show(pool, &snapshot, &analyses);
        let ranking = store.compute(rank).await?.map_err(Error::Learner)?;
        let next = certified_best::next_to_certify(&mut *self.store.read().await?, &ranking, &skipped).await?;
        Ok(next.map(|trial| (trial, ())))
    }

    /// A malformed gait gets a failed certificate that says why.
    async fn carry_out(&self, trial: TrialId, (): (), _: CancellationToken) -> Result<(), Error> {
        certification::run(&mut self.store.clone(), &Actor::program(), trial, &self.certify).await
    }
}
