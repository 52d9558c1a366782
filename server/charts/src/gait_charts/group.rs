//! Groups of figures, as pages show them under one heading.

use crate::{Chart, Figure};

/// Figures that belong together.
#[derive(Debug)]
pub struct Group {
    /// Name in addresses.
    pub id: &'static str,
    /// Heading on the page.
    pub heading: &'static str,
    /// Description of the figures, in a sentence; empty if the heading is enough.
    pub hint: String,
    /// Whether pages show the figures only on request.
    pub is_folded: bool,
    /// The figures, in reading order.
    pub figures: Vec<Figure>,
}

impl Group {
    pub(super) fn new(id: &'static str, heading: &'static str, hint: impl Into<String>, charts: Vec<Chart>) -> Self {
        let figures = charts.into_iter().map(|chart| Figure::chart(id, chart)).collect();
        Self { id, heading, hint: hint.into(), is_folded: false, figures }
    }
}
