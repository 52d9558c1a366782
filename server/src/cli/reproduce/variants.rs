//! Compares studies with and without muscles for each subject and seed, as tables and as text.

use gait_optimizer::{Gait, ReferenceGait};
use gaitwright_charts::csv_table::{CsvCell, CsvTable, cells};
use gaitwright_service::studies::certified_best::CertificateState;
use gaitwright_service::studies::history::HistoryEntry;

/// The five coordinates of Gait RMSE.
pub(super) const COORDINATES: [&str; 5] = ["torso", "hip_L", "knee_L", "ankle_L", "hip_R"];

/// Joint angles over the stride at 0, 1, ..., 100 %, rad.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Curve(pub(super) Vec<[f64; 5]>);

impl Curve {
    pub(super) fn of(gait: &Gait) -> Self {
        Self::sampled(|fraction| {
            let q = gait.coordinates_at(fraction * gait.stride_time_s);
            std::array::from_fn(|i| q[2 + i])
        })
    }

    fn sampled(at: impl Fn(f64) -> [f64; 5]) -> Self {
        Self((0..=100).map(|percent| at(f64::from(percent) / 100.0)).collect())
    }
}

/// The results of a study.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ReproducedStudy {
    pub(super) subject: u32,
    pub(super) muscles: bool,
    pub(super) seed: u64,
    pub(super) trials: usize,
    pub(super) converged: usize,
    /// Total wall time of the solves.
    pub(super) solve_seconds: f64,
    /// Time from the start of the first trial to the end of the last one, interruptions included.
    pub(super) wall_seconds: f64,
    /// Gait RMSE of the best action after each result, rad; `None` before the first gait.
    pub(super) by_iteration: Vec<Option<f64>>,
    pub(super) best_trial: Option<u32>,
    pub(super) best_rmse_rad: Option<f64>,
    pub(super) best_cost_of_transport: Option<f64>,
    pub(super) best_bounds: Option<String>,
    /// State of the certificate of the best gait.
    pub(super) certificate: CertificateState,
    /// Reasons if the certificate failed.
    pub(super) failures: Vec<String>,
    /// If it failed, number and Gait RMSE, rad, of the best trial whose gait passed.
    pub(super) passing: Option<(u32, Option<f64>)>,
    /// Best gait.
    pub(super) gait: Option<Gait>,
    /// Reference gait for Gait RMSE.
    pub(super) reference: ReferenceGait,
}

impl ReproducedStudy {
    /// Joint angles of the best gait.
    pub(super) fn curve(&self) -> Option<Curve> {
        self.gait.as_ref().map(Curve::of)
    }

    /// The certificate of the best gait, and the best gait that passes if it failed.
    pub(super) fn certificate_in_words(&self) -> String {
        match (self.certificate, self.passing) {
            (CertificateState::Passed, _) => "passed".to_owned(),
            (CertificateState::NotCertified | CertificateState::BeingCertified, _) => "not certified".to_owned(),
            (CertificateState::Failed, None) => "failed".to_owned(),
            (CertificateState::Failed, Some((number, rmse))) => {
                let rmse = rmse.map_or_else(String::new, |rmse| format!(" ({rmse:.4} rad)"));
                format!("failed; the certificate of trial {number}{rmse} passed")
            }
        }
    }

    /// Why the certificate of the best gait failed, if it did.
    pub(super) fn failure_in_words(&self) -> Option<String> {
        let with = if self.muscles { "with" } else { "without" };
        let failures = self.failures.join("; ");
        let who = format!("subject {}, seed {}, {with} muscles", self.subject, self.seed);
        (self.certificate == CertificateState::Failed).then(|| format!("{who}: {failures}"))
    }
}

/// Fills the iterations between milestones. A recommendation holds until the next one.
pub(super) fn by_iteration(milestones: &[HistoryEntry], results: usize) -> Vec<Option<f64>> {
    (1..=results)
        .map(|iteration| {
            let before = |m: &&HistoryEntry| m.iteration as usize <= iteration;
            milestones.iter().rfind(before).and_then(|m| m.gait_rmse_rad)
        })
        .collect()
}

/// Whether muscles gave the lower Gait RMSE, for one subject and seed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PairComparison {
    pub(super) subject: u32,
    pub(super) seed: u64,
    /// Number of iterations at which both studies had a gait.
    pub(super) compared: usize,
    /// Number of these at which muscles gave the lower Gait RMSE.
    pub(super) lower: usize,
    /// Gait RMSE of the final best actions without and with muscles, rad.
    pub(super) last: Option<(f64, f64)>,
}

impl PairComparison {
    /// "Throughout the tuning process", as the paper says.
    pub(super) fn throughout(&self) -> bool {
        self.compared > 0 && self.lower == self.compared
    }

