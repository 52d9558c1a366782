//! One Gaussian process after its answers, and the chain of approximations that leads to it.

use std::sync::Arc;

use crate::error::Result;
use crate::inference::{Approximate, Approximation};
use crate::kernel::Kernel;
use crate::likelihood::Interval;
use crate::linalg::{Cholesky, Square, dot};
use crate::model::Model;
use crate::random::Random;
use crate::settings::Link;
use crate::space::{ActionIndex, SearchSpace};

/// Share of the prior variance by which rounding may leave a covariance short of positive.
const ROUNDING: f64 = 1e-9;

/// An answer before it is attached to points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Answer {
    pub(crate) plus: ActionIndex,
    pub(crate) minus: Option<ActionIndex>,
    pub(crate) interval: Interval,
}

/// Points, answers and their approximation.
#[derive(Debug, Clone)]
pub(crate) struct State {
    pub(crate) model: Model,
    pub(crate) approximation: Approximation,
}

/// How a process is approximated.
pub(crate) struct Process<'a> {
    pub(crate) space: &'a SearchSpace,
    pub(crate) kernel: &'a Kernel,
    pub(crate) link: Link,
    pub(crate) method: &'a dyn Approximate,
}

/// The two newest links of a chain: what the next answer will start from.
#[derive(Debug, Clone, Default)]
pub(crate) struct Chain {
    answers: Vec<Answer>,
    base: Option<(usize, Arc<State>)>,
    tip: Option<(usize, Arc<State>)>,
}

impl Chain {
    /// The state after the answers.
    ///
    /// It is defined by a chain: the answers are cut into groups, a group beginning with each answer that speaks of a
    /// new action, and each group is approximated from the group before it. What an earlier call left behind only
    /// shortens the chain: the links are the same.
    pub(crate) fn advance(&mut self, process: &Process<'_>, answers: &[Answer]) -> Result<Arc<State>> {
        let same = answers.iter().zip(&self.answers).take_while(|(a, b)| a == b).count();
        let opens = |state: &State, at: usize| {
            answers.get(at).is_none_or(|answer| {
                state.model.slot(answer.plus).is_none()
                    || answer.minus.is_some_and(|minus| state.model.slot(minus).is_none())
            })
        };
        let usable = |link: &Option<(usize, Arc<State>)>| // The state without answers is no link: the first group starts from nothing.
            link.clone().filter(|(end, state)| *end > 0 && *end <= same && opens(state, *end));
        let (mut end, mut state) = match usable(&self.tip).or_else(|| usable(&self.base)) {
            Some((end, state)) => (end, Some(state)),
            None => (0, None),
        };
        let mut before = self.base.take().filter(|(base, _)| *base < end);
        while end < answers.len() || state.is_none() {
            let mut model = state.as_ref().map_or_else(Model::default, |s| s.model.roomy());
            let mut next = end;
            while let Some(answer) = answers.get(next) {
                let new =
                    model.slot(answer.plus).is_none() || answer.minus.is_some_and(|minus| model.slot(minus).is_none());
                if next > end && new {
                    break;
                }
                model.add(process.space, process.kernel, answer.plus, answer.minus, answer.interval)?;
                next += 1;
            }
            let previous = state.as_ref().map(|s| &s.approximation);
            let approximation = process.method.advance(&model, process.link, previous)?;
            before = state.map(|state| (end, state));
            state = Some(Arc::new(State { model, approximation }));
            end = next;
        }
        let state = state.unwrap_or_else(|| Arc::new(State::prior()));
        // Only now: after an error the old tip belongs to the old answers.
        self.answers = answers.to_vec();
        self.base = before;
        self.tip = Some((end, Arc::clone(&state)));
        Ok(state)
    }
}

/// Logarithm of the approximate probability of the answers, all taken at once.
pub(crate) fn evidence(process: &Process<'_>, answers: &[Answer]) -> Result<f64> {
    let mut model = Model::default();
    for answer in answers {
        model.add(process.space, process.kernel, answer.plus, answer.minus, answer.interval)?;
    }
    let approximation = process.method.advance(&model, process.link, None)?;
    process.method.evidence(&model, process.link, &approximation)
}

impl State {
    /// No answers.
    fn prior() -> Self {
        Self {
            model: Model::default(),
            approximation: Approximation {
                mean: Vec::new(),
                weights: Vec::new(),
                whitened: Vec::new(),
                factors: Vec::new(),
                covariance: Square::zeros(0),
            },
        }
    }
}

/// A normal belief about a function of the actions.
#[derive(Debug, Clone)]
pub(crate) struct Belief {
    pub(crate) kernel: Arc<Kernel>,
    pub(crate) state: Arc<State>,
}

