//! The utility of the recommended gait over the answers of people.

use gait_learner::LearnerError;
use gaitwright_charts::{Chart, Figure, Stroke};
use gaitwright_compute::OnPool;
use gaitwright_service::studies::analysis::Analyses;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_service::studies::utility_history::UtilityPoint;
use gaitwright_store::studies::AnswerSource;

/// The chart of a study in which people answer; `None` before the second answer. Not for a large study, whose snapshot has the
/// newest trials only.
///
/// # Errors
/// Errors of the learner.
pub(crate) fn utility(
    pool: &OnPool,
    snapshot: &StudySnapshot,
    analyses: &Analyses,
) -> Result<Option<Figure>, LearnerError> {
    if snapshot.study.plan.answer_source == AnswerSource::GaitRmse {
        return Ok(None);
    }
    let points = analyses.utility_history(pool, snapshot)?;
    Ok((points.len() > 1).then(|| Figure::chart("", chart(&points))))
}

fn chart(points: &[UtilityPoint]) -> Chart {
    let mean = points.iter().map(|point| (f64::from(point.answers), point.utility.mean)).collect();
    let band = points.iter().map(|point| {
        let (mean, deviation) = (point.utility.mean, point.utility.standard_deviation);
        (f64::from(point.answers), mean - deviation, mean + deviation)
    });
    let mut chart = Chart::new("Utility of the recommended gait", "answers", "utility, no unit")
        .with_band("one standard deviation", 0, band.collect())
        .with("mean", 0, Stroke::Marked, mean);
    chart.whole_x = true;
    chart
}
