//! The elimination tree of variables and rows, which the factorisation of the KKT matrix follows.
//!
//! From the leaves to the root:
//!
//! * each muscle at each node: states and force row. If the objective couples activations of adjacent nodes, the
//!   activation is higher, in the block of the interval;
//! * each node;
//! * the integration rows of each mesh interval, by bisection of the domain, which limits the fill-in;
//! * each domain (Bezier coefficients, phase limits);
//! * each transition between domains, by bisection of the ring of domains: resets, impulse, and the velocities before
//!   an impact with the rows that determine them, because the impact couples them to the next domain;
//! * the root: durations, hip velocities, lengths and the transition that closes the stride.

use super::layout::{Layout, QD, QDD};
use super::row_names::{RowKind, RowPlace};
use super::rows::RowTable;
use crate::muscle::MUSCLE_COUNT;
use crate::walking::{BEZIER_COEFFICIENTS, CYCLE};
use interior_point::EliminationBlocks;

/// Transitions in order of elimination, each with its parent; the last one is part of the root.
const TRANSITION_PARENTS: [(usize, usize); 7] = [(0, 1), (2, 1), (4, 5), (6, 5), (1, 3), (5, 3), (3, ROOT)];
/// The transition that closes the stride.
const ROOT: usize = 7;

/// Blocks of a domain.
#[derive(Debug, Default)]
struct DomainBlocks {
    /// Block of each node.
    points: Vec<usize>,
    /// First of the ten muscle blocks of each node.
    muscles: Vec<usize>,
    /// Block of each interval; empty without integration rows.
    intervals: Vec<usize>,
    own: usize,
}

/// Numbers blocks and records their parents.
#[derive(Debug, Default)]
struct Numbering {
    parent: Vec<Option<usize>>,
}

impl Numbering {
    fn add(&mut self) -> usize {
        self.parent.push(None);
        self.parent.len() - 1
    }

    /// Adds blocks of the intervals [from, to), the middle one as parent of both halves. Returns the highest block.
    fn bisect(&mut self, blocks: &mut [usize], from: usize, to: usize) -> Option<usize> {
        if from == to {
            return None;
        }
        let middle = usize::midpoint(from, to);
        let halves = [self.bisect(blocks, from, middle), self.bisect(blocks, middle + 1, to)];
        let block = self.add();
        blocks[middle] = block;
        for half in halves.into_iter().flatten() {
            self.parent[half] = Some(block);
        }
        Some(block)
    }
}

/// The tree of a layout with its rows.
pub(super) fn elimination_tree(layout: &Layout, rows: &RowTable, activations_are_coupled: bool) -> EliminationBlocks {
    let mut numbering = Numbering::default();
    let mut domains: Vec<DomainBlocks> = layout.domains.iter().map(|_| DomainBlocks::default()).collect();
    for (domain, blocks) in layout.domains.iter().zip(&mut domains) {
        for _ in 0..domain.points {
            if layout.muscles {
                blocks.muscles.push(numbering.parent.len());
                (0..MUSCLE_COUNT).for_each(|_| {
                    numbering.add();
                });
            }
            blocks.points.push(numbering.add());
        }
    }
    for ((domain, blocks), domain_rows) in layout.domains.iter().zip(&mut domains).zip(&rows.domains) {
        let mut top = None;
        if domain_rows.zero_dynamics.is_some() || domain_rows.fibres.is_some() {
            blocks.intervals = vec![0; domain.intervals];
            top = numbering.bisect(&mut blocks.intervals, 0, domain.intervals);
        }
        blocks.own = numbering.add();
        if let Some(top) = top {
            numbering.parent[top] = Some(blocks.own);
        }
    }
    let mut transitions = [0; CYCLE.len()];
    for (transition, _) in TRANSITION_PARENTS {
        transitions[transition] = numbering.add();
    }
    transitions[ROOT] = numbering.add();
    for (transition, next) in TRANSITION_PARENTS {
        numbering.parent[transitions[transition]] = Some(transitions[next]);
    }
    let root = transitions[ROOT];

    let mut tree = EliminationBlocks {
        parent: numbering.parent,
        block_of_variable: vec![root; layout.variables],
        block_of_row: vec![root; rows.names.len()],
    };
    for (d, (domain, blocks)) in layout.domains.iter().zip(&domains).enumerate() {
        let before = transitions[(d + CYCLE.len() - 1) % CYCLE.len()];
        let after = transitions[d];
        tree.parent[blocks.own] = Some(before.min(after));
        for k in 0..domain.points {
            let neighbours = [(k / 2).checked_sub(usize::from(k % 2 == 0)), Some(k / 2)];
            let intervals = neighbours.into_iter().flatten().filter_map(|i| blocks.intervals.get(i));
            let highest = intervals.clone().copied().max();
            let block = blocks.points[k];
            tree.parent[block] = Some(intervals.copied().min().unwrap_or(blocks.own));
            let p = domain.point(k);
            tree.block_of_variable[p..p + domain.fibre_length()].fill(block);
            if layout.muscles {
                for muscle in 0..MUSCLE_COUNT {
                    let own = blocks.muscles[k] + muscle;
                    tree.parent[own] = Some(block);
                    for offset in [domain.fibre_length(), domain.fibre_velocity(), domain.activation()] {
                        tree.block_of_variable[p + offset + muscle] = own;
                    }
                    // Of two adjacent intervals one is an ancestor of the other. The ancestor takes the node between
                    // them.
                    if let Some(interval) = highest.filter(|_| activations_are_coupled) {
                        tree.block_of_variable[p + domain.activation() + muscle] = interval;
                    }
                }
            }
            if k == domain.last() && CYCLE[(d + 1) % CYCLE.len()].opens_with_impact() {
                tree.block_of_variable[p + QD..p + QDD].fill(after);
            }
        }
        tree.block_of_variable[domain.phase_start] = blocks.own;
        if let Some(end) = domain.phase_end {
            tree.block_of_variable[end] = blocks.own;
        }
        let coefficients = domain.outputs.len() * BEZIER_COEFFICIENTS;
        tree.block_of_variable[domain.bezier..domain.bezier + coefficients].fill(blocks.own);
        if let Some(impulse) = domain.impulse {
            tree.block_of_variable[impulse..impulse + domain.contacts].fill(before);
        }
    }
    for (row, name) in rows.names.iter().enumerate() {
        tree.block_of_row[row] = match name.place {
            RowPlace::Stride => root,
            RowPlace::Transition { domain } => transitions[domain],
            RowPlace::Point { domain: d, point: k } => {
                let blocks = &domains[d];
                let into_impact = CYCLE[(d + 1) % CYCLE.len()].opens_with_impact();
                let before_impact = into_impact && k == layout.domains[d].last();
                match name.kind {
                    RowKind::MidpointPhase | RowKind::MidpointPhaseRate | RowKind::MidpointFibre => {
                        blocks.intervals[k / 2]
                    }
                    RowKind::EndpointPhase | RowKind::EndpointPhaseRate | RowKind::EndpointFibre => {
                        blocks.intervals[k / 2 - 1]
                    }
                    RowKind::ContactVelocity | RowKind::OutputVelocity | RowKind::HipVelocity if before_impact => {
                        transitions[d]
                    }
                    RowKind::MuscleForce => blocks.muscles[k] + name.component,
                    _ => blocks.points[k],
                }
            }
        };
    }
    tree
}
