//! The prefetch loop: while studies wait for an answer, idle workers solve the trials that may follow.

use super::super::problem_file::PackedInput;
use super::super::snapshot::StudySnapshot;
use super::Scheduler;
use super::prefetched_solves::LikelyNext;
use super::solve_dispatch::assigned;
use crate::error::Error;
use crate::supervise::Task;
use crate::workers::Attempt;
use gaitwright_store::TrialId;
use std::sync::Arc;

impl Scheduler {
    /// Prefetches the solves that may follow each pending answer, on workers that are idle.
    pub(super) async fn keep_prefetching(&self, task: &Task) -> Result<(), Error> {
        task.works();
        let mut waiting = self.0.waiting.subscribe();
        let mut likely = LikelyNext::default();
        // The sender lives as long as the scheduler, so this loop ends only with it.
        while waiting.changed().await.is_ok() {
            let snapshots = Arc::clone(&waiting.borrow_and_update());
            likely.keep(|study| snapshots.iter().any(|snapshot| snapshot.study.id == study));
            for snapshot in snapshots.iter() {
                if let Err(error) = self.prefetch(&mut likely, snapshot).await {
                    tracing::warn!(study = %snapshot.study.id, %error, "cannot prefetch");
                }
            }
        }
        Ok(())
    }

    pub(super) async fn prefetch(&self, likely: &mut LikelyNext, snapshot: &StudySnapshot) -> Result<(), Error> {
        let study = &snapshot.study;
        if !likely.knows(snapshot) {
            self.cancel_solves(self.0.prefetches.forget(|other| other != study.id)).await;
        }
        let mut store = self.0.store.clone();
        let mut unpacking = self.0.unpacking.clone();
        for new in likely.of(&mut store, snapshot).await? {
            if self.busy().await? >= self.0.engine.size() {
                return Ok(());
            }
            // No trial has this identifier: the result is kept here until a trial claims it.
            let attempt = Attempt { trial: TrialId::fresh(), number: 1 };
            let mut reader = unpacking.read().await?;
            let input = PackedInput::of(&mut reader, &study.plan, new.action, new.warm_started_from).await?;
            drop(reader);
            let input = unpacking.compute(move |pool| input.unpack(pool)).await??;
            let assignment = assigned(attempt, new.number, input);
            if self.earlier_solve(&assignment).await?.is_some() {
                continue;
            }
            let _hand_over = self.0.hand_over.lock().await;
            if self.busy().await? < self.0.engine.size()
                && self.0.prefetches.begin(study.id, &assignment)
                && let Err(error) = self.0.engine.submit(assignment).await
            {
                self.cancel_solves(self.0.prefetches.forget_running()).await;
                return Err(error.into());
            }
        }
        Ok(())
    }
}
