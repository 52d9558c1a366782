//! The certifier and the explainer of completed solves.

use super::{Certify, Explain, GaitCertifier, GaitExplainer};
use std::fmt;
use std::sync::Arc;

/// The services that certify and explain completed solves.
#[derive(Clone)]
pub struct AfterSolves {
    /// Certifies gaits.
    pub certify: Arc<dyn Certify>,
    /// Explains solves without a gait.
    pub explain: Arc<dyn Explain>,
}

impl AfterSolves {
    /// The implementations of `gait_optimizer`.
    pub fn by_optimizer() -> Self {
        Self { certify: Arc::new(GaitCertifier), explain: Arc::new(GaitExplainer) }
    }
}

impl fmt::Debug for AfterSolves {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("AfterSolves").finish_non_exhaustive()
    }
}
