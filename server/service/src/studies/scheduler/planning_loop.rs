//! The planning loop: proposes trials for every running study, and hands out jobs when workers are free.

use super::super::lifecycle::{self, StudyTransition};
use super::super::next_step::{PlanningStep, next_step};
use super::super::planning_tasks::Plans;
use super::super::snapshot::StudySnapshot;
use super::{HEARTBEATS_PER_LEASE, Scheduler};
use crate::error::Error;
use crate::supervise::Task;
use gaitwright_compute::OnPool;
use gaitwright_store::studies::{self, AnswerSource, Study, StudyState};
use gaitwright_store::trials::{NewTrial, TrialState};
use gaitwright_store::{commit, events, solve_jobs};
use serde_json::json;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The longest time between two rounds of planning.
const IDLE: Duration = Duration::from_secs(5);
/// Pause before asking an engine that cannot work now whether it can take jobs.
const ENGINE_RETRY_PAUSE: Duration = Duration::from_millis(100);
/// Changes within this time are planned together.
const CHANGE_WINDOW: Duration = Duration::from_millis(10);

impl Scheduler {
    pub(super) async fn keep_planning(&self, task: &Task) -> Result<(), Error> {
        // Only at the start; afterwards every lease belongs to a running solve.
        self.0.leases_taken_back.get_or_try_init(|| self.take_back_leases()).await?;
        let pause = IDLE.min(self.0.engine.lease() / HEARTBEATS_PER_LEASE);
        let mut plans = Plans::default();
        // Since when jobs may be ready to dispatch.
        let mut since = None;
        let mut storages = 0;
        loop {
            self.handle_expired_leases().await?;
            self.replace_lost_jobs(&mut storages).await?;
            self.begin_plans(&mut plans).await?;
            since.get_or_insert_with(Instant::now);
            task.works();
            let looked = tokio::time::sleep(pause);
            tokio::pin!(looked);
            loop {
                let dispatch_at = since.map(|since| plans.dispatch_at(since));
                tokio::select! {
                    Some((study, snapshot)) = plans.next() => {
                        let again = plans.ended(study, snapshot?);
                        self.0.waiting.send_replace(plans.waiting());
                        since.get_or_insert_with(Instant::now);
                        if again {
                            break;
                        }
                    }
                    () = self.wait_to_dispatch(dispatch_at), if since.is_some() => {
                        self.dispatch().await?;
                        since = None;
                    }
                    // Wakes on a change or after the idle time. Changes close together are planned once.
                    () = &mut looked => break,
                    () = self.0.wake.notified() => {
                        tokio::time::sleep(CHANGE_WINDOW).await;
                        break;
                    }
                }
            }
        }
    }

    /// Waits until the engine can take jobs, and until this time at least.
    pub(super) async fn wait_to_dispatch(&self, at: Option<Instant>) {
        tokio::time::sleep_until(at.unwrap_or_else(Instant::now).into()).await;
        while self.0.engine.problem().is_some() {
            tokio::time::sleep(ENGINE_RETRY_PAUSE).await;
        }
    }

    /// Starts planning for each active study, in parallel, so that a large study does not delay the others.
    pub(super) async fn begin_plans(&self, plans: &mut Plans) -> Result<(), Error> {
        let active = studies::active(&mut *self.0.store.read().await?).await?;
        self.cancel_solves(self.0.prefetches.forget(|id| active.iter().any(|study| study.id == id))).await;
        plans.keep(|id| active.iter().any(|study| study.id == id));
        for study in active.into_iter().filter(|study| self.0.only.is_none_or(|only| only == study.id)) {
            let scheduler = self.clone();
            plans.begin(study.id, async move {
                match scheduler.plan(study.clone()).await {
                    Err(error) if error.is_of_machine() => Err(error),
                    // Planning would fail again, so a person has to see it.
                    Err(error) => scheduler.pause_unplannable(&study, &error).await.map(|()| None),
                    snapshot => snapshot,
                }
            });
        }
        Ok(())
    }

