//! The result of a comparison: changes that break clients, and additions.

use std::fmt::Display;

/// How two descriptions differ.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Difference {
    /// Changes that break clients of the old description.
    pub breaks: Vec<String>,
    /// Changes that a client of the old description need not know.
    pub additions: Vec<String>,
}

impl Difference {
    pub(super) fn breaks(&mut self, place: &str, change: impl Display) {
        self.breaks.push(format!("{place}: {change}"));
    }

    pub(super) fn adds(&mut self, place: &str, change: impl Display) {
        self.additions.push(format!("{place}: {change}"));
    }

    /// Adds a change that breaks clients under a condition.
    pub(super) fn note(&mut self, is_break: bool, place: &str, change: impl Display) {
        if is_break { self.breaks(place, change) } else { self.adds(place, change) }
    }
}
