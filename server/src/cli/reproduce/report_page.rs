//! The report of `gaitwright reproduce`: one self-contained HTML file.

use super::statements::{Statement, statements};
use super::variants::{PairComparison, ReproducedStudy, conclusion, pair_comparisons};
use askama::Template;
use gait_optimizer::Gait;
use gait_optimizer::gait::stick_figure::stick_figures;
use gaitwright_charts::gait_charts;
use gaitwright_charts::{Chart, STYLE_SHEET, Stroke, band_in_words, stride_pictures};
use gaitwright_service::error::Error;

#[derive(Template)]
#[template(path = "reproduce.html")]
struct ReproduceReport<'a> {
    style: &'static str,
    version: &'static str,
    trials: u32,
    conclusion: String,
    statements: Vec<Statement>,
    /// Total time of all solves, s.
    solve_seconds: f64,
    /// Total time of all studies, s.
    wall_seconds: f64,
    /// Reasons of failed certificates of best gaits.
    failures: Vec<String>,
    /// Name of the reference gait, and the meaning of its band.
    reference: Option<(&'a str, &'static str)>,
    pair_comparisons: Vec<PairComparison>,
    outcomes: &'a [ReproducedStudy],
    pairs: Vec<SubjectFigures>,
}

/// The results of a subject and seed.
struct SubjectFigures {
    title: String,
    /// Figures 3b and 3c of the paper.
    progress_and_angles: Vec<ReportChart>,
    /// Figure 4: variant and tiles.
    tiles: Vec<(&'static str, String)>,
    /// Figure 5.
    limit_cycles: Vec<ReportChart>,
}

struct ReportChart {
    title: String,
    svg: String,
    legend: Vec<(String, String)>,
}

/// The report of all studies.
///
/// # Errors
/// When the template cannot be rendered.
pub(super) fn html(outcomes: &[ReproducedStudy], trials: u32) -> Result<String, Error> {
    let pair_comparisons = pair_comparisons(outcomes);
    let pairs = pair_comparisons.iter().map(|comparison| pair(comparison, outcomes)).collect::<Result<_, Error>>()?;
    let report = ReproduceReport {
        style: STYLE_SHEET,
        version: env!("CARGO_PKG_VERSION"),
        trials,
        conclusion: conclusion(&pair_comparisons),
        statements: statements(outcomes, &pair_comparisons),
        solve_seconds: outcomes.iter().map(|outcome| outcome.solve_seconds).sum(),
        wall_seconds: outcomes.iter().map(|outcome| outcome.wall_seconds).sum(),
        failures: outcomes.iter().filter_map(ReproducedStudy::failure_in_words).collect(),
        reference: outcomes.first().map(|o| (o.reference.name.as_str(), band_in_words(&o.reference))),
        pair_comparisons,
        outcomes,
        pairs,
    };
    report.render().map_err(|e| Error::Internal(e.to_string()))
}

fn pair(comparison: &PairComparison, outcomes: &[ReproducedStudy]) -> Result<SubjectFigures, Error> {
    let pair: Vec<&ReproducedStudy> =
        outcomes.iter().filter(|o| (o.subject, o.seed) == (comparison.subject, comparison.seed)).collect();
    let gaits: Vec<(&'static str, &Gait)> =
        pair.iter().filter_map(|outcome| Some((label(outcome), outcome.gait.as_ref()?))).collect();
    let mut progress_and_angles = vec![drawn(&rmse_chart(&pair))];
    if let Some(first) = pair.first() {
        progress_and_angles.extend(gait_charts::with_reference(&gaits, &first.reference).iter().map(drawn));
    }
    let mut tiles = Vec::with_capacity(gaits.len());
    for (name, gait) in &gaits {
        tiles.push((*name, stride_pictures(&stick_figures(gait)?)));
    }
    Ok(SubjectFigures {
        title: format!("Subject {}, seed {}", comparison.subject, comparison.seed),
        progress_and_angles,
        tiles,
        limit_cycles: gait_charts::limit_cycles(&gaits).iter().map(drawn).collect(),
    })
}

fn drawn(chart: &Chart) -> ReportChart {
    ReportChart { title: chart.title.clone(), svg: chart.svg(), legend: chart.legend() }
}

fn label(outcome: &ReproducedStudy) -> &'static str {
    if outcome.muscles { "with muscles" } else { "without muscles" }
}

/// Colour and stroke of the variant; without muscles comes first.
fn look(outcome: &ReproducedStudy) -> (usize, Stroke) {
    if outcome.muscles { (1, Stroke::DashedSteps) } else { (0, Stroke::Steps) }
}

/// Figure 3b of the paper.
fn rmse_chart(pair: &[&ReproducedStudy]) -> Chart {
    let mut chart = Chart::new("Gait RMSE of the best action", "iteration", "Gait RMSE, rad");
    chart.whole_x = true;
    for outcome in pair {
        let (colour, stroke) = look(outcome);
        let values = outcome.by_iteration.iter().enumerate();
        let points = values.map(|(i, rmse)| ((i + 1) as f64, rmse.unwrap_or(f64::NAN))).collect();
        chart = chart.with(label(outcome), colour, stroke, points);
    }
    chart
}