    /// Proposes trials up to the parallel limit of the study, or changes its state. Returns the snapshot if the study
    /// waits for an answer.
    pub(super) async fn plan(&self, mut study: Study) -> Result<Option<StudySnapshot>, Error> {
        let mut store = self.0.store.clone();
        loop {
            let mut reader = store.read().await?;
            let snapshot = StudySnapshot::read(&mut reader, study.clone()).await?;
            drop(reader);
            self.certify_for_people(&snapshot);
            let analyses = Arc::clone(&self.0.analyses);
            let decide = move |pool: &OnPool| {
                let step = next_step(pool, &snapshot, &analyses);
                (snapshot, step)
            };
            let (snapshot, step) = store.compute(decide).await?;
            match step? {
                PlanningStep::Nothing => return Ok(Some(snapshot).filter(|s| s.study.state == StudyState::Waiting)),
                PlanningStep::Transition(transition, reason) => {
                    match self.transition(&snapshot.study, transition, &reason).await? {
                        Some(changed) => study = changed,
                        None => return Ok(None),
                    }
                }
                PlanningStep::Try(new) => {
                    if !self.propose(&snapshot, &new).await? {
                        return Ok(None);
                    }
                }
            }
        }
    }

    /// Requests the certificates that gaits still lack, because people are shown certified gaits only.
    pub(super) fn certify_for_people(&self, snapshot: &StudySnapshot) {
        if snapshot.study.plan.answer_source != AnswerSource::GaitRmse {
            for trial in snapshot.trials.iter().filter(|trial| snapshot.waits_for_certificate(trial)) {
                self.certify(trial.id);
            }
        }
    }

    /// Pauses a study that cannot be planned, and records the reason.
    pub(super) async fn pause_unplannable(&self, study: &Study, error: &Error) -> Result<(), Error> {
        tracing::error!(study = %study.id, %error, "cannot plan a study; pausing it");
        self.transition(study, StudyTransition::Pause, &format!("Planning failed: {error}")).await.map(drop)
    }

    pub(super) async fn transition(
        &self,
        study: &Study,
        transition: StudyTransition,
        reason: &str,
    ) -> Result<Option<Study>, Error> {
        let state = lifecycle::after(study.state, transition)?;
        let mut writer = self.0.store.write().await?;
        if !studies::set_state(&mut writer, study, state, reason).await? {
            return Ok(None);
        }
        let payload = json!({ "state": state, "reason": reason });
        events::append(&mut writer, study.id, "study_changed", &payload).await?;
        let changed = studies::get(&mut writer, study.id).await?;
        commit(writer).await?;
        self.changed();
        Ok(Some(changed).filter(|s| matches!(s.state, StudyState::Running | StudyState::Waiting)))
    }

    /// Writes trial and job in one transaction, unless the study has changed since the snapshot.
    pub(super) async fn propose(&self, snapshot: &StudySnapshot, new: &NewTrial) -> Result<bool, Error> {
        let study = snapshot.study.id;
        let mut writer = self.0.store.write().await?;
        if let Err(shortage) = writer.check_free_space() {
            tracing::warn!(%study, %shortage, "no trial is proposed because the disk is nearly full");
            return Ok(false);
        }
        let current = studies::get(&mut writer, study).await?;
        let written = match current.state {
            StudyState::Running => snapshot.write_trial(&mut writer, new).await?,
            _ => None,
        };
        let Some(trial) = written else {
            self.0.wake.notify_one();
            return Ok(false);
        };
        solve_jobs::insert(&mut writer, trial).await?;
        let payload = json!({ "trial_id": trial, "number": new.number, "state": TrialState::Queued });
        events::append(&mut writer, study, "trial_queued", &payload).await?;
        commit(writer).await?;
        self.changed();
        Ok(true)
    }
}
