//! What is found out about solves when they are over.

use super::{Certify, Explain, GaitCertifier, GaitExplainer};
use std::fmt;
use std::sync::Arc;

/// Whoever looks into what solves gave.
#[derive(Clone)]
pub struct AfterSolves {
    /// Gaits are certified.
    pub certify: Arc<dyn Certify>,
    /// That there is no gait is explained.
    pub explain: Arc<dyn Explain>,
}

impl AfterSolves {
    /// The real thing.
    pub fn by_optimizer() -> Self {
        Self { certify: Arc::new(GaitCertifier), explain: Arc::new(GaitExplainer) }
    }
}

impl fmt::Debug for AfterSolves {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("AfterSolves").finish_non_exhaustive()
    }
}
