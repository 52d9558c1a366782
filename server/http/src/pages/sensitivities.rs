//! Sensitivities on the page of a gait.

use crate::bound_units::{self, ANGLES};
use crate::format;
use gait_optimizer::number_format::with_unit;
use gait_optimizer::sensitivity::BoundSensitivity;
use gaitwright_compute::OnPool;
use gaitwright_service::error::Error;
use gaitwright_service::studies::sensitivities::{BoundStep, PackedSolution, StudySensitivities};

/// The section.
pub(super) struct SensitivityTable {
    /// One sentence for each bound that matters, and one for the others.
    pub(super) sentences: Vec<String>,
    pub(super) rows: Vec<SensitivityRow>,
}

/// A bound that the study tunes.
pub(super) struct SensitivityRow {
    pub(super) bound: &'static str,
    /// One step in the search space.
    pub(super) step: String,
    /// Change of cost of transport, %.
    pub(super) cost: String,
    /// Change in Gait RMSE, rad.
    pub(super) rmse: String,
    /// Whether other constraints become active before the end of the step.
    pub(super) beyond: bool,
    pub(super) interval: String,
    /// Domains with active constraints, each with their number.
    pub(super) active: String,
}

impl SensitivityTable {
    /// The reason in words if there are none.
    pub(super) fn new(solution: Result<PackedSolution, Error>, pool: &OnPool) -> Result<Self, String> {
        let computed = solution.and_then(|solution| solution.sensitivities(pool));
        let StudySensitivities { found, steps } = computed.map_err(|error| error.to_string())?;
        let rows = found.bounds.iter().zip(&steps);
        let rows =
            rows.filter_map(|(bound, step)| Some(SensitivityRow::new(bound, step.as_ref()?, found.cost_of_transport)));
        Ok(Self { sentences: found.sentences(ANGLES), rows: rows.collect() })
    }
}

impl SensitivityRow {
    fn new(bound: &BoundSensitivity, step: &BoundStep, cost_of_transport: f64) -> Self {
        let number = |value: f64| format::number(bound_units::shown(bound.bound, value));
        let is_active = !bound.active.is_empty();
        let changes = |text: String| if is_active { text } else { "no change".to_owned() };
        Self {
            bound: bound.bound,
            step: with_unit(
                format_args!("{} to {}", number(bound.value), number(step.to)),
                bound_units::unit(bound.bound),
            ),
            cost: changes(change(100.0 * step.cost_of_transport / cost_of_transport)),
            rmse: changes(change(step.gait_rmse_rad)),
            beyond: !step.keeps_active,
            interval: bound.interval_in_words(number),
            active: domains(bound),
        }
    }
}

/// Three digits with a sign: `+0.0123`, `−0.4`, `0`.
fn change(value: f64) -> String {
    let sign = if value > 0.0 { "+" } else { "" };
    format!("{sign}{}", format::number(value))
}

/// `SS1_R (12), DS3_L (2)`, in the order of multipliers; a dash if nothing is active.
fn domains(bound: &BoundSensitivity) -> String {
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for place in bound.active.iter().map(|active| active.place.as_str()) {
        let point = place.split(", ").next().unwrap_or(place);
        let domain = point.split(" node ").next().unwrap_or(point);
        match counts.iter_mut().find(|(known, _)| *known == domain) {
            Some((_, count)) => *count += 1,
            None => counts.push((domain, 1)),
        }
    }
    if counts.is_empty() {
        return "–".to_owned();
    }
    counts.iter().map(|(domain, count)| format!("{domain} ({count})")).collect::<Vec<_>>().join(", ")
}
