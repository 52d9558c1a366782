//! The belief about the utility after a log, and the questions it answers.

use crate::error::Result;
use crate::feedback::FeedbackLog;
use crate::kernel::Kernel;
use crate::laplace;
use crate::linalg::{Cholesky, Square, dot};
use crate::model::Model;
use crate::random::Random;
use crate::settings::LearnerSettings;
use crate::space::{ActionIndex, SearchSpace};

/// Mean and standard deviation of the utility of an action.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Prediction {
    /// Posterior mean.
    pub mean: f64,
    /// Posterior standard deviation.
    pub standard_deviation: f64,
}

/// A normal belief about the utility of every action.
#[derive(Debug, Clone)]
pub struct Posterior {
    space: SearchSpace,
    settings: LearnerSettings,
    kernel: Kernel,
    model: Model,
    visited: Vec<ActionIndex>,
    prior: Cholesky,
    precision: Cholesky,
    mean: Vec<f64>,
    /// `K^-1 mean`.
    weights: Vec<f64>,
}

/// The belief about the utility after the log.
///
/// # Errors
/// When a setting is out of range or the log does not fit the space.
pub fn posterior(space: &SearchSpace, log: &FeedbackLog, settings: &LearnerSettings) -> Result<Posterior> {
    settings.validate()?;
    let model = Model::of_log(space, log, settings)?;
    let kernel = Kernel::new(space, settings);
    let n = model.points.len();
    let covariance = Square::from_fn(n, |i, j| {
        kernel.covariance(&model.levels[i], &model.levels[j]) + if i == j { kernel.nugget } else { 0.0 }
    });
    let prior = Cholesky::new(&covariance)?;
    let mode = laplace::mode(&prior, &model.sites, settings.link, vec![0.0; n])?;
    let mut weights = mode.whitened;
    prior.solve_upper(&mut weights);
    Ok(Posterior {
        space: space.clone(),
        settings: settings.clone(),
        kernel,
        model,
        visited: log.visited.clone(),
        prior,
        precision: mode.precision,
        mean: mode.mean,
        weights,
    })
}

/// An action seen from the observed points: its prior and posterior whitened covariances with them.
struct View {
    levels: Vec<usize>,
    /// Position among the points, whose diagonal carries the nugget.
    slot: Option<usize>,
    prior: Vec<f64>,
    posterior: Vec<f64>,
}

impl Posterior {
    /// The space believed about.
    pub fn space(&self) -> &SearchSpace {
        &self.space
    }

    /// The settings used.
    pub fn settings(&self) -> &LearnerSettings {
        &self.settings
    }

    /// Actions tried, in order.
    pub fn visited(&self) -> &[ActionIndex] {
        &self.visited
    }

    /// Actions that answers speak of, visited or suggested.
    pub(crate) fn points(&self) -> &[ActionIndex] {
        &self.model.points
    }

    fn view(&self, action: ActionIndex) -> View {
        let levels = self.space.levels(action);
        let slot = self.model.slot(action);
        let mut prior = self.kernel.column(&levels, &self.model.levels);
        if let Some(slot) = slot {
            prior[slot] += self.kernel.nugget;
        }
        self.prior.solve_lower(&mut prior);
        let mut posterior = prior.clone();
        self.precision.solve_lower(&mut posterior);
        View { levels, slot, prior, posterior }
    }

    fn covariance(&self, a: &View, b: &View) -> f64 {
        let same = a.levels == b.levels && a.slot.is_some();
        let prior = self.kernel.covariance(&a.levels, &b.levels) + if same { self.kernel.nugget } else { 0.0 };
        prior - dot(&a.prior, &b.prior) + dot(&a.posterior, &b.posterior)
    }

    /// Posterior mean of an action.
    ///
    /// # Errors
    /// When the action is not in the space.
    pub fn mean(&self, action: ActionIndex) -> Result<f64> {
        self.space.check(action)?;
        Ok(self.mean_unchecked(action))
    }

    pub(crate) fn mean_unchecked(&self, action: ActionIndex) -> f64 {
        match self.model.slot(action) {
            Some(slot) => self.mean[slot],
            None => dot(&self.kernel.column(&self.space.levels(action), &self.model.levels), &self.weights),
        }
    }

    /// Mean and standard deviation of an action.
    ///
    /// # Errors
    /// When the action is not in the space.
    pub fn predict(&self, action: ActionIndex) -> Result<Prediction> {
        let mean = self.mean(action)?;
        let view = self.view(action);
        Ok(Prediction { mean, standard_deviation: self.covariance(&view, &view).max(0.0).sqrt() })
    }

    /// The recommendation: of the actions tried, the one with the highest mean. Of equals, the earliest.
    pub fn best(&self) -> Option<ActionIndex> {
        let mut best: Option<(ActionIndex, f64)> = None;
        for &action in &self.visited {
            let mean = self.mean_unchecked(action);
            if best.is_none_or(|(_, highest)| mean > highest) {
                best = Some((action, mean));
            }
        }
        best.map(|(action, _)| action)
    }

    /// One joint draw of the utilities of a few distinct actions.
    pub(crate) fn draw(&self, actions: &[ActionIndex], random: &mut Random) -> Result<Vec<f64>> {
        let views: Vec<View> = actions.iter().map(|&a| self.view(a)).collect();
        let covariance = Square::from_fn(actions.len(), |i, j| {
            self.covariance(&views[i], &views[j]) + if i == j { self.kernel.nugget } else { 0.0 }
        });
        let factor = Cholesky::new(&covariance)?;
        let noise: Vec<f64> = actions.iter().map(|_| random.normal()).collect();
        let spread = factor.multiply(&noise);
        Ok(actions.iter().zip(spread).map(|(&a, s)| self.mean_unchecked(a) + s).collect())
    }

    /// Mean and variance of the difference of the utilities of two actions.
    pub(crate) fn difference(&self, a: ActionIndex, b: ActionIndex) -> (f64, f64) {
        let (va, vb) = (self.view(a), self.view(b));
        let variance = self.covariance(&va, &va) + self.covariance(&vb, &vb) - 2.0 * self.covariance(&va, &vb);
        (self.mean_unchecked(a) - self.mean_unchecked(b), variance.max(0.0))
    }
}
