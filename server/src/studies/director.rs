//! The director: proposes, dispatches, records, for every study that goes on by itself.
//!
//! One task plans; each running job has a task that keeps its lease alive and records its finding. What they
//! decide depends on the record alone, so the process may end at any instant.

use super::choice;
use super::comparison;
use super::lifecycle::{self, Act};
use super::record;
use super::standing::Standing;
use crate::error::Error;
use crate::store::jobs::Lease;
use crate::store::studies::{Evaluation, FeedbackMode, Study, StudyState};
use crate::store::trials::{NewTrial, TrialState};
use crate::store::{
    Store, StudyId, TrialId, commit, devices, events, feedback, gaits, jobs, now, reference_gaits, studies, subjects,
    trials,
};
use crate::workers::{Assignment, Board, Finding, Pool, Slot};
use gait_optimizer::{GaitProblem, SolveStatus};
use serde_json::json;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{Notify, watch};
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;

/// A lease lives this long without a sign of life.
const LEASE_SECONDS: i64 = 60;
/// A sign of life is given this often.
const HEARTBEAT: Duration = Duration::from_secs(20);
/// The plan is looked at this often even when nothing seems to happen.
const IDLE: Duration = Duration::from_secs(5);
/// So many trials in a row without a result pause a study: something is wrong with the set-up.
const FAILURES_IN_A_ROW: usize = 3;

/// Runs the studies of a record.
#[derive(Debug, Clone)]
pub struct Director(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    store: Store,
    pool: Pool,
    /// With `Some`, the only study that is looked at.
    only: Option<StudyId>,
    /// Something changed: plan again.
    wake: Notify,
    /// Counts what was written, for listeners that then read the events.
    pulse: watch::Sender<u64>,
    shutdown: CancellationToken,
    tasks: TaskTracker,
}

impl Director {
    /// A director over a record; [`Self::run`] sets it to work.
    pub fn new(store: Store, pool: Pool, only: Option<StudyId>) -> Self {
        Self(Arc::new(Inner {
            store,
            pool,
            only,
            wake: Notify::new(),
            pulse: watch::channel(0).0,
            shutdown: CancellationToken::new(),
            tasks: TaskTracker::new(),
        }))
    }

    /// The record.
    pub fn store(&self) -> &Store {
        &self.0.store
    }

    /// How far the running solves are.
    pub fn board(&self) -> &Arc<Board> {
        self.0.pool.board()
    }

    /// How many solves can run at the same time.
    pub fn workers(&self) -> usize {
        self.0.pool.size()
    }

    /// Changes whenever something was recorded.
    pub fn pulse(&self) -> watch::Receiver<u64> {
        self.0.pulse.subscribe()
    }

    /// Ends when the director is told to stop: for streams that would otherwise go on for ever.
    pub fn stopping(&self) -> CancellationToken {
        self.0.shutdown.clone()
    }

    /// Says that the record changed: plans are made anew and listeners told.
    pub fn changed(&self) {
        self.0.pulse.send_modify(|count| *count = count.wrapping_add(1));
        self.0.wake.notify_one();
    }

    /// Asks the solve of a trial to stop within one iteration.
    pub fn cancel_solve(&self, trial: TrialId) {
        self.0.pool.cancel(trial);
    }

    /// Tells the director to stop; [`Self::run`] returns soon after.
    pub fn stop(&self) {
        self.0.shutdown.cancel();
    }

    /// Works until told to stop. Solves that run then are given back to the queue.
    ///
    /// # Errors
    /// What the database reports at start; later errors are logged and tried again.
    pub async fn run(&self) -> Result<(), Error> {
        self.take_back_leases().await?;
        while !self.0.shutdown.is_cancelled() {
            if let Err(error) = self.plan_and_dispatch().await {
                tracing::error!(%error, "planning failed; trying again");
            }
            tokio::select! {
                () = self.0.wake.notified() => {}
                () = tokio::time::sleep(IDLE) => {}
                () = self.0.shutdown.cancelled() => {}
            }
        }
        self.0.pool.cancel_all();
        self.0.tasks.close();
        self.0.tasks.wait().await;
        Ok(())
    }

    /// An earlier process that held the record is gone, and its leases with it.
    async fn take_back_leases(&self) -> Result<(), Error> {
        let mut reader = self.0.store.read().await?;
        let left = jobs::leased(&mut reader).await?;
        drop(reader);
        for lease in left {
            record::interrupted(&self.0.store, &lease).await?;
        }
        Ok(())
    }

