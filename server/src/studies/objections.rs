//! What people said of gaits that is no preference, wherever they said it: gaits that must not be walked, and pairs of
//! which somebody could not tell which is better.

use crate::error::Error;
use crate::store::presentations::Said;
use crate::store::{Connection, Instant, StoreResult, StudyId, TrialId, lab_sessions, presentations, remarks};

/// A gait that somebody called unsafe: nobody is asked about it, and it is not recommended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Closed {
    /// The trial.
    pub trial: TrialId,
    /// Who said so, as shown.
    pub by: String,
    /// When.
    pub at: Instant,
}

/// What was objected to in a study.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Objections {
    /// Gaits that must not be walked.
    pub closed: Vec<Closed>,
    /// Pairs that are not asked about again.
    pub skipped: Vec<(TrialId, TrialId)>,
}

impl Objections {
    /// Those that stand.
    ///
    /// # Errors
    /// What the database reports.
    pub async fn read(db: &mut Connection, study: StudyId) -> StoreResult<Self> {
        let mut found = Self::default();
        for shown in presentations::of_study(db, study).await? {
            if let Some((said, at)) = shown.answer.zip(shown.answered_at) {
                found.hear(said, shown.pair(), &format!("rater {}", shown.rater), at);
            }
        }
        for remark in remarks::of_study(db, study).await?.iter().filter(|remark| remark.retraction.is_none()) {
            found.hear(remark.answer, remark.pair(), &remark.author, remark.created_at);
        }
        for session in lab_sessions::of_study(db, study).await? {
            if session.done(lab_sessions::Act::Unblinded).is_some() {
                // What was said there was told with the order: it is a remark, or a preference.
                continue;
            }
            if let Some(answer) = session.answer().filter(|answer| answer.said.is_about_safety()) {
                // Which of the two it is would tell the order: both are closed until that is told.
                let by = format!("the subject in lab session {}, of one of its two gaits or both", session.number);
                let closed = |trial| Closed { trial, by: by.clone(), at: answer.at };
                found.closed.extend([session.gait_one, session.gait_two].map(closed));
            }
        }
        Ok(found)
    }

    fn hear(&mut self, said: Said, pair: (TrialId, TrialId), by: &str, at: Instant) {
        if said == Said::CannotTell {
            self.skipped.push(pair);
        }
        let closed = |trial| Closed { trial, by: by.to_owned(), at };
        self.closed.extend(said.unsafe_of(pair).into_iter().map(closed));
    }

    /// Whether somebody called the gait of this trial unsafe.
    pub fn closes(&self, trial: TrialId) -> bool {
        self.closed.iter().any(|closed| closed.trial == trial)
    }

    /// Whether somebody could not tell which of the two is better.
    pub fn is_skipped(&self, (a, b): (TrialId, TrialId)) -> bool {
        self.skipped.iter().any(|pair| *pair == (a, b) || *pair == (b, a))
    }

    /// Refuses a gait that somebody called unsafe; `field` named it.
    ///
    /// # Errors
    /// [`Error::Invalid`].
    pub fn refuse(&self, field: &str, trial: TrialId) -> Result<(), Error> {
        match self.closed.iter().find(|closed| closed.trial == trial) {
            None => Ok(()),
            Some(closed) => {
                let allowed = format!("a gait that nobody called unsafe; this one was, by {}", closed.by);
                Err(Error::invalid(field, trial.to_string(), &allowed))
            }
        }
    }
}
