//! Trials by the values of their bounds: parallel coordinates of all bounds, and one chart for a single bound.

use crate::bound_units::{self, meaning};
use crate::format::{decimal, signed};
use gait_learner::LearnerError;
use gaitwright_charts::{Chart, Figure, Parallel, ParallelAxis, ParallelLine, PointLink};
use gaitwright_service::studies::analysis::Analysis;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::studies::AnswerSource;
use gaitwright_store::trials::{Trial, TrialState};

/// How many of the newest trials are drawn, so that the page stays light.
pub(crate) const DRAWN: usize = 100;

/// Measure by which trials are compared: Gait RMSE if it answers the comparisons, otherwise the mean utility.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TrialMeasure {
    GaitRmse,
    Utility,
}

impl TrialMeasure {
    pub(crate) fn of(snapshot: &StudySnapshot) -> Self {
        match snapshot.study.plan.answer_source {
            AnswerSource::GaitRmse => Self::GaitRmse,
            AnswerSource::People | AnswerSource::Both => Self::Utility,
        }
    }

    fn label(self) -> &'static str {
        match self {
            Self::GaitRmse => "Gait RMSE, rad",
            Self::Utility => "utility",
        }
    }

    fn in_words(self, value: f64) -> String {
        match self {
            Self::GaitRmse => format!("Gait RMSE {} rad", decimal(Some(value))),
            Self::Utility => format!("utility {}", signed(value)),
        }
    }

    /// `None` without a gait.
    fn value(self, trial: &Trial, analysis: &Analysis) -> Result<Option<f64>, LearnerError> {
        Ok(match self {
            _ if trial.state != TrialState::Converged => None,
            Self::GaitRmse => trial.gait_rmse_rad,
            Self::Utility => Some(analysis.posterior.mean(trial.action_index)?),
        })
    }
}

/// A result to draw.
struct DrawnTrial<'a> {
    trial: &'a Trial,
    outcome: Option<f64>,
    link: PointLink,
}

/// The newest results.
fn drawn<'a>(snapshot: &'a StudySnapshot, analysis: &Analysis) -> Result<Vec<DrawnTrial<'a>>, LearnerError> {
    let shown = TrialMeasure::of(snapshot);
    let results = snapshot.trials.iter().rev().filter(|trial| trial.state.is_result()).take(DRAWN);
    let draw = |trial: &'a Trial| {
        let outcome = shown.value(trial, analysis)?;
        let what = outcome.map_or_else(|| "no gait".to_owned(), |value| shown.in_words(value));
        let name = format!("trial {}: {what}", trial.number);
        Ok(DrawnTrial { trial, outcome, link: PointLink { address: format!("/trials/{}", trial.id), name } })
    };
    results.map(draw).collect()
}

/// All bounds and the outcome; `None` without a result.
///
/// # Errors
/// Errors of the learner.
pub(crate) fn parallel(snapshot: &StudySnapshot, analysis: &Analysis) -> Result<Option<Figure>, LearnerError> {
    let (space, shown) = (analysis.posterior.space(), TrialMeasure::of(snapshot));
    let axes = space.dimensions().iter().map(|dimension| ParallelAxis {
        name: dimension.name.clone(),
        meaning: meaning(&dimension.name),
        values: bound_units::all_shown(&dimension.name, &dimension.values),
    });
    let line = |drawn: DrawnTrial<'_>| {
        let levels = space.levels(space.check(drawn.trial.action_index)?);
        Ok(ParallelLine { link: drawn.link, levels, outcome: drawn.outcome })
    };
    let lines = drawn(snapshot, analysis)?.into_iter().map(line).collect::<Result<Vec<_>, LearnerError>>()?;
    Ok((!lines.is_empty()).then(|| {
        Figure::parallel(Parallel {
            title: "Bounds and result of each trial".to_owned(),
            axes: axes.collect(),
            outcome: shown.label().to_owned(),
            low_is_good: shown == TrialMeasure::GaitRmse,
            lines,
        })
    }))
}

/// The outcome of each trial over one of its bounds.
///
/// # Errors
/// Errors of the learner.
pub(crate) fn by_bound(
    snapshot: &StudySnapshot,
    analysis: &Analysis,
    dimension: usize,
) -> Result<Option<Figure>, LearnerError> {
    let (space, shown) = (analysis.posterior.space(), TrialMeasure::of(snapshot));
    let Some(bound) = space.dimensions().get(dimension) else { return Ok(None) };
    let values = bound_units::all_shown(&bound.name, &bound.values);
    let mut points = Vec::new();
    for drawn in drawn(snapshot, analysis)? {
        let level = space.levels(space.check(drawn.trial.action_index)?)[dimension];
        points.extend(drawn.outcome.map(|outcome| ((values[level], outcome), drawn.link)));
    }
    if points.is_empty() {
        return Ok(None);
    }
    let title = format!("Trials by {}", bound.name);
    let across = format!("{}: {}", bound.name, meaning(&bound.name));
    let mut chart = Chart::new(&title, &across, shown.label()).with_links("trial", 0, points);
    chart.x_ticks = values;
    Ok(Some(Figure::chart("", chart)))
}
