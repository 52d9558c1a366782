//! Simulated walks on the page of a gait, and the fields of the form that requests them.

use crate::format;
use crate::refused_fields::{FieldLabels, TypedForm};
use gait_optimizer::execution::{ExecutionReport, SimulatedWalksOnGround};
use gaitwright_service::error::Error;
use gaitwright_service::studies::execution::{MAX_SIMULATED_WALKS, NewExecutionReport, Simulation};
use gaitwright_service::studies::seed::MAX_SEED;
use gaitwright_store::Instant;
use gaitwright_store::execution_reports::{ExecutionReported, StoredReport};
use serde::Deserialize;

/// The section: the newest report, and the state of a requested one.
pub(super) struct SimulatedWalksSection {
    pub(super) state: Simulation,
    pub(super) shown: Option<ShownReport>,
    /// The form as typed, or what it suggests.
    pub(super) fields: SimulationFields,
}

/// An execution report in words.
pub(super) struct ShownReport {
    pub(super) sentence: String,
    pub(super) grounds: Vec<GroundRow>,
    /// Label and value.
    pub(super) values: Vec<(&'static str, String)>,
    pub(super) program: String,
    pub(super) created_at: Instant,
}

/// Walks on one ground.
pub(super) struct GroundRow {
    pub(super) ground: String,
    pub(super) complete: String,
    pub(super) share: String,
    pub(super) strides: String,
    pub(super) ended: String,
    pub(super) knee: String,
    pub(super) ankle: String,
}

impl SimulatedWalksSection {
    pub(super) fn new(state: Simulation, kept: Option<StoredReport>, typed: Option<SimulationFields>) -> Self {
        let fields = typed.unwrap_or_else(|| NewExecutionReport::default().into());
        Self { state, shown: kept.map(ShownReport::new), fields }
    }

    /// Whether a report is queued or running.
    pub(super) fn is_pending(&self) -> bool {
        self.state.open().is_some()
    }

    pub(super) fn most_walks() -> u32 {
        MAX_SIMULATED_WALKS
    }

    pub(super) fn largest_seed() -> u64 {
        MAX_SEED
    }
}

impl ShownReport {
    fn new(kept: StoredReport) -> Self {
        let StoredReport {
            reported: ExecutionReported { number_of_simulated_walks, seed, program, report, .. },
            created_at,
        } = kept;
        let of_strides = |strides: u32| format!("{strides} of {}", report.strides);
        let by_yield = report.strides_by_yield.iter();
        let by_yield: Vec<String> = by_yield
            .map(|walk| format!("{} on ground that yields {} mm", walk.strides, format::number(1e3 * walk.yield_m)))
            .collect();
        let [lightest, heaviest] = report.body_mass_kg;
        let values = vec![
            ("Strides without any disturbance", of_strides(report.undisturbed_strides)),
            ("Strides on harder and softer ground, otherwise undisturbed", by_yield.join(", ")),
            ("Largest push at the hip that the walker survives without other disturbances", pushes(&report)),
            (
                "Disturbed simulated walks",
                format!(
                    "{number_of_simulated_walks} on each kind of ground, seed {seed}, body mass {lightest:.1} to {heaviest:.1} kg"
                ),
            ),
            ("Gait (SHA-256)", report.gait_sha256.clone()),
        ];
        let grounds = report.grounds.iter().map(GroundRow::new).collect();
        Self { sentence: report.sentence(), grounds, values, program, created_at }
    }
}

fn pushes(report: &ExecutionReport) -> String {
    let Some(pushes) = report.pushes else {
        return "not tried, because the walk without any disturbance is not complete".to_owned();
    };
    let number = format::number;
    format!(
        "{} N s forwards, {} N s backwards (largest push tried: {} N s)",
        number(pushes.forwards_n_s),
        number(pushes.backwards_n_s),
        number(pushes.largest_tried_n_s)
    )
}

impl GroundRow {
    fn new(on: &SimulatedWalksOnGround) -> Self {
        let percent = |share: f64| format!("{:.0}", 100.0 * share);
        let [low, high] = on.completed_share_interval;
        Self {
            ground: on.ground_in_words(),
            complete: format!("{} of {}", on.completed, on.number_of_simulated_walks),
            share: format!("{} ({} to {})", percent(on.completed_share), percent(low), percent(high)),
            strides: format!("{:.1}", on.mean_strides),
            ended: format!("{}, {}", on.fell, on.halted),
            knee: percent(on.knee_saturated_share),
            ankle: percent(on.ankle_saturated_share),
        }
    }
}

/// The fields of the form.
#[derive(Debug, Clone, Deserialize)]
pub(super) struct SimulationFields {
    #[serde(default)]
    pub(super) number_of_simulated_walks: String,
    #[serde(default)]
    pub(super) seed: String,
}

impl SimulationFields {
    pub(super) fn request(&self) -> Result<NewExecutionReport, Error> {
        let walks = self.number_of_simulated_walks.trim().parse();
        let seed = self.seed.trim().parse();
        let asked = NewExecutionReport {
            number_of_simulated_walks: walks.map_err(|_| {
                Error::invalid(
                    "number_of_simulated_walks",
                    self.number_of_simulated_walks.as_str(),
                    &format!("1 to {MAX_SIMULATED_WALKS}"),
                )
            })?,
            seed: seed.map_err(|_| Error::invalid("seed", self.seed.as_str(), &format!("0 to {MAX_SEED}")))?,
        };
        asked.options()?;
        Ok(asked)
    }
}

impl From<NewExecutionReport> for SimulationFields {
    fn from(suggested: NewExecutionReport) -> Self {
        let NewExecutionReport { number_of_simulated_walks, seed } = suggested;
        Self { number_of_simulated_walks: number_of_simulated_walks.to_string(), seed: seed.to_string() }
    }
}

impl TypedForm for SimulationFields {
    const LABELS: FieldLabels =
        &[("number_of_simulated_walks", "Number of simulated walks on each kind of ground"), ("seed", "Seed")];

    fn repair(&mut self, field: &str) -> bool {
        let suggested = Self::from(NewExecutionReport::default());
        match field {
            "number_of_simulated_walks" => self.number_of_simulated_walks = suggested.number_of_simulated_walks,
            "seed" => self.seed = suggested.seed,
            _ => return false,
        }
        true
    }
}
