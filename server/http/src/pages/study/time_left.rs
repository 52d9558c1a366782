//! How long a running study still takes, from its own finished solves, or from earlier ones before there are enough.

use crate::format;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::studies::{AtlasRole, Evaluation, StudyState};
use gaitwright_store::trials::SolveTimes;

/// With fewer finished solves the study itself gives no estimate: the first one starts cold and takes longer than the others.
const MIN_SOLVES: usize = 3;

/// A sentence about the time left; empty unless the study runs. `results` is the number of trials with a result, `workers` the
/// number of solves that can run at a time. The first solves are estimated from `earlier` ones of any study.
pub(super) fn time_left(snapshot: &StudySnapshot, results: u32, workers: usize, earlier: Option<SolveTimes>) -> String {
    let study = &snapshot.study;
    if study.state != StudyState::Running {
        return String::new();
    }
    if study.plan.atlas == AtlasRole::Make {
        return "The atlas page shows the estimated time left.".to_owned();
    }
    if study.plan.evaluation == Evaluation::Script {
        return "The time left depends on the script that evaluates the trials.".to_owned();
    }
    let solves: Vec<f64> = snapshot.trials.iter().filter_map(|trial| trial.seconds_total).collect();
    let left = study.plan.number_of_trials.saturating_sub(results);
    if left == 0 {
        return "All trials have been solved.".to_owned();
    }
    let own = median(&solves).map(|median| (median, "the solves so far"));
    let Some((median, of)) = own.or(earlier.map(|earlier| (earlier.median_seconds, "the earlier solves here"))) else {
        let missing = MIN_SOLVES - solves.len();
        if left as usize <= missing {
            return String::new();
        }
        let solves = if missing == 1 { "1 more solve".to_owned() } else { format!("{missing} more solves") };
        return format!("The time left can be estimated after {solves}.");
    };
    // Earlier solves may have had the machine to themselves, so solves in parallel are not counted as faster.
    let parallel = if own.is_some() { (study.plan.parallel_trials as usize).min(workers).max(1) } else { 1 };
    let mut seconds = median * f64::from(left) / parallel as f64;
    if let Some(budget) = study.plan.solve_seconds_budget {
        let spent: f64 = solves.iter().sum();
        seconds = seconds.min((budget - spent).max(0.0) / parallel as f64);
    }
    let at_most = if study.plan.unchanged_limit.is_some() { "At most about" } else { "About" };
    let trials = if left == 1 { "1 trial".to_owned() } else { format!("{left} trials") };
    let people = format::also_waits_for(study.plan.answer_source);
    format!(
        "{at_most} {} left for {trials}{people}; half of {of} took less than {}.",
        format::duration(seconds),
        format::duration(median)
    )
}

/// `None` of too few values.
fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().filter(|_| sorted.len() >= MIN_SOLVES)
}

#[cfg(test)]
mod tests {
    use super::median;

    #[test]
    fn median_needs_three_values_and_ignores_a_slow_cold_start() {
        assert_eq!(median(&[]), None);
        assert_eq!(median(&[40.0, 3.0]), None);
        assert_eq!(median(&[40.0, 3.0, 4.0]), Some(4.0));
    }
}
