//! Folds: where the family of a gait ends, a solve jumps to another local optimum. The objectives of a study reveal it, since
//! looser bounds cannot raise the objective of the same local optimum.

use super::snapshot::StudySnapshot;
use gait_optimizer::solve::StartedFrom;
use gait_optimizer::{SolveReport, SolveStatus, TunedBounds};
use gaitwright_store::trials::Trial;
use std::cmp::Ordering;

/// Relative difference of objectives beyond which looser bounds show another local optimum. Bounds that are tightened between
/// nodes differ from gait to gait, which changes the objective by less.
const SAME_LOCAL_OPTIMUM: f64 = 5e-3;

/// The sentence for a fold that the solve of `trial` reveals; `None` without a fold.
pub(super) fn in_words(snapshot: &StudySnapshot, trial: &Trial, report: &SolveReport) -> Option<String> {
    if report.status != SolveStatus::Converged {
        return None;
    }
    if let (StartedFrom::ColdAfterWarm, Some(start)) = (report.started_from, trial.warm_started_from) {
        let start = snapshot.trial(start).map_or_else(String::new, |start| format!(" {}", start.number));
        return Some(format!("Found by a cold start, because the warm start from trial{start} did not converge."));
    }
    let others = || {
        let converged = snapshot.trials.iter().filter(|other| other.state.has_gait());
        converged
            .filter(|other| other.id != trial.id)
            .filter_map(|other| Some((other, other.report.as_ref()?.objective)))
    };
    let own = report.objective;
    let is_above = |one: f64, other: f64| one - other > SAME_LOCAL_OPTIMUM * other.abs();
    let compare = |other: &Trial| compare_strictness(&other.action, &trial.action);
    let better =
        others().filter(|(other, objective)| compare(other).is_some_and(Ordering::is_ge) && is_above(own, *objective));
    if let Some((other, objective)) = better.min_by(|a, b| a.1.total_cmp(&b.1)) {
        return Some(format!(
            "Another local optimum: with stricter bounds, trial {} has an objective of {objective:.4}, less than {own:.4} here.",
            other.number
        ));
    }
    let worse =
        others().filter(|(other, objective)| compare(other).is_some_and(Ordering::is_le) && is_above(*objective, own));
    worse.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(other, objective)| {
        format!(
            "Another local optimum: with looser bounds, trial {} has an objective of {objective:.4}, more than {own:.4} here.",
            other.number
        )
    })
}

/// Which bounds are stricter: `Greater` if `one` is at least as strict in every bound, `Less` if `other` is; `None` if each is
/// stricter somewhere.
fn compare_strictness(one: &TunedBounds, other: &TunedBounds) -> Option<Ordering> {
    let pairs = one.to_array().into_iter().zip(other.to_array()).zip(TunedBounds::IS_LOWER);
    pairs.map(|((one, other), is_lower)| if is_lower { one.total_cmp(&other) } else { other.total_cmp(&one) }).try_fold(
        Ordering::Equal,
        |all, next| match (all, next) {
            (same, Ordering::Equal) | (Ordering::Equal, same) => Some(same),
            (all, next) => (all == next).then_some(all),
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strictness_is_compared_in_the_direction_of_each_bound() {
        let loose = TunedBounds::default();
        let stricter = TunedBounds { a2: 80.0, a5: 0.013, ..loose };
        let mixed = TunedBounds { a2: 80.0, a8: 50.0, ..loose };
        assert_eq!(compare_strictness(&stricter, &loose), Some(Ordering::Greater));
        assert_eq!(compare_strictness(&loose, &stricter), Some(Ordering::Less));
        assert_eq!(compare_strictness(&loose, &loose), Some(Ordering::Equal));
        assert_eq!(compare_strictness(&mixed, &loose), None);
    }
}
