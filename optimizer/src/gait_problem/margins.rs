//! Margins by which bounds at nodes are tightened, so that the gait also satisfies them between the nodes.

use super::program_data::GaitProgram;
use interior_point::NonlinearProgram;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Largest margin, as a share of the range.
const MAX_SHARE: f64 = 0.25;

/// Margins of variables and rows, in scaled units.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(into = "MarginLists", from = "MarginLists")]
pub struct Margins {
    /// For each variable, the margins of the lower and the upper bound.
    pub(super) variables: BTreeMap<usize, [f64; 2]>,
    /// For each row, the margin of the lower bound.
    pub(super) rows: BTreeMap<usize, f64>,
}

/// Serialised form: lists, because JSON keys are strings.
#[derive(Clone, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct MarginLists {
    variables: Vec<(usize, [f64; 2])>,
    rows: Vec<(usize, f64)>,
}

impl From<Margins> for MarginLists {
    fn from(margins: Margins) -> Self {
        Self { variables: margins.variables.into_iter().collect(), rows: margins.rows.into_iter().collect() }
    }
}

impl From<MarginLists> for Margins {
    fn from(lists: MarginLists) -> Self {
        Self { variables: lists.variables.into_iter().collect(), rows: lists.rows.into_iter().collect() }
    }
}

impl Margins {
    /// Whether no bound is tightened.
    pub fn is_empty(&self) -> bool {
        self.variables.is_empty() && self.rows.is_empty()
    }

    /// Whether the margins fit a problem with these dimensions.
    pub fn fit(&self, variables: usize, rows: usize) -> bool {
        let usable = |margin: &f64| margin.is_finite() && *margin >= 0.0;
        self.variables.iter().all(|(&at, both)| at < variables && both.iter().all(usable))
            && self.rows.iter().all(|(&at, margin)| at < rows && usable(margin))
    }

    /// Adds violations to the margins.
    pub fn grow(&mut self, by: &Self) {
        for (&variable, by) in &by.variables {
            let margin = self.variables.entry(variable).or_default();
            for (margin, by) in margin.iter_mut().zip(by) {
                *margin += by;
            }
        }
        for (&row, by) in &by.rows {
            *self.rows.entry(row).or_default() += by;
        }
    }

    /// Number of tightened bounds.
    pub fn count(&self) -> usize {
        let of_variables = self.variables.values().flatten().filter(|margin| **margin > 0.0);
        of_variables.count() + self.rows.len()
    }

    /// The margins that are relevant at the point `x`: those with a distance to the tightened bound of at most the
    /// margin.
    #[must_use]
    pub fn relevant_at(&self, program: &GaitProgram, x: &[f64]) -> Self {
        let mut values = vec![0.0; program.rows.names.len()];
        program.constraints(x, &mut values);
        let bears = |distance: f64, margin: f64| distance <= 2.0 * margin;
        let (lower, upper) = program.stored_bounds();
        let mut kept = Self::default();
        for (&at, &[low, high]) in &self.variables {
            let low = if bears(x[at] - lower[at], low) { low } else { 0.0 };
            let high = if bears(upper[at] - x[at], high) { high } else { 0.0 };
            if low > 0.0 || high > 0.0 {
                kept.variables.insert(at, [low, high]);
            }
        }
        let rows = self.rows.iter().map(|(&at, &margin)| (at, margin));
        kept.rows = rows.filter(|&(at, margin)| bears(values[at] - program.rows.lower[at], margin)).collect();
        kept
    }

    /// Tightens bounds of variables by at most a share of their range, those of fixed variables not at all.
    pub(super) fn tighten_variables(&self, lower: &mut [f64], upper: &mut [f64]) {
        for (&at, [low, high]) in &self.variables {
            let most = MAX_SHARE * (upper[at] - lower[at]);
            lower[at] += low.min(most);
            upper[at] -= high.min(most);
        }
    }

    /// Tightens bounds of variables and rows.
    fn apply(&self, lower: &mut [f64], upper: &mut [f64], row_lower: &mut [f64]) {
        self.tighten_variables(lower, upper);
        for (&at, margin) in &self.rows {
            row_lower[at] += margin;
        }
    }
}

impl GaitProgram {
    /// The problem with tightened bounds.
    #[must_use]
    pub fn tightened(&self, margins: &Margins) -> Self {
        let mut program = self.clone();
        margins.apply(&mut program.bounds.lower, &mut program.bounds.upper, &mut program.rows.lower);
        program
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn margins_are_at_most_a_quarter_of_the_range_of_a_bound() {
        let margins = Margins {
            variables: BTreeMap::from([(0, [0.1, 9.0]), (1, [0.5, 0.5])]),
            rows: BTreeMap::from([(0, 0.2), (1, 0.2)]),
        };
        let (mut lower, mut upper, mut rows) = (vec![-1.0, 2.0], vec![1.0, 2.0], vec![0.0, f64::NEG_INFINITY]);
        margins.apply(&mut lower, &mut upper, &mut rows);
        assert_eq!((lower, upper, rows), (vec![-0.9, 2.0], vec![0.5, 2.0], vec![0.2, f64::NEG_INFINITY]));
        assert!(margins.fit(2, 2) && !margins.fit(1, 2) && !margins.fit(2, 1));
        assert_eq!(margins.count(), 6);
        let wrong = Margins { variables: BTreeMap::from([(0, [f64::NAN, 0.0])]), ..Margins::default() };
        assert!(!wrong.fit(2, 2));
    }
}
