//! Infeasibility explanations without solves, and trials to explain.

use gait_learner::SearchSpace;
use gait_optimizer::explanation::{BoundAtLimit, BoundValue, Conflict, Explanation, Relaxation};
use gait_optimizer::{CancelToken, SolveError, SolveStatus, TunedBounds, Violation};
use gaitwright_service::workers::{Explain, SolveToExplain};
use serde_json::json;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// Place of a5, the swing-foot clearance, among the bounds: what the analytic solver finds too high.
const CLEARANCE: usize = 4;
/// Place of a6, the torso lean.
const TORSO: usize = 5;

/// A slow explainer, which names the clearance as the conflict and reacts to cancellation within a millisecond.
#[derive(Debug, Clone, Default)]
pub struct Clearance {
    /// How long an explanation takes.
    pub pause: Duration,
    /// If cancelled, it has already found the conflict.
    pub finds_conflict_first: bool,
    /// It panics instead.
    pub panics: bool,
    /// Numbers of started and of cancelled explanations.
    pub counts: Arc<Counts>,
}

/// Returns the numbers of started and of cancelled explanations.
#[derive(Debug, Default)]
pub struct Counts {
    /// Begun.
    pub begun: AtomicU32,
    /// Cancelled.
    pub cancelled: AtomicU32,
}

impl Clearance {
    /// That takes so long.
    pub fn slow(pause: Duration) -> Self {
        Self { pause, ..Self::default() }
    }
}

impl Explain for Clearance {
    fn explain(&self, solve: &SolveToExplain, cancel: &CancelToken) -> Result<Option<Explanation>, SolveError> {
        self.counts.begun.fetch_add(1, Ordering::SeqCst);
        assert!(!self.panics, "the explanation panics");
        let begun = Instant::now();
        while begun.elapsed() < self.pause {
            if cancel.is_cancelled() {
                self.counts.cancelled.fetch_add(1, Ordering::SeqCst);
                let whole = explanation(&solve.problem.bounds, solve.status, &solve.violations);
                let part = Explanation { relaxations: Vec::new(), stopped_early: true, ..whole };
                return Ok(self.finds_conflict_first.then_some(part));
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok(Some(explanation(&solve.problem.bounds, solve.status, &solve.violations)))
    }
}

/// The explanation of these bounds.
pub fn explanation(bounds: &TunedBounds, status: SolveStatus, violations: &[Violation]) -> Explanation {
    let bounds = bounds.to_array();
    let named = |place: usize| (TunedBounds::NAMES[place].to_owned(), TunedBounds::MEANINGS[place].to_owned());
    let at_limit = |place: usize, domain: &str| {
        let (bound, meaning) = named(place);
        BoundAtLimit { bound, meaning, value: bounds[place], domains: vec![domain.to_owned()] }
    };
    let relaxed = |place: usize, to: Option<f64>, not_with: f64| {
        let ((bound, meaning), from) = (named(place), bounds[place]);
        Relaxation {
            bound,
            meaning,
            from,
            to,
            not_with,
            undecided: to.is_none(),
            solves: 8,
            starts: 3,
            warm_start: None,
        }
    };
    let (bound, meaning) = named(CLEARANCE);
    let conflict = Conflict {
        bounds: vec![BoundValue { bound, meaning, value: bounds[CLEARANCE] }],
        without: Vec::new(),
        naturalness_terms: Vec::new(),
        violations: violations.to_vec(),
        starts: 5,
        undecided: false,
    };
    Explanation {
        status,
        violations: violations.to_vec(),
        conflicts: vec![conflict],
        gait_found: false,
        together: Vec::new(),
        stopped_early: false,
        missed: None,
        at_limit: vec![at_limit(CLEARANCE, "SS2_R"), at_limit(TORSO, "stride")],
        relaxations: vec![relaxed(CLEARANCE, Some(0.03), bounds[CLEARANCE]), relaxed(TORSO, None, 1.0)],
    }
}

/// Actions for which the analytic solver finds no gait.
pub fn without_gaits() -> SearchSpace {
    space([0.032, 0.035, 0.039])
}

/// Actions, for a third of which it finds a gait.
pub fn with_few_gaits() -> SearchSpace {
    space([0.02, 0.035, 0.039])
}

fn space(clearances_m: [f64; 3]) -> SearchSpace {
    let clearance = json!({"name": TunedBounds::NAMES[CLEARANCE], "values": clearances_m, "lengthscale": 0.02});
    let lean = json!({"name": TunedBounds::NAMES[TORSO], "values": [0.0, 0.05, 0.1], "lengthscale": 0.1});
    serde_json::from_value(json!({"dimensions": [clearance, lean]})).unwrap()
}
