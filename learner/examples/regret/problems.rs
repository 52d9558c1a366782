//! Benchmark problems: finite grids with a known utility.
//!
//! `table1(seed)` is a synthetic model of tuning the constraint bounds of Table I of Li et al. 2022: 11,664 actions, of
//! which 35 % do not converge. It uses splitmix64 only, so that other languages can reproduce it. `hart3` and `hart6`
//! are the Hartmann functions on the grids of POLAR's examples.

use gait_learner::{ActionIndex, Dimension, LearnerError, SearchSpace};

/// A grid with the utility of every action in `[0, 1]`.
pub struct Problem {
    pub space: SearchSpace,
    /// Utility of each action; 0 if it does not converge.
    pub utility: Vec<f64>,
    pub converged: Vec<bool>,
    /// For problems from a table of gaits: the gait of each action, and the dimensions that are active in it.
    pub gaits: Option<std::rc::Rc<Vec<GaitOfAction>>>,
}

/// The gait of an action.
#[derive(Clone, Default)]
pub struct GaitOfAction {
    /// Its number; 0 without a gait.
    pub number: u32,
    /// Whether each dimension is active in it.
    pub active: Vec<bool>,
}

/// Knowledge of a study about gaits besides the answers.
#[derive(Clone, Copy, Default)]
pub struct Knowledge {
    /// Which actions have the gait of a visited action: they are not proposed.
    pub gaits: bool,
    /// Which dimensions were active in no gait so far: the learner ignores them.
    pub inactive: bool,
}

/// A dimension that was inactive in all gaits so far is ignored if there are at least this many.
const MIN_GAITS: usize = 2;
/// Factor on the lengthscale of a dimension that the learner ignores: its levels are fully correlated.
const IGNORED: f64 = 1e4;

impl Problem {
    /// The actions whose gait is that of a visited action, as boxes; `None` if the problem has no gaits.
    pub fn actions_with_gaits_of(&self, visited: &[ActionIndex]) -> Option<Vec<Vec<std::ops::Range<usize>>>> {
        let gaits = self.gaits.as_ref()?;
        let known: std::collections::HashSet<u32> = self.gaits_of(visited).map(|gait| gait.number).collect();
        let same = (0..).zip(gaits.iter()).filter(|(_, gait)| known.contains(&gait.number));
        let alone = |(action, _): (u64, &GaitOfAction)| {
            self.space.levels(ActionIndex(action)).into_iter().map(|level| level..level + 1).collect()
        };
        Some(same.map(alone).collect())
    }

    /// The search space of the learner after these actions.
    pub fn space_after(&self, visited: &[ActionIndex], knowledge: Knowledge) -> Result<SearchSpace, LearnerError> {
        let gaits: Vec<&GaitOfAction> = self.gaits_of(visited).collect();
        if !knowledge.inactive || gaits.len() < MIN_GAITS {
            return Ok(self.space.clone());
        }
        let mut dimensions = self.space.dimensions().to_vec();
        for (d, dimension) in dimensions.iter_mut().enumerate() {
            if gaits.iter().all(|gait| !gait.active[d]) {
                dimension.lengthscale *= IGNORED;
            }
        }
        SearchSpace::new(dimensions)
    }

    fn gaits_of(&self, visited: &[ActionIndex]) -> impl Iterator<Item = &GaitOfAction> {
        let gait = |action: &ActionIndex| self.gaits.as_ref()?.get(usize::try_from(action.0).ok()?);
        visited.iter().filter_map(gait).filter(|gait| gait.number > 0)
    }

    /// The problem with this name. `lengthscale`, in the unit of the values, replaces the default.
    pub fn named(name: &str, seed: u64, lengthscale: Option<f64>) -> Option<Self> {
        match name {
            "table1" => Some(table1(seed, lengthscale.unwrap_or(1.0))),
            "hart3" => Some(hartmann(21, &A3, &P3, lengthscale.unwrap_or(0.15))),
            "hart6" => Some(hartmann(6, &A6, &P6, lengthscale.unwrap_or(0.3))),
            _ => None,
        }
    }

