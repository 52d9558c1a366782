//! Incremental inference: the chain of approximations that ends at the fit of all observations.
//!
//! The chain divides the observations into groups. A group begins with each observation of an action that is new. Each
//! group is approximated from the fit of the groups before it. A cached link shortens the chain without changing it, so
//! the fit depends on the observations alone.

use std::sync::Arc;

use crate::error::Result;
use crate::inference::{Approximate, Approximation};
use crate::kernel::Kernel;
use crate::likelihood::Link;
use crate::linalg::Square;
use crate::observations::{Observation, ObservedPoints};
use crate::search_space::SearchSpace;

/// Observations and the approximate posterior at their points.
#[derive(Debug, Clone)]
pub(crate) struct Fit {
    pub(crate) observed: ObservedPoints,
    pub(crate) approximation: Approximation,
}

/// Prior, link and method of inference of a process.
pub(crate) struct ProcessModel<'a> {
    pub(crate) space: &'a SearchSpace,
    pub(crate) kernel: &'a Kernel,
    pub(crate) link: Link,
    pub(crate) method: &'a dyn Approximate,
}

/// Cache of the last two links of a chain, each with the number of observations that it has.
#[derive(Debug, Clone, Default)]
pub(crate) struct UpdateChain {
    observations: Vec<Observation>,
    base: Option<(usize, Arc<Fit>)>,
    tip: Option<(usize, Arc<Fit>)>,
}

impl UpdateChain {
    /// The fit of the observations.
    pub(crate) fn advance(&mut self, model: &ProcessModel<'_>, observations: &[Observation]) -> Result<Arc<Fit>> {
        let same = observations.iter().zip(&self.observations).take_while(|(a, b)| a == b).count();
        let opens = |fit: &Fit, at: usize| observations.get(at).is_none_or(|new| fit.observed.lacks(new));
        // A fit without observations is no link, because the first group starts from nothing.
        let usable = |link: &Option<(usize, Arc<Fit>)>| {
            link.clone().filter(|(end, fit)| *end > 0 && *end <= same && opens(fit, *end))
        };
        let (mut end, mut fit) = match usable(&self.tip).or_else(|| usable(&self.base)) {
            Some((end, fit)) => (end, Some(fit)),
            None => (0, None),
        };
        let mut before = self.base.take().filter(|(base, _)| *base < end);
        while end < observations.len() || fit.is_none() {
            let mut observed = fit.as_ref().map_or_else(ObservedPoints::default, |fit| fit.observed.roomy());
            let mut next = end;
            while let Some(observation) = observations.get(next) {
                if next > end && observed.lacks(observation) {
                    break;
                }
                observed.add(model.space, model.kernel, observation)?;
                next += 1;
            }
            let previous = fit.as_ref().map(|fit| &fit.approximation);
            let approximation = model.method.advance(&observed, model.link, previous)?;
            before = fit.map(|fit| (end, fit));
            fit = Some(Arc::new(Fit { observed, approximation }));
            end = next;
        }
        let fit = fit.unwrap_or_else(|| Arc::new(Fit::without_observations()));
        // Last, so that after an error the old tip still matches the old observations.
        self.observations = observations.to_vec();
        self.base = before;
        self.tip = Some((end, Arc::clone(&fit)));
        Ok(fit)
    }
}

/// Logarithm of the approximate marginal likelihood of the observations, fitted in one step.
pub(crate) fn log_evidence(model: &ProcessModel<'_>, observations: &[Observation]) -> Result<f64> {
    let mut observed = ObservedPoints::default();
    for observation in observations {
        observed.add(model.space, model.kernel, observation)?;
    }
    let approximation = model.method.advance(&observed, model.link, None)?;
    model.method.log_evidence(&observed, model.link, &approximation)
}

impl Fit {
    fn without_observations() -> Self {
        Self {
            observed: ObservedPoints::default(),
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