    async fn plan_and_dispatch(&self) -> Result<(), Error> {
        let mut reader = self.0.store.read().await?;
        let expired = jobs::expired(&mut reader, now()).await?;
        let active = studies::active(&mut reader).await?;
        drop(reader);
        for lease in expired {
            record::silent(&self.0.store, &lease).await?;
        }
        for study in active.into_iter().filter(|study| self.0.only.is_none_or(|only| only == study.id)) {
            if let Err(error) = self.plan(study.clone()).await {
                tracing::error!(study = %study.id, %error, "cannot plan a study");
            }
        }
        self.dispatch().await
    }

    /// Proposes trials until the study has as many open ones as it may, or moves it to another state.
    async fn plan(&self, mut study: Study) -> Result<(), Error> {
        loop {
            let mut reader = self.0.store.read().await?;
            let standing = Standing::read(&mut reader, study.clone()).await?;
            drop(reader);
            let (standing, step) = tokio::task::spawn_blocking(move || {
                let step = next_step(&standing);
                (standing, step)
            })
            .await
            .map_err(|e| Error::Internal(e.to_string()))?;
            match step? {
                Step::Nothing => return Ok(()),
                Step::Act(act, reason) => match self.act(&standing.study, act, &reason).await? {
                    Some(changed) => study = changed,
                    None => return Ok(()),
                },
                Step::Try(new) => {
                    if !self.propose(&standing, &new).await? {
                        return Ok(());
                    }
                }
            }
        }
    }

