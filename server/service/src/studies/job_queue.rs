//! The queue of jobs of one kind: which jobs are requested, running, cancelled and failed.

use crate::job::JobState;
use gaitwright_store::{StudyId, TrialId};
use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};
use tokio_util::sync::CancellationToken;

/// How long a job that failed because of the machine, for example a full disk, waits until it is tried again.
const RETRY_PAUSE: Duration = Duration::from_mins(1);

/// Which request is next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RequestOrder {
    /// The oldest one.
    OldestRequest,
    /// The one for the newest trial.
    NewestTrial,
}

/// The state of the job of one trial in this process.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum TrialJobState<R> {
    /// This process has no job for the trial.
    None,
    /// Queued.
    Queued(R),
    /// Running.
    Running {
        /// The request.
        request: R,
        /// Start of the job.
        since: Instant,
    },
    /// Cancelled, until somebody asks for it again.
    Cancelled,
    /// Failed, for this reason.
    Failed(String),
}

/// The queue. One job runs at a time.
pub(super) struct JobQueue<R> {
    /// Requests in order, without the running one.
    requested: Vec<(TrialId, R)>,
    running: Option<RunningJob<R>>,
    /// Ended studies that may have trials to work on.
    studies: BTreeSet<StudyId>,
    cancelled: BTreeSet<TrialId>,
    failed: BTreeMap<TrialId, String>,
    /// When the jobs that failed because of the machine are tried again.
    postponed: BTreeMap<TrialId, Instant>,
}

/// A running job.
#[derive(Clone)]
pub(super) struct RunningJob<R> {
    pub(super) trial: TrialId,
    pub(super) request: R,
    /// Start of the job.
    since: Instant,
    /// Cancelled with the job.
    pub(super) cancelled: CancellationToken,
}

impl<R> Default for JobQueue<R> {
    fn default() -> Self {
        Self {
            requested: Vec::new(),
            running: None,
            studies: BTreeSet::new(),
            cancelled: BTreeSet::new(),
            failed: BTreeMap::new(),
            postponed: BTreeMap::new(),
        }
    }
}

impl<R: Clone> JobQueue<R> {
    /// Queues the job of a trial, unless it is queued, is running or has failed.
    pub(super) fn ask(&mut self, trial: TrialId, request: R) {
        self.cancelled.remove(&trial);
        self.postponed.remove(&trial);
        if self.admits(trial) {
            self.requested.push((trial, request));
        }
    }

    /// Queues requests of earlier processes, without those that are cancelled.
    pub(super) fn recall(&mut self, requested: Vec<(TrialId, R)>) {
        for (trial, request) in requested {
            if !self.cancelled.contains(&trial) && self.admits(trial) {
                self.requested.push((trial, request));
            }
        }
    }

    /// Adds cancellations of earlier processes.
    pub(super) fn restore_cancelled(&mut self, cancelled: Vec<TrialId>) {
        self.cancelled.extend(cancelled);
    }

    /// Forgets that the job of a trial was cancelled or failed.
    pub(super) fn forget(&mut self, trial: TrialId) {
        self.cancelled.remove(&trial);
        self.failed.remove(&trial);
        self.postponed.remove(&trial);
    }

    /// Queues ended studies behind requested trials.
    pub(super) fn queue_ended(&mut self, studies: impl IntoIterator<Item = StudyId>) {
        self.studies.extend(studies);
    }

    /// Whether an ended study is queued.
    pub(super) fn has(&self, study: StudyId) -> bool {
        self.studies.contains(&study)
    }

    /// The newest of the ended studies.
    pub(super) fn newest_study(&self) -> Option<StudyId> {
        self.studies.last().copied()
    }

    /// Removes an ended study that has no trial left to work on.
    pub(super) fn remove_study(&mut self, study: StudyId) {
        self.studies.remove(&study);
    }

    /// The state of the job of a trial.
    pub(super) fn state(&self, trial: TrialId) -> TrialJobState<R> {
        if let Some(RunningJob { request, since, .. }) = self.running.as_ref().filter(|running| running.trial == trial)
        {
            return TrialJobState::Running { request: request.clone(), since: *since };
        }
        if let Some((_, request)) = self.requested.iter().find(|(queued, _)| *queued == trial) {
            return TrialJobState::Queued(request.clone());
        }
        match self.failed.get(&trial) {
            Some(reason) => TrialJobState::Failed(reason.clone()),
            None if self.cancelled.contains(&trial) => TrialJobState::Cancelled,
            None => TrialJobState::None,
        }
    }

    /// The trials whose jobs are running or queued.
    pub(super) fn open(&self) -> Vec<(TrialId, JobState)> {
        let running = self.running.iter().map(|running| (running.trial, JobState::Running));
        running.chain(self.requested.iter().map(|(trial, _)| (*trial, JobState::Queued))).collect()
    }

    /// Gives up the job of a trial.
    pub(super) fn cancel(&mut self, trial: TrialId) {
        self.requested.retain(|(queued, _)| *queued != trial);
        self.cancelled.insert(trial);
        self.postponed.remove(&trial);
        if let Some(running) = self.running.take_if(|running| running.trial == trial) {
            running.cancelled.cancel();
        }
    }

    /// Begins the next requested job that is not postponed.
    pub(super) fn begin_requested(&mut self, order: RequestOrder, now: Instant) -> Option<RunningJob<R>> {
        self.postponed.retain(|_, until| *until > now);
        let ready = self.requested.iter().enumerate().filter(|(_, (trial, _))| !self.postponed.contains_key(trial));
        let (place, _) = match order {
            RequestOrder::OldestRequest => ready.min_by_key(|(place, _)| *place),
            RequestOrder::NewestTrial => ready.max_by_key(|(_, (trial, _))| *trial),
        }?;
        let (trial, request) = self.requested.remove(place);
        self.begin(trial, request)
    }

