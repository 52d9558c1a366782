//! The progress of studies: Gait RMSE of the best action by iteration, and the warm starts.

use super::outcome::StudyOutcome;
use gaitwright_charts::{Chart, Figure, Stroke, Tree, TreeNode};
use gaitwright_service::studies::history;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::TrialId;
use gaitwright_store::trials::{Trial, TrialState};
use std::collections::HashMap;

/// Group of the figures that show the progress of a study.
pub(crate) const PROGRESS: &str = "progress";

/// Gait RMSE of the best action by iteration, for one study with its trials or for several studies; `None` before the first
/// converged trial.
pub(crate) fn progress_chart(studies: &[(&StudySnapshot, &StudyOutcome)]) -> Option<Chart> {
    let title = "Gait RMSE of the best action by iteration";
    let mut chart = Chart::new(title, "iteration (in order of the results)", "Gait RMSE, rad");
    if let [(snapshot, outcome)] = studies {
        chart = chart.with("trial", 7, Stroke::Points, converged(snapshot));
        chart = chart.with("best action so far", 0, Stroke::Steps, outcome.progress());
    } else {
        let strokes = Stroke::DISTINCT_STEPS.into_iter().cycle();
        for ((place, (snapshot, outcome)), stroke) in studies.iter().enumerate().zip(strokes) {
            chart = chart.with(&snapshot.study.plan.name, place, stroke, outcome.progress());
        }
    }
    chart.whole_x = true;
    (!chart.legend().is_empty()).then_some(chart)
}

/// Gait RMSE of each converged trial by iteration.
fn converged(snapshot: &StudySnapshot) -> Vec<(f64, f64)> {
    history::results(snapshot)
        .into_iter()
        .zip(1_u32..)
        .filter(|(trial, _)| trial.state == TrialState::Converged)
        .filter_map(|(trial, iteration)| Some((f64::from(iteration), trial.gait_rmse_rad?)))
        .collect()
}

/// Warm-start tree of the newest trials; `None` before the first warm start.
pub(crate) fn warm_starts(snapshot: &StudySnapshot, best: Option<TrialId>, newest: usize) -> Option<Figure> {
    let trials = &snapshot.trials[snapshot.trials.len().saturating_sub(newest)..];
    let places: HashMap<TrialId, usize> = trials.iter().enumerate().map(|(i, trial)| (trial.id, i)).collect();
    let node = |trial: &Trial| TreeNode {
        parent: trial.warm_started_from.and_then(|from| places.get(&from).copied()),
        label: format!("trial {}", trial.number),
        link: format!("/trials/{}", trial.id),
        class: if best == Some(trial.id) { "best" } else { trial.state.as_str() },
    };
    let nodes: Vec<TreeNode> = trials.iter().map(node).collect();
    let title = format!("Warm starts of {}", snapshot.study.plan.name);
    nodes.iter().any(|node| node.parent.is_some()).then(|| Figure::tree(Tree { title, nodes }))
}