/// An action seen from the points.
pub(crate) struct View {
    levels: Vec<usize>,
    slot: Option<usize>,
    /// Whitened prior covariances with the points.
    prior: Vec<f64>,
    left: Vec<f64>,
    right: Vec<f64>,
    pub(crate) mean: f64,
}

impl Belief {
    pub(crate) fn model(&self) -> &Model {
        &self.state.model
    }

    pub(crate) fn approximation(&self) -> &Approximation {
        &self.state.approximation
    }

    pub(crate) fn mean(&self, action: ActionIndex, levels: &[usize]) -> f64 {
        match self.model().slot(action) {
            Some(slot) => self.approximation().mean[slot],
            None => dot(&self.kernel.column(levels, &self.model().levels), &self.approximation().weights),
        }
    }

    pub(crate) fn view(&self, action: ActionIndex, levels: Vec<usize>) -> View {
        let model = self.model();
        let slot = model.slot(action);
        let mut prior = self.kernel.column(&levels, &model.levels);
        if let Some(slot) = slot {
            prior[slot] += self.kernel.nugget;
        }
        let mean =
            slot.map_or_else(|| dot(&prior, &self.approximation().weights), |slot| self.approximation().mean[slot]);
        model.prior.solve_lower(&mut prior);
        let (left, right) = self.approximation().project(&model.prior, &prior);
        View { levels, slot, prior, left, right, mean }
    }

    pub(crate) fn covariance(&self, a: &View, b: &View) -> f64 {
        let same = a.slot.is_some() && a.slot == b.slot;
        let prior = self.kernel.covariance(&a.levels, &b.levels) + if same { self.kernel.nugget } else { 0.0 };
        prior - dot(&a.prior, &b.prior) + dot(&a.left, &b.right)
    }

    pub(crate) fn variance(&self, a: &View) -> f64 {
        self.covariance(a, a).max(0.0)
    }

    /// Covariances of a few distinct actions, fit for a joint draw: what a point was told about contains its nugget, any
    /// other action gets its own here, and rounding may leave a point's variance a hair short of positive.
    pub(crate) fn joint_covariance(&self, views: &[View]) -> Square {
        let own = |view: &View| match view.slot {
            Some(_) => ROUNDING * self.kernel.variance,
            None => self.kernel.nugget,
        };
        Square::from_fn(views.len(), |i, j| {
            self.covariance(&views[i], &views[j]) + if i == j { own(&views[i]) } else { 0.0 }
        })
    }

    /// Mean and variance of the difference of two actions.
    pub(crate) fn difference(&self, a: &View, b: &View) -> (f64, f64) {
        let variance = self.covariance(a, a) + self.covariance(b, b) - 2.0 * self.covariance(a, b);
        (a.mean - b.mean, variance.max(0.0))
    }

    /// A joint draw of the utilities of all points, and of some actions that are not points.
    pub(crate) fn draw(&self, others: &[Vec<usize>], random: &mut Random) -> Result<(Vec<f64>, Vec<f64>)> {
        let model = self.model();
        let noise: Vec<f64> = model.points.iter().map(|_| random.normal()).collect();
        let covariance = self.approximation().covariance.ridged(ROUNDING * self.kernel.variance);
        let spread = Cholesky::new(&covariance)?.multiply(&noise);
        let points: Vec<f64> = self.approximation().mean.iter().zip(spread).map(|(m, s)| m + s).collect();
        let mut whitened_draw = points.clone();
        model.prior.solve_lower(&mut whitened_draw);
        let columns: Vec<Vec<f64>> = others
            .iter()
            .map(|levels| {
                let mut column = self.kernel.column(levels, &model.levels);
                model.prior.solve_lower(&mut column);
                column
            })
            .collect();
        let left = Square::from_fn(others.len(), |i, j| {
            let ridge = if i == j { self.kernel.nugget } else { 0.0 };
            self.kernel.covariance(&others[i], &others[j]) - dot(&columns[i], &columns[j]) + ridge
        });
        let noise: Vec<f64> = others.iter().map(|_| random.normal()).collect();
        let spread = Cholesky::new(&left)?.multiply(&noise);
        let others = columns.iter().zip(spread).map(|(column, s)| dot(column, &whitened_draw) + s).collect();
        Ok((points, others))
    }

    /// Weights `c` with `Cov(f(x), f(y)) = k(x, y) + k(x, points) . c` for a view of `y` and every other `x`.
    pub(crate) fn covariance_weights(&self, view: &View) -> Vec<f64> {
        let prior = &self.model().prior;
        let mut kept = view.right.clone();
        prior.solve(&mut kept);
        let mut removed = view.prior.clone();
        prior.solve_upper(&mut removed);
        kept.iter().zip(removed).map(|(kept, removed)| kept - removed).collect()
    }
}
