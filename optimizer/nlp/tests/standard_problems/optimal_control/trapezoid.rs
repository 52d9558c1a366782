//! Optimal control problems in equal intervals of the trapezoidal rule.

use interior_point::EliminationBlocks;

use super::super::Dual;
use super::super::sparse::{Sparse, Term, dissect};

/// The time derivative of a state.
pub struct Equation {
    /// Variables of the node that the rate depends on.
    pub of: &'static [usize],
    pub rate: fn(&[Dual]) -> Dual,
}

/// Bounds and start of a variable of a node: a state or a control.
pub struct NodeVariable {
    pub bounds: (f64, f64),
    /// Values at the first and at the last node, if they are given.
    pub ends: (Option<f64>, Option<f64>),
    /// Initial guess at a share of the duration.
    pub start: fn(f64) -> f64,
}

/// The objective.
pub enum Cost {
    /// The duration.
    Duration,
    /// A sum of weighted variables of the last node, and a constant.
    Last(&'static [(usize, f64)], f64),
}

/// Minimises a cost over the variables of the nodes, states first, and the duration.
pub struct Trapezoid {
    pub intervals: usize,
    /// One for each state.
    pub equations: Vec<Equation>,
    /// States, then controls.
    pub variables: Vec<NodeVariable>,
    /// Bounds and start of the duration.
    pub duration: ((f64, f64), f64),
    pub cost: Cost,
}

impl Trapezoid {
    pub fn program(self) -> Sparse {
        let (intervals, width) = (self.intervals, self.variables.len());
        let points = intervals + 1;
        let duration = width * points;
        let h = 1.0 / intervals as f64;
        // Each row is in the block of the node at the end of its interval, whose state it determines.
        let (parent, block_of_point) = dissect(points, 4);
        let (mut rows, mut block_of_row) = (Vec::new(), Vec::new());
        for k in 0..intervals {
            for (state, equation) in self.equations.iter().enumerate() {
                let (of, rate) = (equation.of.len(), equation.rate);
                let mut variables = vec![width * k + state, width * (k + 1) + state, duration];
                variables.extend(equation.of.iter().map(|j| width * k + j));
                variables.extend(equation.of.iter().map(|j| width * (k + 1) + j));
                rows.push(Term::new(variables, move |s| {
                    s[1] - s[0] - 0.5 * h * s[2] * (rate(&s[3..3 + of]) + rate(&s[3 + of..]))
                }));
                block_of_row.push(block_of_point[k + 1]);
            }
        }
        let objective = match self.cost {
            Cost::Duration => vec![Term::new(vec![duration], |s| s[0])],
            Cost::Last(weights, constant) => weights
                .iter()
                .map(|&(j, weight)| Term::new(vec![width * intervals + j], move |s| s[0] * weight))
                .chain([Term::new(Vec::new(), move |_| Dual::constant(constant))])
                .collect(),
        };
        let mut start: Vec<f64> = Vec::with_capacity(duration + 1);
        for k in 0..points {
            start.extend(self.variables.iter().map(|variable| (variable.start)(k as f64 * h)));
        }
        start.push(self.duration.1);
        let bounds = vec![(0.0, 0.0); rows.len()];
        let mut program = Sparse::new(start, objective, rows, bounds);
        for k in 0..points {
            for (j, variable) in self.variables.iter().enumerate() {
                let end = match k {
                    0 => variable.ends.0,
                    k if k == intervals => variable.ends.1,
                    _ => None,
                };
                let (lower, upper) = end.map_or(variable.bounds, |value| (value, value));
                program.lower[width * k + j] = lower;
                program.upper[width * k + j] = upper;
            }
        }
        (program.lower[duration], program.upper[duration]) = self.duration.0;
        let mut block_of_variable: Vec<usize> = (0..duration).map(|j| block_of_point[j / width]).collect();
        block_of_variable.push(parent.len() - 1);
        program.blocks = Some(EliminationBlocks { parent, block_of_variable, block_of_row });
        program
    }
}