    /// Begins the job of a trial, unless it is cancelled, failed or postponed.
    pub(super) fn begin(&mut self, trial: TrialId, request: R) -> Option<RunningJob<R>> {
        if self.skipped().contains(&trial) {
            return None;
        }
        self.requested.retain(|(queued, _)| *queued != trial);
        let running = RunningJob { trial, request, since: Instant::now(), cancelled: CancellationToken::new() };
        Some(self.running.insert(running).clone())
    }

    /// Ends the running job.
    pub(super) fn end(&mut self) {
        // A cancelled job is no longer there.
        self.running = None;
    }

    /// Ends a job that failed because of the machine, and queues it again unless it was cancelled.
    pub(super) fn postpone(&mut self, trial: TrialId, request: R) {
        self.end();
        if !self.cancelled.contains(&trial) && self.admits(trial) {
            self.requested.push((trial, request));
            self.postponed.insert(trial, Instant::now() + RETRY_PAUSE);
        }
    }

    /// When the next postponed job is tried again.
    pub(super) fn next_retry(&self) -> Option<Instant> {
        self.postponed.values().min().copied()
    }

    /// Ends a job that failed for this reason.
    pub(super) fn fail(&mut self, trial: TrialId, reason: String) {
        self.end();
        if !self.cancelled.contains(&trial) {
            self.failed.insert(trial, reason);
        }
    }

    /// Trials that are not taken from ended studies.
    pub(super) fn skipped(&self) -> BTreeSet<TrialId> {
        self.cancelled.iter().chain(self.failed.keys()).chain(self.postponed.keys()).copied().collect()
    }

    /// Whether the job of a trial is neither queued nor running and has not failed.
    fn admits(&self, trial: TrialId) -> bool {
        let running = self.running.as_ref().is_some_and(|running| running.trial == trial);
        let queued = self.requested.iter().any(|(queued, _)| *queued == trial);
        !running && !queued && !self.failed.contains_key(&trial)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trials() -> [TrialId; 3] {
        let mut trials = [TrialId::fresh(), TrialId::fresh(), TrialId::fresh()];
        trials.sort_unstable();
        trials
    }

    fn begun(queue: &mut JobQueue<u32>, order: RequestOrder) -> Option<(TrialId, u32)> {
        let running = queue.begin_requested(order, Instant::now());
        queue.end();
        running.map(|running| (running.trial, running.request))
    }

    #[test]
    fn requests_are_served_in_the_order_of_the_kind_of_job() {
        let [old, middle, new] = trials();
        for (order, expected) in
            [(RequestOrder::OldestRequest, [middle, new, old]), (RequestOrder::NewestTrial, [new, middle, old])]
        {
            let mut queue = JobQueue::default();
            for (trial, request) in [(middle, 1), (new, 2), (old, 3), (new, 4)] {
                queue.ask(trial, request);
            }
            let served: Vec<TrialId> =
                std::iter::from_fn(|| begun(&mut queue, order)).map(|(trial, _)| trial).collect();
            assert_eq!(served, expected, "each once");
        }
    }

    #[test]
    fn cancelled_job_stops_and_can_be_requested_again() {
        let [trial, other, _] = trials();
        let mut queue = JobQueue::default();
        queue.ask(trial, 1);
        let running = queue.begin_requested(RequestOrder::OldestRequest, Instant::now()).unwrap();
        assert_eq!(queue.open(), [(trial, JobState::Running)]);
        queue.cancel(trial);
        assert!(running.cancelled.is_cancelled());
        assert_eq!((queue.state(trial), queue.open()), (TrialJobState::Cancelled, Vec::new()));
        queue.recall(vec![(trial, 1), (other, 2)]);
        assert_eq!(queue.open(), [(other, JobState::Queued)], "a cancelled request is not recalled");
        queue.ask(trial, 3);
        queue.end();
        assert_eq!(queue.state(trial), TrialJobState::Queued(3), "the end of the cancelled job leaves the new request");
    }

    #[test]
    fn failed_job_is_not_repeated_until_it_is_forgotten() {
        let [trial, ..] = trials();
        let mut queue = JobQueue::default();
        queue.ask(trial, 1);
        queue.begin_requested(RequestOrder::OldestRequest, Instant::now()).unwrap();
        queue.fail(trial, "no gait".to_owned());
        queue.ask(trial, 2);
        assert_eq!(queue.state(trial), TrialJobState::Failed("no gait".to_owned()));
        assert!(queue.skipped().contains(&trial) && begun(&mut queue, RequestOrder::OldestRequest).is_none());
        queue.forget(trial);
        queue.ask(trial, 3);
        assert_eq!(begun(&mut queue, RequestOrder::OldestRequest), Some((trial, 3)));
    }

    #[test]
    fn postponed_job_lets_others_pass_until_its_time() {
        let [trial, other, _] = trials();
        let mut queue = JobQueue::default();
        queue.ask(trial, 1);
        queue.ask(other, 2);
        queue.begin_requested(RequestOrder::OldestRequest, Instant::now()).unwrap();
        queue.postpone(trial, 1);
        assert_eq!(begun(&mut queue, RequestOrder::OldestRequest), Some((other, 2)));
        assert_eq!(
            (begun(&mut queue, RequestOrder::OldestRequest), queue.state(trial)),
            (None, TrialJobState::Queued(1))
        );
        let due = queue.next_retry().unwrap();
        assert_eq!(queue.begin_requested(RequestOrder::OldestRequest, due).map(|running| running.trial), Some(trial));
    }
}
