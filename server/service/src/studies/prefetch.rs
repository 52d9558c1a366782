//! Solves that are run before anybody asked for them: while a person decides, those that the study would need next.
//!
//! The same problem from the same start has the same solution to the last bit. Taking a solution that is there already
//! changes nothing but the wait; the record and the learner hear of a solve only when a trial asks for it.

use super::next_step::likely_next;
use super::snapshot::StudySnapshot;
use crate::error::Error;
use crate::workers::{Assignment, Attempt, Finding, News, Receipt};
use gaitwright_store::feedback::LogVersion;
use gaitwright_store::trials::NewTrial;
use gaitwright_store::{Store, StudyId, TrialId};
use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Who ran a solve that was there before it was asked for.
pub(super) const PREPARED: &str = "prepared";

/// The solves of all studies that nobody asked for yet, by the name under which they run: that of no trial.
#[derive(Debug, Default)]
pub(super) struct Prefetches(Mutex<HashMap<TrialId, Prefetch>>);

#[derive(Debug)]
struct Prefetch {
    study: StudyId,
    assignment: Assignment,
    /// What came of it; `None`: it runs. What failed is not tried again here, but when a trial asks for it.
    finding: Option<Finding>,
    /// The attempt that asked for it while it ran.
    promised_to: Option<Attempt>,
}

/// What there is for an attempt.
#[derive(Debug)]
pub(super) enum Prepared {
    /// Nothing.
    Nothing,
    /// The solve runs, and goes on as that of the attempt.
    Running,
    /// The solve is done.
    Done(Finding),
}

impl Prefetches {
    /// Notes that a solve is run for a study. `false`: it is there, or runs, already.
    pub(super) fn begin(&self, study: StudyId, assignment: &Assignment) -> bool {
        let mut all = self.all();
        if all.values().any(|one| same_solve(&one.assignment, assignment)) {
            return false;
        }
        let one = Prefetch { study, assignment: assignment.clone(), finding: None, promised_to: None };
        all.insert(assignment.attempt.trial, one);
        true
    }

    /// How many run that nobody asked for.
    pub(super) fn running(&self) -> usize {
        self.all().values().filter(|one| one.finding.is_none() && one.promised_to.is_none()).count()
    }

    /// What there is for an attempt; it belongs to the attempt from now on.
    pub(super) fn claim(&self, assignment: &Assignment) -> Prepared {
        let mut all = self.all();
        let found =
            all.iter_mut().find(|(_, one)| one.promised_to.is_none() && same_solve(&one.assignment, assignment));
        let Some((&name, one)) = found else { return Prepared::Nothing };
        match one.finding.take() {
            None => {
                one.promised_to = Some(assignment.attempt);
                Prepared::Running
            }
            Some(finding) => {
                all.remove(&name);
                match finding {
                    Finding::Ended { .. } => Prepared::Done(finding),
                    Finding::Broke(_) => Prepared::Nothing,
                }
            }
        }
    }

    /// Forgets what nobody asked for, of the studies that are not to stay; those that run are to be withdrawn.
    pub(super) fn forget(&self, stays: impl Fn(StudyId) -> bool) -> Vec<TrialId> {
        self.remove(|one| !stays(one.study))
    }

    /// Forgets those that run and that nobody asked for; they are to be withdrawn.
    pub(super) fn forget_running(&self) -> Vec<TrialId> {
        self.remove(|one| one.finding.is_none())
    }

    fn remove(&self, goes: impl Fn(&Prefetch) -> bool) -> Vec<TrialId> {
        let mut running = Vec::new();
        self.all().retain(|name, one| {
            let stays = one.promised_to.is_some() || !goes(one);
            if !stays && one.finding.is_none() {
                running.push(*name);
            }
            stays
        });
        running
    }

    /// The name under which the solve of a trial runs.
    pub(super) fn name_of(&self, trial: TrialId) -> TrialId {
        let all = self.all();
        let promised = |one: &Prefetch| one.promised_to.is_some_and(|attempt| attempt.trial == trial);
        all.iter().find(|(_, one)| promised(one)).map_or(trial, |(name, _)| *name)
    }

    /// News of an attempt of a trial; of a solve that nobody asked for yet, what is to be signed at its end.
    pub(super) fn hear(&self, news: News) -> Result<News, Receipt> {
        let mut all = self.all();
        let name = match &news {
            News::Started { attempt, .. } | News::Iterated { attempt, .. } | News::Ended { attempt, .. } => {
                attempt.trial
            }
        };
        let Some(one) = all.get_mut(&name) else { return Ok(news) };
        match (news, one.promised_to) {
            (News::Started { worker, .. }, Some(attempt)) => Ok(News::Started { attempt, worker }),
            (News::Iterated { record, .. }, Some(attempt)) => Ok(News::Iterated { attempt, record }),
            (News::Ended { worker, finding, receipt, .. }, Some(attempt)) => {
                all.remove(&name);
                Ok(News::Ended { attempt, worker, finding, receipt })
            }
            (News::Ended { finding, receipt, .. }, None) => {
                one.finding = Some(finding);
                Err(receipt)
            }
            (News::Started { .. } | News::Iterated { .. }, None) => Err(Receipt::not_needed()),
        }
    }

    fn all(&self) -> MutexGuard<'_, HashMap<TrialId, Prefetch>> {
        // The map is whole between any two statements that hold the lock.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What studies that wait for an answer would propose next, computed once for what each has heard.
#[derive(Debug, Default)]
pub(super) struct LikelyNext(HashMap<StudyId, (LogVersion, Vec<NewTrial>)>);

impl LikelyNext {
    /// Forgets the studies that are not to stay.
    pub(super) fn keep(&mut self, stays: impl Fn(StudyId) -> bool) {
        self.0.retain(|study, _| stays(*study));
    }

    /// Whether it is computed for what the study has heard by now.
    pub(super) fn knows(&self, snapshot: &StudySnapshot) -> bool {
        self.0.get(&snapshot.study.id).is_some_and(|(heard, _)| *heard == snapshot.version)
    }

    /// The trials that a study would propose next.
    ///
    /// # Errors
    /// What the learner reports.
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
