//! The problems.

use std::error::Error;
use std::time::Duration;

use gait_optimizer::{
    CancelToken, GaitProblem, InitialGuess, NlpSettings, SolveOptions, SolveOutcome, SolveStatus, StartedFrom, Subject,
    TunedBounds, WarmStart, solve, solve_from_guesses,
};
use interior_point::{NlpStatus, StartPoint};
use rustix::time::{ClockId, clock_gettime};

use crate::splitmix::SplitMix;
use crate::standard_problems::sets::{self, Case};
use crate::tuned_actions::{LEVELS, TIGHT};

/// Settings that a variant changes.
pub(crate) struct Target {
    pub settings: NlpSettings,
    /// The initial guess of gaits.
    pub guess: InitialGuess,
    pub is_gait: bool,
}

/// A solve.
#[derive(Clone, Copy, Default)]
pub(crate) struct Measured {
    pub solved: bool,
    pub iterations: usize,
    pub factorisations: usize,
    pub objective: f64,
    pub seconds: f64,
}

impl Measured {
    /// Whether both took the same path, to the last bit.
    pub(crate) fn is_same_path(&self, other: &Self) -> bool {
        (self.solved, self.iterations, self.factorisations, self.objective.to_bits())
            == (other.solved, other.iterations, other.factorisations, other.objective.to_bits())
    }
}

/// A problem of a set.
pub(crate) struct Instance {
    pub set: &'static str,
    problem: Problem,
}

enum Problem {
    Standard(Case),
    Cold(Box<GaitProblem>),
    Warm(Box<GaitProblem>, Box<WarmStart>),
}

const MAX_ITERATIONS: usize = 500;

/// `cold` and `tight` random actions from one initial guess, `warm` random changes of two bounds.
pub(crate) fn all(
    cold: usize,
    tight: usize,
    warm: usize,
    muscles: bool,
    seed: u64,
) -> Result<Vec<Instance>, Box<dyn Error>> {
    let mut instances = Vec::new();
    for (set, cases) in sets::all() {
        instances.extend(cases.into_iter().map(|case| Instance { set, problem: Problem::Standard(case) }));
    }
    let base = GaitProblem::new(Subject::builtin(1)?, muscles)?;
    let mut random = SplitMix(seed);
    let mut drawn = Vec::new();
    let mut draw = |changed: &mut dyn FnMut(&mut SplitMix) -> [f64; TunedBounds::COUNT]| loop {
        let action = changed(&mut random);
        if !drawn.contains(&action) {
            drawn.push(action);
            return TunedBounds::from_array(action).map(|bounds| Box::new(GaitProblem { bounds, ..base.clone() }));
        }
    };
    for (set, count, values) in [("gaits, cold", cold, &LEVELS), ("gaits, tight", tight, &TIGHT)] {
        for _ in 0..count {
            let problem = draw(&mut |random| values.map(|levels| levels[random.below(levels.len())]))?;
            instances.push(Instance { set, problem: Problem::Cold(problem) });
        }
    }
    let start = solve(&base, None, &options(), &mut |_| {}, &CancelToken::new())?.warm_start;
    for _ in 0..warm {
        let problem = draw(&mut |random| {
            let mut action = base.bounds.to_array();
            for _ in 0..2 {
                let bound = random.below(TunedBounds::COUNT);
                action[bound] = LEVELS[bound][random.below(LEVELS[bound].len())];
            }
            action
        })?;
        instances.push(Instance { set: "gaits, warm", problem: Problem::Warm(problem, Box::new(start.clone())) });
    }
    Ok(instances)
}

fn options() -> SolveOptions {
    SolveOptions { initial_guesses: 1, retry: false, max_iterations: MAX_ITERATIONS, ..SolveOptions::default() }
}

/// Processor time of this thread so far.
fn used() -> Duration {
    Duration::try_from(clock_gettime(ClockId::ThreadCPUTime)).unwrap_or_default()
}

impl Instance {
    /// Solves with changed settings. `None` if the problem is solved with fixed values of the changed settings.
    pub(crate) fn solve(&self, change: &dyn Fn(&mut Target)) -> Option<Measured> {
        let is_gait = !matches!(self.problem, Problem::Standard(_));
        let settings = if is_gait {
            options().solver
        } else {
            NlpSettings { max_iterations: MAX_ITERATIONS, ..NlpSettings::default() }
        };
        let mut target = Target { settings, guess: InitialGuess::NATURAL, is_gait };
        change(&mut target);
        let before = used();
        let measured = match &self.problem {
            Problem::Standard(case) => standard(case, &target.settings),
            Problem::Cold(problem) => {
                let options = gait_options(&target)?;
                let outcome =
                    solve_from_guesses(problem, &[target.guess], &options, &mut |_| {}, &CancelToken::new()).ok()?;
                gait(&outcome, StartedFrom::Cold)
            }
            Problem::Warm(problem, start) => {
                let options = gait_options(&target)?;
                let outcome = solve(problem, Some(start), &options, &mut |_| {}, &CancelToken::new()).ok()?;
                gait(&outcome, StartedFrom::Warm)
            }
        };
        Some(Measured { seconds: used().saturating_sub(before).as_secs_f64(), ..measured })
    }
}

/// `None` if the phases of a gait decide a changed setting.
fn gait_options(target: &Target) -> Option<SolveOptions> {
    let options = SolveOptions { solver: target.settings, ..options() };
    options.validate().is_ok().then_some(options)
}

fn standard(case: &Case, settings: &NlpSettings) -> Measured {
    let start = StartPoint::Cold(case.start.clone());
    match interior_point::solve(case.program.as_ref(), &start, settings, &mut |_| {}, &|| false) {
        Ok(result) => Measured {
            solved: result.status == NlpStatus::Converged,
            iterations: result.iterations,
            factorisations: result.counts.factorisations,
            objective: result.objective,
            seconds: 0.0,
        },
        Err(_) => Measured { objective: f64::NAN, ..Measured::default() },
    }
}

fn gait(outcome: &SolveOutcome, from: StartedFrom) -> Measured {
    let report = &outcome.report;
    Measured {
        solved: report.status == SolveStatus::Converged && report.started_from == from,
        iterations: report.iterations,
        factorisations: report.linear_algebra.map_or(0, |linear_algebra| linear_algebra.factorisations),
        objective: report.objective,
        seconds: 0.0,
    }
}
