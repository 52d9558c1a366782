//! The plans that are being made: one task for each study, one at a time.

use super::snapshot::StudySnapshot;
use crate::error::Error;
use gaitwright_store::StudyId;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::task::{Id, JoinSet};

/// So long the other studies wait for a plan.
const PATIENCE: Duration = Duration::from_secs(1);

/// What came of a plan: where the study stands if it waits for an answer.
type Planned = Result<Option<StudySnapshot>, Error>;

/// See the module.
#[derive(Debug, Default)]
pub(super) struct Plans {
    tasks: JoinSet<Planned>,
    under_way: HashMap<Id, (StudyId, Instant)>,
    /// Studies in which something may have changed since their plan was begun.
    again: HashSet<StudyId>,
    /// Studies that waited for an answer when they were planned last.
    waiting: BTreeMap<StudyId, Arc<StudySnapshot>>,
}

impl Plans {
    /// Begins the plan of a study, or notes that it is to be made once more after the one that is being made.
    pub(super) fn begin(&mut self, study: StudyId, plan: impl Future<Output = Planned> + Send + 'static) {
        if self.under_way.values().any(|(other, _)| *other == study) {
            self.again.insert(study);
        } else {
            let id = self.tasks.spawn(plan).id();
            self.under_way.insert(id, (study, Instant::now()));
        }
    }

    /// What is known of other studies is forgotten.
    pub(super) fn keep(&mut self, is_active: impl Fn(StudyId) -> bool) {
        self.waiting.retain(|study, _| is_active(*study));
        self.again.retain(|study| is_active(*study));
    }

    /// The next plan that is made; none while none is being made.
    pub(super) async fn next(&mut self) -> Option<(StudyId, Planned)> {
        let (id, planned) = match self.tasks.join_next_with_id().await? {
            Ok(made) => made,
            Err(error) => (error.id(), Err(Error::Internal(format!("a plan was not made: {error}")))),
        };
        Some((self.under_way.remove(&id)?.0, planned))
    }

    /// Notes what came of a plan. Whether it is to be made once more.
    pub(super) fn ended(&mut self, study: StudyId, snapshot: Option<StudySnapshot>) -> bool {
        match snapshot {
            Some(snapshot) => self.waiting.insert(study, Arc::new(snapshot)),
            None => self.waiting.remove(&study),
        };
        self.again.remove(&study)
    }

    /// When jobs are handed out that were there at `since`: the plans that are being made are waited for, so that a study with
    /// a higher priority, whose plan takes a little longer, still comes first. [`PATIENCE`] ends, and a plan that takes longer
    /// holds up nobody.
    pub(super) fn hand_out_at(&self, since: Instant) -> Instant {
        let newest = self.under_way.values().map(|(_, begun)| *begun + PATIENCE).max();
        newest.map_or(since, |patient| patient.min(since + PATIENCE))
    }

    /// Where the studies stand that wait for an answer.
    pub(super) fn waiting(&self) -> Arc<[Arc<StudySnapshot>]> {
        self.waiting.values().cloned().collect()
    }
}
