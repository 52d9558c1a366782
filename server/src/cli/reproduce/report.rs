//! The report: one HTML file that needs nothing beside it.

use super::comparison::{COORDINATES, Outcome, Verdict, conclusion, verdicts};
use super::statements::{Statement, statements};
use crate::error::Error;
use crate::plots::{Chart, Stroke, band_in_words, over_reference};
use askama::Template;

/// The style sheet of the pages: the charts' colours and dashes are its classes.
const STYLE: &str = include_str!("../../../../web/static/gaitwright.css");

#[derive(Template)]
#[template(path = "reproduce.html")]
struct Report<'a> {
    style: &'static str,
    version: &'static str,
    trials: u32,
    conclusion: String,
    statements: Vec<Statement>,
    /// Of all solves together, s.
    seconds: f64,
    /// Why certificates of best gaits failed.
    failures: Vec<String>,
    /// Name of the reference, and what is to be known of its band.
    reference: Option<(&'a str, &'static str)>,
    verdicts: Vec<Verdict>,
    outcomes: &'a [Outcome],
    charts: Vec<Drawn>,
}

struct Drawn {
    title: String,
    svg: String,
    legend: Vec<(String, String)>,
}

/// The report of all studies.
///
/// # Errors
/// When the template cannot be rendered.
pub(super) fn html(outcomes: &[Outcome], trials: u32) -> Result<String, Error> {
    let verdicts = verdicts(outcomes);
    let mut charts = Vec::new();
    for verdict in &verdicts {
        let pair: Vec<&Outcome> =
            outcomes.iter().filter(|o| (o.subject, o.seed) == (verdict.subject, verdict.seed)).collect();
        charts.push(drawn(&rmse_chart(verdict, &pair)));
        charts.extend((0..COORDINATES.len()).map(|coordinate| drawn(&angle_chart(verdict, &pair, coordinate))));
    }
    let report = Report {
        style: STYLE,
        version: env!("CARGO_PKG_VERSION"),
        trials,
        conclusion: conclusion(&verdicts),
        statements: statements(outcomes, &verdicts),
        seconds: outcomes.iter().map(|outcome| outcome.seconds).sum(),
        failures: outcomes.iter().filter_map(Outcome::failure_in_words).collect(),
        reference: outcomes.first().map(|o| (o.reference.name.as_str(), band_in_words(&o.reference))),
        verdicts,
        outcomes,
        charts,
    };
    report.render().map_err(|e| Error::Internal(e.to_string()))
}

fn drawn(chart: &Chart) -> Drawn {
    let legend = chart.legend().into_iter().map(|(class, label)| (class, label.to_owned())).collect();
    Drawn { title: chart.title.clone(), svg: chart.svg(), legend }
}

fn label(outcome: &Outcome) -> &'static str {
    if outcome.muscles { "with muscles" } else { "without muscles" }
}

/// Colour, stroke of what goes in steps, stroke of a curve.
fn look(outcome: &Outcome) -> (usize, Stroke, Stroke) {
    if outcome.muscles { (0, Stroke::Steps, Stroke::Solid) } else { (1, Stroke::DashedSteps, Stroke::Dashed) }
}

/// Figure 3b of the paper.
fn rmse_chart(verdict: &Verdict, pair: &[&Outcome]) -> Chart {
    let title = format!("Subject {}, seed {}: Gait RMSE of the best action", verdict.subject, verdict.seed);
    let mut chart = Chart::new(&title, "iteration", "Gait RMSE, rad");
    chart.whole_x = true;
    for outcome in pair {
        let (colour, stroke, _) = look(outcome);
        let values = outcome.by_iteration.iter().enumerate();
        let points = values.map(|(i, rmse)| ((i + 1) as f64, rmse.unwrap_or(f64::NAN))).collect();
        chart = chart.with(label(outcome), colour, stroke, points);
    }
    chart
}

/// The coordinates as people call them.
const NAMES: [&str; COORDINATES.len()] = ["torso lean", "left hip", "left knee", "left ankle", "right hip"];

/// Figure 3c of the paper, one coordinate.
fn angle_chart(verdict: &Verdict, pair: &[&Outcome], coordinate: usize) -> Chart {
    let name = NAMES[coordinate];
    let title = format!("Subject {}, seed {}: {name} of the best gaits", verdict.subject, verdict.seed);
    let mut chart = Chart::new(&title, "gait cycle from right heel strike, %", "angle, °");
    let points =
        |curve: &[[f64; 5]]| curve.iter().enumerate().map(|(i, a)| (i as f64, a[coordinate].to_degrees())).collect();
    if let Some(first) = pair.first() {
        chart = over_reference(chart, &first.reference, coordinate);
    }
    for outcome in pair {
        if let Some(curve) = &outcome.curve {
            let (colour, _, stroke) = look(outcome);
            chart = chart.with(label(outcome), colour, stroke, points(&curve.0));
        }
    }
    chart
}