    pub fn of(&self, action: ActionIndex) -> (f64, bool) {
        let index = usize::try_from(action.0).unwrap_or(usize::MAX);
        (self.utility[index], self.converged[index])
    }
}

/// splitmix64, the random generator of the definition.
pub struct SplitMix64(pub u64);

impl SplitMix64 {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 * (0.5_f64).powi(53)
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// `floor(u() * count)`.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    pub fn below(&mut self, count: usize) -> usize {
        (self.unit() * count as f64) as usize
    }
}

fn grid(shape: &[usize], value: impl Fn(usize, usize) -> f64, lengthscale: f64) -> SearchSpace {
    let dimensions = shape
        .iter()
        .enumerate()
        .map(|(d, &n)| Dimension {
            name: format!("a{}", d + 1),
            values: (0..n).map(|level| value(level, n)).collect(),
            lengthscale,
        })
        .collect();
    SearchSpace::new(dimensions).expect("the benchmark grids are valid")
}

const TABLE_SHAPE: [usize; 8] = [2, 3, 3, 3, 4, 6, 3, 3];

fn table1(seed: u64, lengthscale: f64) -> Problem {
    let space = grid(&TABLE_SHAPE, |level, _| level as f64, lengthscale);
    let n = usize::try_from(space.len()).expect("fits");
    let x: Vec<Vec<f64>> = (0..n as u64)
        .map(|i| {
            space.levels(ActionIndex(i)).iter().zip(TABLE_SHAPE).map(|(&l, n)| l as f64 / (n - 1) as f64).collect()
        })
        .collect();
    let mut r = SplitMix64(seed.wrapping_mul(1_000_003).wrapping_add(17));
    let peak: Vec<f64> = (0..8).map(|_| r.between(0.1, 0.9)).collect();
    let mut order: Vec<i32> = (0..8).collect();
    for i in (1..8).rev() {
        let j = r.below(i + 1);
        order.swap(i, j);
    }
    let mut f: Vec<f64> =
        x.iter().map(|x| -(0..8).map(|j| 0.7_f64.powi(order[j]) * (x[j] - peak[j]).powi(2)).sum::<f64>()).collect();
    for _ in 0..8 {
        let a = r.below(8);
        let mut b = r.below(7);
        if b >= a {
            b += 1;
        }
        let c = r.between(-0.5, 0.5);
        for (f, x) in f.iter_mut().zip(&x) {
            *f += c * (x[a] - 0.5) * (x[b] - 0.5);
        }
    }
    for _ in 0..4 {
        let height = r.between(0.1, 0.4);
        let centre: Vec<f64> = (0..8).map(|_| r.unit()).collect();
        for (f, x) in f.iter_mut().zip(&x) {
            let distance: f64 = x.iter().zip(&centre).map(|(x, z)| (x - z).powi(2)).sum();
            *f += height * (-0.5 * distance / 0.25).exp();
        }
    }
    let mut field = vec![0.0; n];
    let mut total = 0.0;
    for j in 0..8 {
        let v = r.between(0.2, 1.0);
        let rising = r.unit() < 0.5;
        for (g, x) in field.iter_mut().zip(&x) {
            *g += v * if rising { x[j] } else { 1.0 - x[j] };
        }
        total += v;
    }
    let wave: Vec<f64> = (0..8).map(|_| r.between(-0.5, 0.5)).collect();
    let phase = r.unit();
    for (g, x) in field.iter_mut().zip(&x) {
        let along: f64 = x.iter().zip(&wave).map(|(x, q)| x * q).sum();
        *g = *g / total + 0.15 * (2.0 * std::f64::consts::PI * (along + phase)).sin();
    }
    let mut sorted = field.clone();
    sorted.sort_by(f64::total_cmp);
    let limit = sorted[n * 65 / 100 - 1];
    let converged: Vec<bool> = field.iter().map(|&g| g <= limit).collect();
    let among = |pick: fn(f64, f64) -> f64, start: f64| {
        f.iter().zip(&converged).filter(|(_, c)| **c).fold(start, |m, (f, _)| pick(m, *f))
    };
    let (low, high) = (among(f64::min, f64::INFINITY), among(f64::max, f64::NEG_INFINITY));
    let utility = f.iter().zip(&converged).map(|(f, &c)| if c { (f - low) / (high - low) } else { 0.0 }).collect();
    Problem { space, utility, converged, gaits: None }
}

