//! The jobs that follow the solves of trials: certificates, explanations and execution reports.

use super::analysis::Analyses;
use super::certifier::Certifier;
use super::execution::{NewExecutionReport, Simulation};
use super::explainer::Explainer;
use super::explanation::ExplanationEffort;
use super::job_queue::TrialJobState;
use super::trial_jobs::TrialJobs;
use super::walk_simulator::{self, WalkSimulator};
use crate::job::{JobId, JobState};
use crate::workers::AfterSolves;
use gaitwright_store::{Store, StudyId, TrialId};
use std::sync::Arc;

/// The queues of the jobs, one for each kind.
#[derive(Debug)]
pub(super) struct JobsAfterSolves {
    pub(super) certificates: TrialJobs<Certifier>,
    pub(super) explanations: TrialJobs<Explainer>,
    pub(super) simulations: TrialJobs<WalkSimulator>,
}

impl JobsAfterSolves {
    /// Creates the queues; nothing runs yet.
    pub(super) fn new(store: &Store, after_solves: AfterSolves, analyses: &Arc<Analyses>) -> Self {
        let AfterSolves { certify, explain } = after_solves;
        Self {
            certificates: TrialJobs::new(store.clone(), Certifier::new(store.clone(), certify, Arc::clone(analyses))),
            explanations: TrialJobs::new(store.clone(), Explainer::new(store.clone(), explain)),
            simulations: TrialJobs::new(store.clone(), WalkSimulator::new(store.clone())),
        }
    }

    /// Requests certificates of the best gaits of a study; `next` is the first one without. Returns `false` if that one
    /// cannot be certified or its job was cancelled.
    pub(super) fn certify_best_of(&self, study: StudyId, next: TrialId) -> bool {
        let certifiable = self.may_be_certified(next);
        if certifiable {
            self.certificates.queue_ended(study);
        }
        certifiable
    }

    /// Whether a gait of a study is being certified or is queued.
    pub(super) fn is_certifying(&self, study: StudyId, gait: TrialId) -> bool {
        self.certificates.has(study) && self.may_be_certified(gait)
    }

    fn may_be_certified(&self, gait: TrialId) -> bool {
        !matches!(self.certificates.state(gait), TrialJobState::Cancelled | TrialJobState::Failed(_))
    }

    /// Requests the execution report of one gait; `None` if it exists already.
    pub(super) fn simulate(&self, trial: TrialId, asked: Option<NewExecutionReport>) {
        self.simulations.forget_end(trial);
        if let Some(asked) = asked {
            self.simulations.ask(trial, asked.into());
        }
    }

    /// The state of the execution report of a gait.
    pub(super) fn simulating(&self, trial: TrialId) -> Simulation {
        walk_simulator::simulation(self.simulations.state(trial))
    }

    /// The state of the explanation of a trial.
    pub(super) fn explaining(&self, trial: TrialId) -> ExplanationEffort {
        self.explanations.job().effort(self.explanations.state(trial))
    }

    /// The state of the certificate of a gait, and the reason if it failed; `None` if this process has no job for it.
    pub(super) fn certifying(&self, trial: TrialId) -> Option<(JobState, Option<String>)> {
        match self.certificates.state(trial) {
            TrialJobState::None => None,
            TrialJobState::Queued(()) => Some((JobState::Queued, None)),
            TrialJobState::Running { .. } => Some((JobState::Running, None)),
            TrialJobState::Cancelled => Some((JobState::Cancelled, None)),
            TrialJobState::Failed(reason) => Some((JobState::Failed, Some(reason))),
        }
    }

    /// The jobs that are queued or running.
    pub(super) fn open(&self) -> Vec<(JobId, TrialId, JobState)> {
        let of_kind = |kind: fn(TrialId) -> JobId| move |(trial, state)| (kind(trial), trial, state);
        let certificates = self.certificates.open().into_iter().map(of_kind(JobId::Certificate));
        let explanations = self.explanations.open().into_iter().map(of_kind(JobId::Explanation));
        let simulations = self.simulations.open().into_iter().map(of_kind(JobId::ExecutionReport));
        certificates.chain(explanations).chain(simulations).collect()
    }

    /// Gives up a job that was cancelled.
    pub(super) fn cancel(&self, id: JobId) {
        match id {
            JobId::Certificate(trial) => self.certificates.cancel(trial),
            JobId::Explanation(trial) => self.explanations.cancel(trial),
            JobId::ExecutionReport(trial) => self.simulations.cancel(trial),
            JobId::Backup(_) | JobId::Solve(_) => {}
        }
    }
}
