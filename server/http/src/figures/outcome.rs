//! Results of a study, for charts and pages, computed from its snapshot on the thread pool.

use gait_learner::LearnerError;
use gaitwright_compute::OnPool;
use gaitwright_service::studies::analysis::Analyses;
use gaitwright_service::studies::history::{self, HistoryEntry};
use gaitwright_service::studies::pending_comparison::{PendingComparison, awaited_comparison};
use gaitwright_service::studies::recommended_trial::{last_known_best, ranking_to_show};
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::TrialId;
use gaitwright_store::studies::{AnswerSource, StudyState};

/// Results of a study.
#[derive(Default)]
pub(crate) struct StudyOutcome {
    /// Whether people answer and nobody has yet, so that the posterior is only the prior.
    pub(crate) unanswered: bool,
    /// The best trial.
    pub(crate) best: Option<TrialId>,
    /// The gaits from best to worst.
    pub(crate) ranking: Vec<TrialId>,
    /// The best action by iteration.
    history: Vec<HistoryEntry>,
    /// Whether people are asked to compare two gaits.
    pub(crate) comparison_pending: bool,
    /// The trial whose certificate the next comparison waits for.
    pub(crate) comparison_after: Option<TrialId>,
}

impl StudyOutcome {
    /// The outcome of a study. Of a large study, the snapshot has the newest trials only.
    ///
    /// # Errors
    /// Errors of the learner.
    pub(crate) fn of(
        pool: &OnPool,
        snapshot: &StudySnapshot,
        large: bool,
        analyses: &Analyses,
    ) -> Result<Self, LearnerError> {
        if large {
            // A large study is not read completely, so the learner's last best action is used instead of the posterior.
            let best = last_known_best(snapshot);
            let (ranking, history) = (best.into_iter().collect(), history::known(snapshot));
            let comparison_pending = snapshot.study.state == StudyState::Waiting;
            return Ok(Self { best, ranking, history, comparison_pending, ..Self::default() });
        }
        let open = match snapshot.study.plan.answer_source {
            AnswerSource::GaitRmse => PendingComparison::None,
            AnswerSource::People | AnswerSource::Both => awaited_comparison(pool, snapshot)?,
        };
        let comparison_pending = open.trials().is_some();
        let comparison_after = match open {
            PendingComparison::AfterCertificate(trial) => Some(trial),
            PendingComparison::None | PendingComparison::Pair(_) => None,
        };
        if snapshot.waits_for_first_answer() {
            return Ok(Self { unanswered: true, comparison_pending, comparison_after, ..Self::default() });
        }
        let ranking = ranking_to_show(pool, snapshot, analyses)?;
        let best = ranking.first().copied();
        let history = history::of(snapshot, best);
        Ok(Self { best, ranking, history, comparison_pending, comparison_after, ..Self::default() })
    }

    /// Gait RMSE of the best action by iteration.
    pub(crate) fn progress(&self) -> Vec<(f64, f64)> {
        let point = |milestone: &HistoryEntry| Some((f64::from(milestone.iteration), milestone.gait_rmse_rad?));
        self.history.iter().filter_map(point).collect()
    }
}
