//! The statements of the paper about its experiment, each with the result of this comparison.

use super::variants::{PairComparison, ReproducedStudy};
use gaitwright_service::studies::certified_best::CertificateState;

/// A statement of the paper.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Statement {
    /// The statement.
    pub(super) paper: String,
    /// The result here.
    pub(super) here: String,
    /// Whether they agree.
    pub(super) agrees: &'static str,
}

/// Every statement of the paper, in its order.
pub(super) fn statements(outcomes: &[ReproducedStudy], pair_comparisons: &[PairComparison]) -> Vec<Statement> {
    let mut subjects: Vec<u32> = pair_comparisons.iter().map(|comparison| comparison.subject).collect();
    subjects.sort_unstable();
    subjects.dedup();
    let mut all: Vec<Statement> = subjects.iter().map(|subject| lower_rmse(*subject, pair_comparisons)).collect();
    all.push(stable(outcomes));
    let people = "not compared: this needs a subject with electrodes, in a lab session of the service";
    for paper in [
        "EMG RMSE is lower with muscles: 1.58 against 1.80 (subject 1), 1.84 against 2.34 (subject 2)",
        "Both subjects strongly prefer the gait with muscles after walking with both",
    ] {
        all.push(Statement { paper: paper.to_owned(), here: people.to_owned(), agrees: "-" });
    }
    all
}

fn lower_rmse(subject: u32, pair_comparisons: &[PairComparison]) -> Statement {
    let pairs: Vec<&PairComparison> =
        pair_comparisons.iter().filter(|comparison| comparison.subject == subject).collect();
    let throughout = pairs.iter().filter(|comparison| comparison.throughout()).count();
    let (lower, compared) =
        pairs.iter().fold((0, 0), |(l, c), comparison| (l + comparison.lower, c + comparison.compared));
    Statement {
        paper: format!(
            "Subject {subject}: Gait RMSE of the best action is lower with muscles throughout the tuning (figure 3b)"
        ),
        here: format!("throughout for {throughout} of {} seeds; at {lower} of {compared} iterations", pairs.len()),
        agrees: match throughout {
            0 => "no",
            1 if pairs.len() == 1 => "yes, but only one seed",
            all if all == pairs.len() => "yes",
            _ => "in part",
        },
    }
}

fn stable(outcomes: &[ReproducedStudy]) -> Statement {
    let with_gait = outcomes.iter().filter(|outcome| outcome.best_trial.is_some()).count();
    let passed = outcomes.iter().filter(|outcome| outcome.certificate == CertificateState::Passed).count();
    let fallback = outcomes.iter().filter(|outcome| outcome.passing.is_some()).count();
    let others = match with_gait - passed {
        0 => String::new(),
        failed => format!(
            "; in {fallback} of the {failed} studies whose best gait failed certification, a lower-ranked gait passed"
        ),
    };
    Statement {
        paper: "Both gaits are stable limit cycles (figure 5)".to_owned(),
        here: format!(
            "{passed} of {with_gait} best gaits passed certification (20 strides of the simulated closed loop, multipliers, \
             constraints between nodes){others}"
        ),
        agrees: match passed {
            0 => "no",
            all if all == with_gait => "yes",
            _ => "in part",
        },
    }
}