const ALPHA: [f64; 4] = [1.0, 1.2, 3.0, 3.2];
const A3: [[f64; 3]; 4] = [[3.0, 10.0, 30.0], [0.1, 10.0, 35.0], [3.0, 10.0, 30.0], [0.1, 10.0, 35.0]];
const P3: [[f64; 3]; 4] =
    [[3689.0, 1170.0, 2673.0], [4699.0, 4387.0, 7470.0], [1090.0, 8732.0, 5547.0], [381.0, 5743.0, 8828.0]];
const A6: [[f64; 6]; 4] = [
    [10.0, 3.0, 17.0, 3.5, 1.7, 8.0],
    [0.05, 10.0, 17.0, 0.1, 8.0, 14.0],
    [3.0, 3.5, 1.7, 10.0, 17.0, 8.0],
    [17.0, 8.0, 0.05, 10.0, 0.1, 14.0],
];
const P6: [[f64; 6]; 4] = [
    [1312.0, 1696.0, 5569.0, 124.0, 8283.0, 5886.0],
    [2329.0, 4135.0, 8307.0, 3736.0, 1004.0, 9991.0],
    [2348.0, 1451.0, 3522.0, 2883.0, 3047.0, 6650.0],
    [4047.0, 8828.0, 8732.0, 5743.0, 1091.0, 381.0],
];

/// The raw Hartmann function (to be maximised) at a point of the unit cube.
pub fn hartmann_at<const D: usize>(x: &[f64], a: &[[f64; D]; 4], p: &[[f64; D]; 4]) -> f64 {
    (0..4)
        .map(|i| {
            let distance: f64 = (0..D).map(|j| a[i][j] * (x[j] - 1e-4 * p[i][j]).powi(2)).sum();
            ALPHA[i] * (-distance).exp()
        })
        .sum()
}

fn hartmann<const D: usize>(n: usize, a: &[[f64; D]; 4], p: &[[f64; D]; 4], lengthscale: f64) -> Problem {
    let space = grid(&[n; D], |level, n| level as f64 / (n - 1) as f64, lengthscale);
    let raw: Vec<f64> = (0..space.len()).map(|i| hartmann_at(&space.values(ActionIndex(i)), a, p)).collect();
    let (low, high) = raw.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &v| (l.min(v), h.max(v)));
    let utility = raw.iter().map(|v| (v - low) / (high - low)).collect();
    let converged = vec![true; raw.len()];
    Problem { space, utility, converged, gaits: None }
}

/// The maximum of the raw Hartmann function in 3 or 6 dimensions over the grid, and its position.
#[allow(dead_code)]
pub fn hartmann_maximum(dimensions: usize) -> (f64, Vec<f64>) {
    let problem = if dimensions == 3 { hartmann(21, &A3, &P3, 0.1) } else { hartmann(6, &A6, &P6, 0.1) };
    let best = (0..problem.space.len())
        .max_by(|&i, &j| problem.of(ActionIndex(i)).0.total_cmp(&problem.of(ActionIndex(j)).0))
        .unwrap_or(0);
    let at = problem.space.values(ActionIndex(best));
    let raw = if dimensions == 3 { hartmann_at(&at, &A3, &P3) } else { hartmann_at(&at, &A6, &P6) };
    (raw, at)
}
