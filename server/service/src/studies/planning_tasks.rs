//! The planning tasks in progress: at most one for each study.

use super::snapshot::StudySnapshot;
use crate::error::Error;
use gaitwright_store::StudyId;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::task::{Id, JoinSet};

/// How long jobs of other studies wait for a plan.
const PLAN_WAIT: Duration = Duration::from_secs(1);

/// The result of a planning task: the snapshot of the study if it waits for an answer.
type Planned = Result<Option<StudySnapshot>, Error>;

/// The planning tasks in progress.
#[derive(Debug, Default)]
pub(super) struct Plans {
    tasks: JoinSet<Planned>,
    under_way: HashMap<Id, (StudyId, Instant)>,
    /// Studies that may have changed since their task started, and must be planned again.
    again: HashSet<StudyId>,
    /// Studies that waited for an answer when they were last planned.
    waiting: BTreeMap<StudyId, Arc<StudySnapshot>>,
}

impl Plans {
    /// Starts a task for a study, or schedules another one after the task in progress.
    pub(super) fn begin(&mut self, study: StudyId, plan: impl Future<Output = Planned> + Send + 'static) {
        if self.under_way.values().any(|(other, _)| *other == study) {
            self.again.insert(study);
        } else {
            let id = self.tasks.spawn(plan).id();
            self.under_way.insert(id, (study, Instant::now()));
        }
    }

    /// Forgets all studies that are not active.
    pub(super) fn keep(&mut self, is_active: impl Fn(StudyId) -> bool) {
        self.waiting.retain(|study, _| is_active(*study));
        self.again.retain(|study| is_active(*study));
    }

    /// Waits for the next task to end. Returns `None` if no task is in progress.
    pub(super) async fn next(&mut self) -> Option<(StudyId, Planned)> {
        let (id, planned) = match self.tasks.join_next_with_id().await? {
            Ok(made) => made,
            Err(error) => (error.id(), Err(Error::Internal(format!("planning was aborted: {error}")))),
        };
        Some((self.under_way.remove(&id)?.0, planned))
    }

    /// Records the result of a task. Returns whether the study must be planned again.
    pub(super) fn ended(&mut self, study: StudyId, snapshot: Option<StudySnapshot>) -> bool {
        match snapshot {
            Some(snapshot) => self.waiting.insert(study, Arc::new(snapshot)),
            None => self.waiting.remove(&study),
        };
        self.again.remove(&study)
    }

    /// When to dispatch jobs that have been queued since `since`. Dispatch waits for tasks in progress, so that a study
    /// with a higher priority comes first even if its planning takes longer, but at most for [`PLAN_WAIT`].
    pub(super) fn dispatch_at(&self, since: Instant) -> Instant {
        let newest = self.under_way.values().map(|(_, begun)| *begun + PLAN_WAIT).max();
        newest.map_or(since, |patient| patient.min(since + PLAN_WAIT))
    }

    /// The snapshots of the studies that wait for an answer.
    pub(super) fn waiting(&self) -> Arc<[Arc<StudySnapshot>]> {
        self.waiting.values().cloned().collect()
    }
}