    pub(super) fn sentence(&self) -> String {
        let last = self.last.map_or_else(
            || "at least one of the two studies has no gait".to_owned(),
            |(without, with)| format!("final values: {with:.4} rad with muscles, {without:.4} rad without"),
        );
        format!(
            "subject {}, seed {}: Gait RMSE is lower with muscles at {} of {} iterations{}; {last}",
            self.subject,
            self.seed,
            self.lower,
            self.compared,
            if self.throughout() { " (throughout)" } else { "" }
        )
    }
}

/// One comparison for each pair of studies.
pub(super) fn pair_comparisons(outcomes: &[ReproducedStudy]) -> Vec<PairComparison> {
    let partner = |plain: &ReproducedStudy| {
        outcomes.iter().find(|o| o.muscles && (o.subject, o.seed) == (plain.subject, plain.seed))
    };
    outcomes
        .iter()
        .filter(|outcome| !outcome.muscles)
        .filter_map(|plain| partner(plain).map(|muscles| (plain, muscles)))
        .map(|(plain, muscles)| {
            let both: Vec<(f64, f64)> = plain
                .by_iteration
                .iter()
                .zip(&muscles.by_iteration)
                .filter_map(|(p, m)| Some(((*p)?, (*m)?)))
                .collect();
            PairComparison {
                subject: plain.subject,
                seed: plain.seed,
                compared: both.len(),
                lower: both.iter().filter(|(without, with)| with < without).count(),
                last: plain.best_rmse_rad.zip(muscles.best_rmse_rad),
            }
        })
        .collect()
}

/// The conclusion over all pairs, in words.
pub(super) fn conclusion(pair_comparisons: &[PairComparison]) -> String {
    let throughout = pair_comparisons.iter().filter(|v| v.throughout()).count();
    let at_the_end = pair_comparisons.iter().filter(|v| v.last.is_some_and(|(without, with)| with < without)).count();
    let pairs = pair_comparisons.len();
    let paper = "The paper's claim, lower Gait RMSE with muscles throughout the tuning process,";
    let answer = match throughout {
        _ if pairs == 0 => "cannot be tested: there is no pair of studies",
        1 if pairs == 1 => {
            "holds in the only pair, which is weak evidence, because local optima can tip the result either way"
        }
        all if all == pairs => "holds in every pair",
        0 => "holds in no pair",
        _ => "holds in only some pairs, depending on local optima",
    };
    let lower: usize = pair_comparisons.iter().map(|v| v.lower).sum();
    let compared: usize = pair_comparisons.iter().map(|v| v.compared).sum();
    format!(
        "{paper} {answer} ({throughout} of {pairs}). Gait RMSE is lower with muscles at {lower} of {compared} iterations, \
         and at the end in {at_the_end} of {pairs} pair{}{}.",
        if pairs == 1 { "" } else { "s" },
        spread(pair_comparisons)
    )
}

/// How much muscles lower the Gait RMSE of the final best actions.
fn spread(pair_comparisons: &[PairComparison]) -> String {
    let mut gains: Vec<f64> =
        pair_comparisons.iter().filter_map(|v| v.last).map(|(without, with)| without - with).collect();
    gains.sort_by(f64::total_cmp);
    match (gains.first(), gains.last()) {
        (Some(least), Some(most)) => {
            let median = f64::midpoint(gains[(gains.len() - 1) / 2], gains[gains.len() / 2]);
            if median < 0.0 {
                let (median, least, most) = (-median, -most, -least);
                format!("; muscles raise the final Gait RMSE by a median of {median:.3} rad ({least:.3} to {most:.3})")
            } else {
                format!("; muscles lower the final Gait RMSE by a median of {median:.3} rad ({least:.3} to {most:.3})")
            }
        }
        _ => String::new(),
    }
}

fn variant(outcome: &ReproducedStudy) -> Vec<CsvCell> {
    cells![outcome.subject, outcome.seed, if outcome.muscles { "on" } else { "off" }]
}

/// Gait RMSE of the best action by iteration.
pub(super) fn iterations_csv(outcomes: &[ReproducedStudy]) -> String {
    let mut table = CsvTable::new(["subject", "seed", "muscles", "iteration", "best_gait_rmse_rad"]);
    for outcome in outcomes {
        for (index, rmse) in outcome.by_iteration.iter().enumerate() {
            table.row(variant(outcome).into_iter().chain(cells![index + 1, *rmse]));
        }
    }
    table.into_text()
}

/// One row for each study.
pub(super) fn studies_csv(outcomes: &[ReproducedStudy]) -> String {
    let mut table = CsvTable::new([
        "subject",
        "seed",
        "muscles",
        "trials",
        "converged",
        "best_trial",
        "best_gait_rmse_rad",
        "best_cost_of_transport",
        "solve_seconds",
        "wall_seconds",
        "best_bounds",
        "certificate",
        "passing_trial",
        "passing_gait_rmse_rad",
    ]);
    for o in outcomes {
        table.row(variant(o).into_iter().chain(cells![
            o.trials,
            o.converged,
            o.best_trial,
            o.best_rmse_rad,
            o.best_cost_of_transport,
            format!("{:.1}", o.solve_seconds),
            format!("{:.1}", o.wall_seconds),
            o.best_bounds.as_deref(),
            o.certificate.as_str(),
            o.passing.map(|(number, _)| number),
            o.passing.and_then(|(_, rmse)| rmse),
        ]));
    }
    table.into_text()
}