    async fn act(&self, study: &Study, act: Act, reason: &str) -> Result<Option<Study>, Error> {
        let state = lifecycle::after(study.state, act)?;
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

    /// Writes trial and job in one transaction, if the record is still what the choice was made from.
    async fn propose(&self, standing: &Standing, new: &NewTrial) -> Result<bool, Error> {
        let study = standing.study.id;
        let mut writer = self.0.store.write().await?;
        let current = studies::get(&mut writer, study).await?;
        if current.state != StudyState::Running || feedback::version(&mut writer, study).await? != standing.version {
            self.0.wake.notify_one();
            return Ok(false);
        }
        let trial = trials::insert(&mut writer, study, new).await?;
        jobs::insert(&mut writer, trial).await?;
        let payload = json!({ "trial_id": trial, "number": new.number, "state": TrialState::Queued });
        events::append(&mut writer, study, "trial_queued", &payload).await?;
        commit(writer).await?;
        self.changed();
        Ok(true)
    }

    /// Leases jobs while there are free slots.
    async fn dispatch(&self) -> Result<(), Error> {
        while !self.0.shutdown.is_cancelled()
            && let Some(slot) = self.0.pool.try_slot()
        {
            let Some(lease) = self.lease().await? else { return Ok(()) };
            let director = self.clone();
            self.0.tasks.spawn(async move {
                if let Err(error) = director.work(slot, &lease).await {
                    // The lease runs out, and the job is tried again.
                    tracing::error!(trial = %lease.trial, %error, "cannot run or record a trial");
                }
                director.changed();
            });
        }
        Ok(())
    }

    async fn lease(&self) -> Result<Option<Lease>, Error> {
        let mut writer = self.0.store.write().await?;
        let until = now().plus_seconds(LEASE_SECONDS);
        let Some(lease) = jobs::lease(&mut writer, "in-process", until, self.0.only).await? else { return Ok(None) };
        trials::start(&mut writer, lease.trial).await?;
        let trial = trials::get(&mut writer, lease.trial).await?;
        let payload = json!({ "trial_id": trial.id, "number": trial.number, "state": trial.state });
        events::append(&mut writer, lease.study, "trial_started", &payload).await?;
        commit(writer).await?;
        self.0.pulse.send_modify(|count| *count = count.wrapping_add(1));
        Ok(Some(lease))
    }

    /// Runs one leased job to its end and records it.
    async fn work(&self, slot: Slot, lease: &Lease) -> Result<(), Error> {
        let assignment = assignment(&self.0.store, lease).await?;
        let mut finding = self.0.pool.run(slot, assignment);
        let found = loop {
            tokio::select! {
                found = &mut finding => break found,
                () = tokio::time::sleep(HEARTBEAT) => self.heartbeat(lease).await?,
            }
        };
        self.0.pool.release(lease.trial);
        match found {
            Ok(Finding::Ended { outcome, iterations }) => {
                let (outcome, packed) = tokio::task::spawn_blocking(move || {
                    let packed = gaits::PackedGait::new(&outcome, &iterations);
                    (outcome, packed)
                })
                .await
                .map_err(|e| Error::Internal(e.to_string()))?;
                let packed = packed?;
                if packed.is_none() && outcome.report.status == SolveStatus::Converged {
                    let reason = "the solver called a gait converged that holds numbers that are not finite";
                    record::broke(&self.0.store, lease, reason).await?;
                } else {
                    record::ended(&self.0.store, lease, &outcome, packed.as_ref()).await?;
                }
            }
            Ok(Finding::Broke(reason)) => {
                record::broke(&self.0.store, lease, &reason).await?;
            }
            Err(_) => {
                record::broke(&self.0.store, lease, "the solver thread ended without an answer").await?;
            }
        }
        Ok(())
    }

    async fn heartbeat(&self, lease: &Lease) -> Result<(), Error> {
        let mut writer = self.0.store.write().await?;
        let ours = jobs::heartbeat(&mut writer, lease, now().plus_seconds(LEASE_SECONDS)).await?;
        commit(writer).await?;
        if !ours {
            self.0.pool.cancel(lease.trial);
        }
        Ok(())
    }
}

/// What a study needs next.
enum Step {
    Nothing,
    Act(Act, String),
    Try(NewTrial),
}

/// Decides it, from the standing alone.
fn next_step(standing: &Standing) -> Result<Step, Error> {
    let study = &standing.study;
    if study.plan.feedback_mode == FeedbackMode::Human {
        let open = comparison::open_question(standing).map_err(Error::Learner)?.is_some();
        match (study.state, open) {
            (StudyState::Running, true) => return Ok(Step::Act(Act::Ask, "a comparison waits for an answer".into())),
            (StudyState::Waiting, false) => return Ok(Step::Act(Act::Answered, String::new())),
            _ => {}
        }
    }
    if study.state != StudyState::Running {
        return Ok(Step::Nothing);
    }
    let ended_in_a_row = standing.trials.iter().rev().filter(|trial| !trial.state.is_open());
    let failed = ended_in_a_row.take(FAILURES_IN_A_ROW).filter(|trial| trial.state == TrialState::Failed).count();
    if failed == FAILURES_IN_A_ROW {
        let message = standing.trials.iter().rev().find(|t| t.state == TrialState::Failed).map(|t| t.message.clone());
        let reason = format!("{failed} trials in a row failed; the last: {}", message.unwrap_or_default());
        return Ok(Step::Act(Act::Pause, reason));
    }
    let open = standing.open();
    let tried = u32::try_from(standing.trials.len()).unwrap_or(u32::MAX);
    if tried >= study.plan.trial_budget {
        let finished = Step::Act(Act::Finish, format!("all {} trials are done", study.plan.trial_budget));
        return Ok(if open == 0 { finished } else { Step::Nothing });
    }
    if let Some(reason) = standing.is_enough() {
        return Ok(if open == 0 { Step::Act(Act::Finish, reason) } else { Step::Nothing });
    }
    if open >= study.plan.parallel_trials as usize || study.plan.evaluation == Evaluation::Script {
        return Ok(Step::Nothing);
    }
    match choice::next_trial(standing) {
        Ok(new) => Ok(Step::Try(new)),
        Err(e) if e.is_exhausted() && open == 0 => {
            Ok(Step::Act(Act::Finish, "every action of the search space was tried".into()))
        }
        Err(e) if e.is_exhausted() => Ok(Step::Nothing),
        Err(choice::ChoiceError::Learner(e)) => Err(Error::Learner(e)),
        Err(choice::ChoiceError::Bounds(e)) => Err(e.into()),
    }
}

/// Collects what a solve needs.
async fn assignment(store: &Store, lease: &Lease) -> Result<Assignment, Error> {
    let mut reader = store.read().await?;
    let trial = trials::get(&mut reader, lease.trial).await?;
    let plan = studies::get(&mut reader, lease.study).await?.plan;
    let subject = subjects::get(&mut reader, plan.subject_id).await?.body();
    let device = devices::get(&mut reader, plan.device_id).await?.definition;
    let reference = reference_gaits::get(&mut reader, plan.reference_gait_id).await?.definition;
    let warm_start = match trial.warm_started_from {
        Some(from) => Some(gaits::warm_start(&mut reader, from).await?),
        None => None,
    };
    let problem = GaitProblem {
        subject,
        device,
        bounds: trial.action,
        muscles: plan.muscles,
        settings: plan.gait_settings,
        reference,
    };
    Ok(Assignment {
        study: lease.study,
        trial: lease.trial,
        number: trial.number,
        problem,
        warm_start,
        options: plan.solve_options,
    })
}
