//! A benchmark problem from a table of results, such as that of `gaitwright atlas`: a row for each action of a grid, whose
//! first columns are the values of the action. Each seed is a person, who prefers low values of some columns: the utility
//! is a mixture of the columns with random weights.
//!
//! Two such tables are part of the project; `atlases/README.md` says how they are made.

use crate::problems::{GaitOfAction, Problem, SplitMix64};
use gait_learner::{Dimension, SearchSpace};
use std::path::Path;
use std::rc::Rc;

/// Name and content of each built-in table: the atlas of subject 1, without and with muscles.
const BUILT_IN: [(&str, &[u8]); 2] =
    [("atlas1", include_bytes!("atlases/atlas1.csv.zst")), ("atlas1m", include_bytes!("atlases/atlas1m.csv.zst"))];

/// Columns of a built-in table that people care about, if none are named.
pub const DEFAULT_COLUMNS: &str = "gait_rmse_other_rad,peak_hip_torque_nm_kg,step_time_asymmetry,cost_of_transport";

/// Number of leading columns that are the values of an action.
const DIMENSIONS: usize = 8;

/// The table, with the columns that people care about.
pub struct Table {
    space: SearchSpace,
    /// For each action, the chosen columns, scaled from 0 (worst) to 1 (best); `None` if it did not converge.
    merits: Vec<Option<Vec<f64>>>,
    /// The gait of each action, if the table numbers them.
    gaits: Option<Rc<Vec<GaitOfAction>>>,
}

impl Table {
    /// The built-in table of this name; `None` if there is none.
    pub fn built_in(name: &str, columns: &str) -> Option<Result<Self, String>> {
        let (_, packed) = BUILT_IN.iter().find(|(known, _)| *known == name)?;
        let unpacked = zstd::decode_all(*packed).map_err(|error| error.to_string());
        let text = unpacked.and_then(|bytes| String::from_utf8(bytes).map_err(|error| error.to_string()));
        Some(text.and_then(|text| Self::parse(&text, columns)))
    }

    /// Reads the file. `columns` are the names of the columns of which low values are better, separated by commas.
    pub fn read(path: &Path, columns: &str) -> Result<Self, String> {
        let text = std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
        Self::parse(&text, columns)
    }

    fn parse(text: &str, columns: &str) -> Result<Self, String> {
        let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let header = lines.next().ok_or("the table is empty")?;
        let place = |name: &str| header.iter().position(|h| *h == name).ok_or(format!("there is no column {name}"));
        let chosen: Vec<usize> = columns.split(',').map(place).collect::<Result<_, _>>()?;
        let status = place("status")?;
        let rows: Vec<Vec<&str>> = lines.collect();
        let number = |text: &str| text.parse::<f64>().map_err(|_| format!("{text:?} is not a number"));

        let mut values: Vec<Vec<f64>> = vec![Vec::new(); DIMENSIONS];
        let mut actions = Vec::with_capacity(rows.len());
        let mut raw = Vec::with_capacity(rows.len());
        for row in &rows {
            let cell = |place: usize| row.get(place).copied().ok_or("a row is too short");
            let action = (0..DIMENSIONS).map(|d| number(cell(d)?)).collect::<Result<Vec<f64>, String>>()?;
            for (values, value) in values.iter_mut().zip(&action) {
                if let Err(at) = values.binary_search_by(|other| other.total_cmp(value)) {
                    values.insert(at, *value);
                }
            }
            actions.push(action);
            raw.push(match cell(status)? {
                "converged" => Some(chosen.iter().map(|c| number(cell(*c)?)).collect::<Result<Vec<f64>, String>>()?),
                _ => None,
            });
        }
        // Distances between actions are numbers of levels, as in Table I.
        let dimensions = header[..DIMENSIONS].iter().zip(&values).map(|(name, values)| Dimension {
            name: (*name).to_owned(),
            values: (0..values.len()).map(|level| level as f64).collect(),
            lengthscale: 1.0,
        });
        let space = SearchSpace::new(dimensions.collect()).map_err(|error| error.to_string())?;
        if space.len() != rows.len() as u64 {
            return Err(format!("the table has {} rows; its grid has {} actions", rows.len(), space.len()));
        }
        let mut merits = vec![None; rows.len()];
        let numbered = place("gait").ok().zip(place("active").ok());
        let mut gaits = vec![GaitOfAction::default(); rows.len()];
        let ranges: Vec<(f64, f64)> =
            (0..chosen.len()).map(|c| range(raw.iter().flatten().map(|row| row[c]))).collect();
        for ((action, row), cells) in actions.iter().zip(raw).zip(&rows) {
            let levels: Vec<usize> = action
                .iter()
                .zip(&values)
                .map(|(value, values)| values.partition_point(|other| other < value))
                .collect();
            let index = space.index_of_levels(&levels).map_err(|error| error.to_string())?;
            let scaled = |row: Vec<f64>| {
                row.iter().zip(&ranges).map(|(value, (low, high))| (high - value) / (high - low).max(1e-12)).collect()
            };
            let index = usize::try_from(index.0).map_err(|error| error.to_string())?;
            if let Some((number, active)) = numbered {
                let cell = |place: usize| cells.get(place).copied().unwrap_or_default();
                let is_active = |name: &&str| cell(active).split(' ').any(|active| active == *name);
                gaits[index] = GaitOfAction {
                    number: cell(number).parse().unwrap_or(0),
                    active: header[..DIMENSIONS].iter().map(is_active).collect(),
                };
            }
            merits[index] = row.map(scaled);
        }
        Ok(Self { space, merits, gaits: numbered.map(|_| Rc::new(gaits)) })
    }

    /// The problem of one person.
    pub fn person(&self, seed: u64) -> Problem {
        let mut random = SplitMix64(seed.wrapping_mul(1_000_003).wrapping_add(29));
        let columns = self.merits.iter().flatten().next().map_or(0, Vec::len);
        // Uniform on the simplex of weights.
        let weights: Vec<f64> = (0..columns).map(|_| -(1.0 - random.unit()).ln()).collect();
        let mixed: Vec<Option<f64>> = self
            .merits
            .iter()
            .map(|merits| Some(merits.as_ref()?.iter().zip(&weights).map(|(merit, weight)| merit * weight).sum()))
            .collect();
        let (low, high) = range(mixed.iter().flatten().copied());
        let utility = mixed.iter().map(|mixed| mixed.map_or(0.0, |mixed| (mixed - low) / (high - low).max(1e-12)));
        Problem {
            space: self.space.clone(),
            utility: utility.collect(),
            converged: mixed.iter().map(Option::is_some).collect(),
            gaits: self.gaits.clone(),
        }
    }
}

fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
}
