//! The fit of a Gaussian process to all its observations.
//!
//! The fit is a fixed point that is computed from nothing, from the observations in a canonical order. It therefore
//! depends neither on the order of the answers nor on earlier fits, to the last bit.

use std::sync::Arc;

use crate::error::Result;
use crate::inference::{Approximate, Approximation};
use crate::interval_likelihood::Link;
use crate::kernel::Kernel;
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

impl Fit {
    /// The fit of the observations, which may be in any order.
    pub(crate) fn of(model: &ProcessModel<'_>, observations: &[Observation]) -> Result<Self> {
        let mut sorted = observations.to_vec();
        sorted.sort_by(Observation::canonical_order);
        let mut observed = ObservedPoints::default();
        for observation in &sorted {
            observed.add(model.space, model.kernel, observation)?;
        }
        let approximation = model.method.approximate(&observed, model.link)?;
        Ok(Self { observed, approximation })
    }
}

/// The last fit of a process. It serves as long as the observations stay the same.
#[derive(Debug, Clone, Default)]
pub(crate) struct LastFit(Option<(Vec<Observation>, Arc<Fit>)>);

impl LastFit {
    /// The fit of the observations. The model must be that of the last call.
    pub(crate) fn get_or_fit(&mut self, model: &ProcessModel<'_>, observations: Vec<Observation>) -> Result<Arc<Fit>> {
        if let Some((of, fit)) = &self.0
            && *of == observations
        {
            return Ok(Arc::clone(fit));
        }
        let fit = Arc::new(Fit::of(model, &observations)?);
        self.0 = Some((observations, Arc::clone(&fit)));
        Ok(fit)
    }
}
