//! A benchmark problem from a table of results, such as that of `gaitwright atlas`: a row for each action of a grid, whose
//! first columns are the values of the action. Each seed is a person, see [`People`].
//!
//! Two such tables are part of the project; `atlases/README.md` says how they are made.

use crate::joint_angles::JointAngles;
use crate::problems::{GaitOfAction, Problem, SplitMix64};
use gait_learner::{Dimension, SearchSpace};
use std::path::Path;
use std::rc::Rc;

/// A built-in table.
struct BuiltIn {
    name: &'static str,
    table: &'static [u8],
    joint_angles: Option<&'static [u8]>,
}

/// The atlas of subject 1, without and with muscles.
const BUILT_IN: [BuiltIn; 2] = [
    BuiltIn {
        name: "atlas1",
        table: include_bytes!("atlases/atlas1.csv.zst"),
        joint_angles: Some(include_bytes!("atlases/atlas1.angles.csv.zst")),
    },
    BuiltIn { name: "atlas1m", table: include_bytes!("atlases/atlas1m.csv.zst"), joint_angles: None },
];

/// Columns of a built-in table that people care about, if none are named.
pub const DEFAULT_COLUMNS: &str = "gait_rmse_other_rad,peak_hip_torque_nm_kg,step_time_asymmetry,cost_of_transport";

/// Number of leading columns that are the values of an action.
const DIMENSIONS: usize = 8;

/// Preferences of simulated people.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
pub enum People {
    /// Low values of the columns: the utility is a mixture with random weights.
    #[default]
    LowResults,
    /// Columns near those of an ideal, a blend of two random gaits, with random weights.
    IdealResults,
    /// Joint angles near those of an ideal, a blend of two random gaits.
    IdealMotion,
}

impl People {
    /// The people of this name.
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "low_results" => Some(Self::LowResults),
            "ideal_results" => Some(Self::IdealResults),
            "ideal_motion" => Some(Self::IdealMotion),
            _ => None,
        }
    }
}

/// The table, with the columns that people care about.
pub struct Table {
    space: SearchSpace,
    /// For each action, the chosen columns, scaled from 0 (worst) to 1 (best); `None` if it did not converge.
    merits: Vec<Option<Vec<f64>>>,
    /// The gait of each action, if the table numbers them.
    gaits: Option<Rc<Vec<GaitOfAction>>>,
    joint_angles: Option<JointAngles>,
}

impl Table {
    /// The built-in table of this name; `None` if there is none.
    pub fn built_in(name: &str, columns: &str) -> Option<Result<Self, String>> {
        let built_in = BUILT_IN.iter().find(|built_in| built_in.name == name)?;
        let unpacked = |packed: &[u8]| {
            let bytes = zstd::decode_all(packed).map_err(|error| error.to_string())?;
            String::from_utf8(bytes).map_err(|error| error.to_string())
        };
        Some((|| {
            let joint_angles =
                built_in.joint_angles.map(|packed| JointAngles::parse(&unpacked(packed)?)).transpose()?;
            Ok(Self { joint_angles, ..Self::parse(&unpacked(built_in.table)?, columns)? })
        })())
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
        Ok(Self { space, merits, gaits: numbered.map(|_| Rc::new(gaits)), joint_angles: None })
    }

    /// The same table, for a learner to which actions are as alike as the joint angles of their gaits.
    pub fn described_by_joint_angles(self, lengthscale: f64) -> Result<Self, String> {
        let known = self.joint_angles.as_ref().zip(self.gaits.as_ref());
        let (angles, gaits) = known.ok_or("the table has no joint angles")?;
        let described = self.space.described_by(angles.descriptors(gaits, lengthscale)?);
        Ok(Self { space: described.map_err(|error| error.to_string())?, ..self })
    }

    /// The problem of one person.
    pub fn person(&self, people: People, seed: u64) -> Problem {
        let mut random = SplitMix64(seed.wrapping_mul(1_000_003).wrapping_add(29));
        let columns = self.merits.iter().flatten().next().map_or(0, Vec::len);
        // Uniform on the simplex of weights.
        let weights: Vec<f64> = (0..columns).map(|_| -(1.0 - random.unit()).ln()).collect();
        let mixed: Vec<Option<f64>> = match people {
            People::LowResults => self
                .merits
                .iter()
                .map(|merits| Some(merits.as_ref()?.iter().zip(&weights).map(|(merit, weight)| merit * weight).sum()))
                .collect(),
            People::IdealResults => nearness_to_ideal(&self.merits, &weights, &mut random),
            People::IdealMotion => {
                let angles = |gait: &GaitOfAction| Some(self.joint_angles.as_ref()?.of(gait)?.to_vec());
                let angles: Vec<Option<Vec<f64>>> =
                    self.gaits.iter().flat_map(|gaits| gaits.iter().map(angles)).collect();
                let count = angles.iter().flatten().next().map_or(0, Vec::len);
                nearness_to_ideal(&angles, &vec![1.0; count], &mut random)
            }
        };
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

/// Negative distance of each action's point from a blend of the points of two random actions.
fn nearness_to_ideal(points: &[Option<Vec<f64>>], weights: &[f64], random: &mut SplitMix64) -> Vec<Option<f64>> {
    let known: Vec<&Vec<f64>> = points.iter().flatten().collect();
    let [one, other] = [random.below(known.len()), random.below(known.len())].map(|place| known[place]);
    let share = random.unit();
    let ideal: Vec<f64> = one.iter().zip(other).map(|(a, b)| share * a + (1.0 - share) * b).collect();
    let nearness = |point: &Vec<f64>| {
        let squares = point.iter().zip(&ideal).zip(weights).map(|((x, ideal), weight)| weight * (x - ideal).powi(2));
        -squares.sum::<f64>().sqrt()
    };
    points.iter().map(|point| point.as_ref().map(nearness)).collect()
}

fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
}
