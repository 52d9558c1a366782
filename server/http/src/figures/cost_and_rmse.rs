//! Cost of transport of the gaits of a study against their Gait RMSE.

use super::trials_by_bound::DRAWN;
use gaitwright_charts::{Chart, Figure, PointLink};
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::TrialId;
use gaitwright_store::trials::{Trial, TrialState};

/// Cost of transport against Gait RMSE of the newest converged trials and of the recommended one; `None` without a trial that has
/// both values.
pub(crate) fn cost_and_rmse(snapshot: &StudySnapshot, recommended: Option<TrialId>) -> Option<Figure> {
    let point = |trial: &Trial| {
        let (rmse, cost) = trial.gait_rmse_rad.zip(trial.cost_of_transport)?;
        let name = format!("trial {}: Gait RMSE {rmse:.4} rad, cost of transport {cost:.4}", trial.number);
        Some(((rmse, cost), PointLink { address: format!("/trials/{}", trial.id), name }))
    };
    let converged = snapshot.trials.iter().rev().filter(|trial| trial.state == TrialState::Converged);
    let others = converged.filter(|trial| Some(trial.id) != recommended).filter_map(point).take(DRAWN).collect();
    let best = recommended.and_then(|id| snapshot.trial(id));
    let mut chart = Chart::new("Cost of transport and Gait RMSE", "Gait RMSE, rad", "cost of transport");
    chart = chart.with_links("trial", 0, others);
    if let Some(best) = best.and_then(point) {
        chart = chart.with_links("recommended", 1, vec![best]);
    }
    (!chart.legend().is_empty()).then(|| Figure::chart("", chart))
}