/// Final joint angles, and the reference gait with its standard deviation, if it has one.
pub(super) fn angles_csv(outcomes: &[ReproducedStudy]) -> String {
    let columns = COORDINATES.map(|name| format!("{name}_rad"));
    let first = ["subject", "seed", "muscles", "percent"].map(str::to_owned);
    let mut table = CsvTable::new(first.into_iter().chain(columns));
    let mut rows = |who: &[CsvCell], curve: &[[f64; 5]]| {
        for (percent, angles) in curve.iter().enumerate() {
            let values = cells![percent].into_iter().chain(angles.iter().map(CsvCell::from));
            table.row(who.iter().cloned().chain(values));
        }
    };
    if let Some(first) = outcomes.first() {
        let labels = |name: &str| cells![name, "", ""];
        rows(&labels("reference"), &first.reference.angles_rad);
        if let Some(deviation) = &first.reference.standard_deviation_rad {
            rows(&labels("reference standard deviation"), deviation);
        }
    }
    for outcome in outcomes {
        if let Some(curve) = outcome.curve() {
            rows(&variant(outcome), &curve.0);
        }
    }
    table.into_text()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(muscles: bool, seed: u64, by_iteration: Vec<Option<f64>>) -> ReproducedStudy {
        ReproducedStudy {
            subject: 1,
            muscles,
            seed,
            trials: by_iteration.len(),
            converged: by_iteration.len(),
            solve_seconds: 1.0,
            wall_seconds: 2.0,
            best_rmse_rad: by_iteration.last().copied().flatten(),
            by_iteration,
            best_trial: Some(1),
            best_cost_of_transport: Some(0.06),
            best_bounds: None,
            certificate: CertificateState::Failed,
            failures: vec!["the simulated walker falls".to_owned()],
            passing: Some((2, Some(0.625))),
            gait: None,
            reference: ReferenceGait::builtin().unwrap(),
        }
    }

    #[test]
    fn only_iterations_with_both_gaits_count() {
        let outcomes = [
            outcome(false, 1, vec![None, Some(0.8), Some(0.7), Some(0.5)]),
            outcome(true, 1, vec![Some(0.9), Some(0.7), Some(0.6), Some(0.6)]),
            outcome(false, 2, vec![Some(0.8), Some(0.8)]),
            outcome(true, 2, vec![Some(0.7), Some(0.6)]),
        ];
        let found = pair_comparisons(&outcomes);
        assert_eq!((found[0].compared, found[0].lower, found[0].throughout()), (3, 2, false));
        assert_eq!(found[0].last, Some((0.5, 0.6)));
        assert!(found[1].throughout());
        let words = conclusion(&found);
        assert!(words.contains("only some pairs, depending on local optima (1 of 2)."), "{words}");
        assert!(words.contains("lower with muscles at 4 of 5 iterations, and at the end in 1 of 2 pairs"), "{words}");
        assert!(words.contains("by a median of 0.050 rad (-0.100 to 0.200)"), "{words}");
        assert!(conclusion(&found[1..]).contains("holds in the only pair, which is weak evidence"));
        assert!(conclusion(&[found[1].clone(), found[1].clone()]).contains("holds in every pair (2 of 2)"));
        assert!(conclusion(&found[..1]).contains("muscles raise the final Gait RMSE by a median of 0.100 rad"));
        assert!(conclusion(&[]).contains("cannot be tested"));
    }

    #[test]
    fn recommendation_holds_until_the_next_one() {
        let milestone = |iteration, rmse| HistoryEntry {
            iteration,
            trial_id: gaitwright_store::TrialId::fresh(),
            number: iteration,
            gait_rmse_rad: rmse,
            cost_of_transport: None,
        };
        let found = by_iteration(&[milestone(2, Some(0.9)), milestone(4, Some(0.5))], 5);
        assert_eq!(found, [None, Some(0.9), Some(0.9), Some(0.5), Some(0.5)]);
    }

    #[test]
    fn tables_have_a_row_for_each_iteration_and_study() {
        let outcomes = [outcome(false, 1, vec![None, Some(0.5)])];
        assert_eq!(
            iterations_csv(&outcomes),
            "subject,seed,muscles,iteration,best_gait_rmse_rad\n1,1,off,1,\n1,1,off,2,0.5\n"
        );
        assert!(studies_csv(&outcomes).ends_with("\n1,1,off,2,2,1,0.5,0.06,1.0,2.0,,failed,2,0.625\n"));
    }
}
