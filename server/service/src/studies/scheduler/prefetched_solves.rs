//! Prefetched solves: what idle workers solve ahead is kept here until a trial claims it.
//!
//! The same problem from the same start has the same solution, bit for bit, so a prefetched solution only shortens the
//! wait. The record and the learner see it only when a trial claims it.

use super::super::next_step::likely_next;
use super::super::snapshot::StudySnapshot;
use crate::error::Error;
use crate::workers::{Assignment, AssignmentResult, Attempt, EngineMessage, Receipt};
use gaitwright_store::feedback::LogVersion;
use gaitwright_store::trials::NewTrial;
use gaitwright_store::{Store, StudyId, TrialId};
use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The worker name of prefetched solves in the record.
pub(super) const PREPARED: &str = "prepared";

/// The prefetched solves of all studies, by the identifier under which they run, which is that of no trial.
#[derive(Debug, Default)]
pub(super) struct Prefetches(Mutex<HashMap<TrialId, Prefetch>>);

#[derive(Debug)]
struct Prefetch {
    study: StudyId,
    assignment: Assignment,
    /// The result, or `None` while the solve runs. A failed solve is repeated only when a trial claims it.
    result: Option<AssignmentResult>,
    /// The attempt that claimed the running solve.
    promised_to: Option<Attempt>,
}

/// State of the prefetched solve of an attempt.
#[derive(Debug)]
pub(super) enum Prepared {
    /// Nothing.
    Nothing,
    /// The solve is running, and continues as that of the attempt.
    Running,
    /// The solve is done.
    Done(AssignmentResult),
}

impl Prefetches {
    /// Registers a solve of a study. Returns `false` if it is already known.
    pub(super) fn begin(&self, study: StudyId, assignment: &Assignment) -> bool {
        let mut all = self.all();
        if all.values().any(|one| same_solve(&one.assignment, assignment)) {
            return false;
        }
        let one = Prefetch { study, assignment: assignment.clone(), result: None, promised_to: None };
        all.insert(assignment.attempt.trial, one);
        true
    }

    /// The number of running solves that no attempt has claimed.
    pub(super) fn running(&self) -> usize {
        self.all().values().filter(|one| one.result.is_none() && one.promised_to.is_none()).count()
    }

    /// Hands the solve of the same problem, if there is one, to an attempt.
    pub(super) fn claim(&self, assignment: &Assignment) -> Prepared {
        let mut all = self.all();
        let found =
            all.iter_mut().find(|(_, one)| one.promised_to.is_none() && same_solve(&one.assignment, assignment));
        let Some((&name, one)) = found else { return Prepared::Nothing };
        match one.result.take() {
            None => {
                one.promised_to = Some(assignment.attempt);
                Prepared::Running
            }
            Some(result) => {
                all.remove(&name);
                match result {
                    AssignmentResult::Ended { .. } => Prepared::Done(result),
                    AssignmentResult::Broke(_) => Prepared::Nothing,
                }
            }
        }
    }

    /// Drops unclaimed solves of studies that do not stay. Returns the running ones, which the caller must cancel.
    pub(super) fn forget(&self, stays: impl Fn(StudyId) -> bool) -> Vec<TrialId> {
        self.remove(|one| !stays(one.study))
    }

    /// Drops unclaimed running solves and returns them; the caller must cancel them.
    pub(super) fn forget_running(&self) -> Vec<TrialId> {
        self.remove(|one| one.result.is_none())
    }

    fn remove(&self, goes: impl Fn(&Prefetch) -> bool) -> Vec<TrialId> {
        let mut running = Vec::new();
        self.all().retain(|name, one| {
            let stays = one.promised_to.is_some() || !goes(one);
            if !stays && one.result.is_none() {
                running.push(*name);
            }
            stays
        });
        running
    }

    /// The identifier under which the solve of a trial runs.
    pub(super) fn name_of(&self, trial: TrialId) -> TrialId {
        let all = self.all();
        let promised = |one: &Prefetch| one.promised_to.is_some_and(|attempt| attempt.trial == trial);
        all.iter().find(|(_, one)| promised(one)).map_or(trial, |(name, _)| *name)
    }

    /// Translates a worker's message to the attempt that claimed the solve. For an unclaimed solve, keeps the result
    /// and returns the receipt to acknowledge.
    pub(super) fn receive(&self, message: EngineMessage) -> Result<EngineMessage, Receipt> {
        let mut all = self.all();
        let name = match &message {
            EngineMessage::Started { attempt, .. }
            | EngineMessage::Iterated { attempt, .. }
            | EngineMessage::Ended { attempt, .. } => attempt.trial,
        };
        let Some(one) = all.get_mut(&name) else { return Ok(message) };
        match (message, one.promised_to) {
            (EngineMessage::Started { worker, .. }, Some(attempt)) => Ok(EngineMessage::Started { attempt, worker }),
            (EngineMessage::Iterated { record, .. }, Some(attempt)) => Ok(EngineMessage::Iterated { attempt, record }),
            (EngineMessage::Ended { worker, result, receipt, .. }, Some(attempt)) => {
                all.remove(&name);
                Ok(EngineMessage::Ended { attempt, worker, result, receipt })
            }
            (EngineMessage::Ended { result, receipt, .. }, None) => {
                one.result = Some(result);
                Err(receipt)
            }
            (EngineMessage::Started { .. } | EngineMessage::Iterated { .. }, None) => Err(Receipt::not_needed()),
        }
    }

    fn all(&self) -> MutexGuard<'_, HashMap<TrialId, Prefetch>> {
        // The map is consistent between statements, so a poisoned lock is usable.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Cache of the trials that waiting studies would propose next, by version of their log.
#[derive(Debug, Default)]
pub(super) struct LikelyNext(HashMap<StudyId, (LogVersion, Vec<NewTrial>)>);

impl LikelyNext {
    /// Drops the studies that do not stay.
    pub(super) fn keep(&mut self, stays: impl Fn(StudyId) -> bool) {
        self.0.retain(|study, _| stays(*study));
    }

    /// Whether the cache is current for this snapshot.
    pub(super) fn knows(&self, snapshot: &StudySnapshot) -> bool {
        self.0.get(&snapshot.study.id).is_some_and(|(version, _)| *version == snapshot.version)
    }

    /// The trials that a study would propose next, one for each possible answer.
    ///
    /// # Errors
    /// Errors of the learner.
    pub(super) async fn of(&mut self, store: &mut Store, snapshot: &StudySnapshot) -> Result<Vec<NewTrial>, Error> {
        if !self.knows(snapshot) {
            let there = snapshot.clone();
            let likely = store.compute(move |pool| likely_next(pool, &there)).await??;
            self.0.insert(snapshot.study.id, (snapshot.version, likely));
        }
        Ok(self.0.get(&snapshot.study.id).map(|(_, likely)| likely.clone()).unwrap_or_default())
    }
}

fn same_solve(a: &Assignment, b: &Assignment) -> bool {
    (&a.problem, &a.warm_start, &a.options) == (&b.problem, &b.warm_start, &b.options)
}
