//! Progress of the running solves, in memory only. The record has the results.

use gait_optimizer::IterationRecord;
use gaitwright_store::{StudyId, TrialId};
use serde::Serialize;
use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use tokio::sync::broadcast;

/// One iteration of a running solve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SolveProgress {
    /// Identifier of the study.
    pub study_id: StudyId,
    /// Identifier of the trial.
    pub trial_id: TrialId,
    /// Its number within the study.
    pub number: u32,
    /// The iteration.
    #[serde(flatten)]
    pub record: IterationRecord,
}

/// The iterations of one solve so far.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// The study.
    pub study: StudyId,
    /// Number of the trial within the study.
    pub number: u32,
    /// Its iterations.
    pub records: Vec<IterationRecord>,
}

/// The running solves.
#[derive(Debug)]
pub struct RunningSolves {
    tracks: Mutex<HashMap<TrialId, Track>>,
    changes: broadcast::Sender<SolveProgress>,
}

impl Default for RunningSolves {
    fn default() -> Self {
        // A listener that falls further behind skips iterations.
        Self { tracks: Mutex::default(), changes: broadcast::channel(1024).0 }
    }
}

impl RunningSolves {
    /// Subscribes to all further iterations.
    pub fn listen(&self) -> broadcast::Receiver<SolveProgress> {
        self.changes.subscribe()
    }

    /// The iterations of a running solve.
    pub fn track(&self, trial: TrialId) -> Option<Track> {
        self.tracks().get(&trial).cloned()
    }

    /// Number of running solves.
    pub fn running(&self) -> usize {
        self.tracks().len()
    }

    pub(crate) fn open(&self, trial: TrialId, study: StudyId, number: u32) {
        self.tracks().insert(trial, Track { study, number, records: Vec::new() });
    }

    pub(crate) fn add(&self, trial: TrialId, record: IterationRecord) {
        let progress = self.tracks().get_mut(&trial).map(|track| {
            track.records.push(record);
            SolveProgress { study_id: track.study, trial_id: trial, number: track.number, record }
        });
        if let Some(progress) = progress {
            // Fails only without listeners.
            let _ = self.changes.send(progress);
        }
    }

    pub(crate) fn close(&self, trial: TrialId) {
        self.tracks().remove(&trial);
    }

    fn tracks(&self) -> MutexGuard<'_, HashMap<TrialId, Track>> {
        // The map is consistent between statements, so a poisoned lock is usable.
        self.tracks.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
