//! Structure of one front of the multifrontal factorisation, computed once for a fixed pattern.
//!
//! A front eliminates its pivots and passes the Schur complement of its border to its parent. A front with many
//! equality rows works in two stages:
//!
//! 1. Null space: the rows determine as many of the variables, independently of the Hessian ([`super::null_space`]).
//! 2. Bunch-Kaufman eliminates the remaining variables and rows and every pivot that is not a candidate for stage 1.
//!
//! All numbers of a front are in one array. The *slots* of its reduced matrix are, in this order: spare slots for
//! deferred rows, free variables, other pivots, border.

// Vector code gets the instructions of the machine only where it is inlined into the dispatched call.
#![allow(clippy::inline_always)]

use std::collections::HashMap;

use super::block_columns::BlockColumns;
use super::dense_kernels::{LANES, padded};

/// The kind of an index of the matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PivotKind {
    /// A variable.
    Variable,
    /// An equality row, whose diagonal is negligible.
    Equality,
    /// Any other row.
    Other,
}

/// Space of a front for rows that stage 1 defers to stage 2 because none of its variables can be their pivot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RoomForDeferred {
    /// The padding of the columns, which costs nothing; at most [`MAX_DEFERRED`] rows.
    Padding,
    /// [`MAX_DEFERRED`] rows.
    Full,
}

/// Largest number of deferred rows of a front.
const MAX_DEFERRED: usize = 3;
/// Smallest number of rows for which stage 1 pays.
const MIN_ROWS: usize = 6;

/// Structure of a front.
#[derive(Debug, Default)]
pub(super) struct Front {
    /// Variables and rows of stage 1; at least as many variables as rows.
    pub variables: Vec<usize>,
    pub rows: Vec<usize>,
    /// Pivots of stage 2 only.
    pub others: Vec<usize>,
    /// Largest number of deferred rows; each takes two spare slots.
    pub most_deferred: usize,
    /// Later indices that the front couples with, in elimination order.
    pub border: Vec<usize>,
    /// (position in the values of the matrix, offset in the numbers of the front).
    pub sources: Vec<(u32, u32)>,
    /// Child front and the positions of its border in this front.
    pub children: Vec<(usize, ChildMap)>,
    /// Multiplications and additions of a factorisation.
    pub flops: f64,

    /// Column stride of the Hessian and the Jacobian, whose columns have one row per variable.
    pub tall: usize,
    /// Column stride of the couplings and the reduced matrix, whose columns have one row per slot.
    pub wide: usize,
    /// By block of [`LANES`] slots: whether a row of stage 1 or a free variable couples with it; and the ranges of
    /// coupled slots.
    pub coupled: Vec<bool>,
    pub ranges: Vec<(usize, usize)>,
    /// Offsets: transposed Jacobian (becomes L and U), coupling of the variables with the slots, coupling of the rows
    /// with the slots (becomes X), diagonal of the rows, reduced matrix. The Hessian is at 0.
    pub jacobian: usize,
    pub coupling: usize,
    pub row_coupling: usize,
    pub row_diagonal: usize,
    pub reduced: usize,
    /// Length of the numbers during the factorisation.
    pub length: usize,
    /// Variables that each variable of stage 1 couples with in the Hessian, itself included; ascending.
    pub partners: Vec<Vec<u32>>,
    /// The numbers that substitution needs.
    pub kept: KeptNumbers,
}

/// Layout of the numbers that substitution needs: L and U of stage 1; X, couplings and Hessian of its variables
/// without the blocks that are always zero; columns of the pivots of stage 2.
#[derive(Debug, Default)]
pub(super) struct KeptNumbers {
    /// By position of the null space.
    pub row_coupling: BlockColumns,
    /// By variable.
    pub coupling: BlockColumns,
    pub hessian: BlockColumns,
    /// Start of each part, and the end of the last one.
    starts: [usize; 6],
}

impl KeptNumbers {
    /// The parts, in order: L and U, X, couplings, Hessian, columns of the pivots.
    #[inline]
    pub(super) fn parts<'a>(&self, numbers: &'a [f64]) -> [&'a [f64]; 5] {
        std::array::from_fn(|k| &numbers[self.starts[k]..self.starts[k + 1]])
    }

    pub(super) fn length(&self) -> usize {
        self.starts[5]
    }
}

/// Position of an index in a front.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FrontPlace {
    Variable(u32),
    Row(u32),
    Slot(u32),
}

/// Positions of the border of a child in its parent: first variables, then slots in ascending order.
#[derive(Debug, Default)]
pub(super) struct ChildMap {
    pub variables: Vec<u32>,
    pub slots: Vec<u32>,
}

impl ChildMap {
    /// `None` for positions in another order.
    pub(super) fn new(places: impl Iterator<Item = FrontPlace>) -> Option<Self> {
        let mut map = Self::default();
        for place in places {
            match place {
                FrontPlace::Variable(variable) if map.slots.is_empty() => map.variables.push(variable),
                FrontPlace::Slot(slot) if map.slots.last().is_none_or(|last| *last < slot) => map.slots.push(slot),
                _ => return None,
            }
        }
        Some(map)
    }

    fn places(&self) -> impl Iterator<Item = FrontPlace> + '_ {
        let variables = self.variables.iter().map(|&variable| FrontPlace::Variable(variable));
        variables.chain(self.slots.iter().map(|&slot| FrontPlace::Slot(slot)))
    }
}

impl Front {
    /// The front with these pivots and this border. `touched` marks pivots that a child contributes to; such rows
    /// have a diagonal, so they are not candidates for stage 1.
    pub(super) fn new(
        pivots: &[usize],
        border: Vec<usize>,
        kinds: &[PivotKind],
        touched: &[bool],
        room: RoomForDeferred,
    ) -> Self {
        let is_row = |i: &usize| kinds[*i] == PivotKind::Equality && !touched[*i];
        let variables: Vec<usize> = pivots.iter().copied().filter(|i| kinds[*i] == PivotKind::Variable).collect();
        let rows: Vec<usize> = pivots.iter().copied().filter(is_row).collect();
        let mut front = Self { border, ..Self::default() };
        if rows.len() >= MIN_ROWS && rows.len() <= variables.len() {
            front.others = pivots.iter().copied().filter(|i| kinds[*i] != PivotKind::Variable && !is_row(i)).collect();
            (front.variables, front.rows) = (variables, rows);
        } else {
            front.others = pivots.to_vec();
        }
        let (variables, rows) = (front.variables.len(), front.rows.len());
        if rows > 0 {
            let unused = padded(front.slots()) - front.slots();
            front.most_deferred =
                if room == RoomForDeferred::Full { MAX_DEFERRED } else { MAX_DEFERRED.min(unused / 2) };
        }
        let size = front.slots();
        front.tall = padded(variables);
        front.wide = padded(size);
        front.jacobian = front.tall * variables;
        front.coupling = front.jacobian + front.tall * rows;
        front.row_coupling = front.coupling + front.wide * variables;
        front.row_diagonal = front.row_coupling + front.wide * rows;
        front.reduced = front.row_diagonal + padded(rows);
        front.length = front.reduced + front.wide * size;
        let square = |k: usize| (k * k) as f64;
        front.flops = 2.0 * (square(rows) * (variables + 2 * size) as f64 + rows as f64 * square(size))
            + (0..front.pivot_slots() - front.spare()).map(|k| square(size - k)).sum::<f64>();
        front
    }

    /// Sorts the rows of stage 1 by their number of couplings with other pivots, so that sparse rows are eliminated
    /// before denser ones fill them in. `couplings` has each pair of coupled pivots once.
    pub(super) fn put_sparse_rows_first(&mut self, couplings: impl Iterator<Item = [usize; 2]>) {
        let mut couplings_of: HashMap<usize, usize> = HashMap::new();
        for i in couplings.flatten() {
            *couplings_of.entry(i).or_default() += 1;
        }
        self.rows.sort_by_key(|i| couplings_of.get(i).copied());
    }

    /// Number of spare slots, which come first.
    pub(super) fn spare(&self) -> usize {
        2 * self.most_deferred
    }

    /// Number of pivot slots of stage 2, spare ones included.
    pub(super) fn pivot_slots(&self) -> usize {
        self.first_other() + self.others.len()
    }

    /// Slot of the first other pivot.
    pub(super) fn first_other(&self) -> usize {
        self.spare() + self.variables.len() - self.rows.len()
    }

    /// Number of slots.
    pub(super) fn slots(&self) -> usize {
        self.pivot_slots() + self.border.len()
    }

    /// Length of the Schur complement, stored as the columns of its lower triangle.
    pub(super) fn schur_length(&self) -> usize {
        self.border.len() * (self.border.len() + 1) / 2
    }

    /// Every index of the front with its position.
    pub(super) fn places(&self) -> impl Iterator<Item = (usize, FrontPlace)> + '_ {
        let first = self.first_other();
        let number = |k: usize| u32::try_from(k).unwrap_or(u32::MAX);
        let variables = self.variables.iter().enumerate().map(move |(k, i)| (*i, FrontPlace::Variable(number(k))));
        let rows = self.rows.iter().enumerate().map(move |(k, i)| (*i, FrontPlace::Row(number(k))));
        let slots = self.others.iter().chain(&self.border).enumerate();
        variables.chain(rows).chain(slots.map(move |(k, i)| (*i, FrontPlace::Slot(number(first + k)))))
    }

    /// Offset of the entry at two positions.
    #[inline]
    pub(super) fn offset(&self, a: FrontPlace, b: FrontPlace) -> usize {
        use FrontPlace::{Row, Slot, Variable};
        match (a, b) {
            (Variable(i), Variable(j)) => i.min(j) as usize * self.tall + i.max(j) as usize,
            (Variable(i), Row(e)) | (Row(e), Variable(i)) => self.jacobian + e as usize * self.tall + i as usize,
            (Variable(i), Slot(s)) | (Slot(s), Variable(i)) => self.coupling + i as usize * self.wide + s as usize,
            // Rows couple with each other on the diagonal only.
            (Row(e), Row(_)) => self.row_diagonal + e as usize,
            (Row(e), Slot(s)) | (Slot(s), Row(e)) => self.row_coupling + e as usize * self.wide + s as usize,
            (Slot(i), Slot(j)) => self.reduced + i.min(j) as usize * self.wide + i.max(j) as usize,
        }
    }

    /// Records which slots the rows of stage 1 couple with. The sources must be complete; children do not contribute
    /// to rows.
    pub(super) fn note_couplings_of_rows(&mut self) {
        let mut blocks = vec![false; self.wide / LANES];
        if !self.rows.is_empty() {
            // Deferred rows and free variables.
            blocks[..self.first_other().div_ceil(LANES)].fill(true);
            for &(_, offset) in &self.sources {
                let offset = offset as usize;
                if offset >= self.row_coupling && offset < self.row_diagonal {
                    blocks[(offset - self.row_coupling) % self.wide / LANES] = true;
                }
            }
        }
        let mut at = 0;
        for run in blocks.chunk_by(|a, b| a == b) {
            let from = at;
            at += run.len() * LANES;
            if run[0] {
                self.ranges.push((from, at));
            }
        }
        self.coupled = blocks;
    }

    /// Records the layout of the numbers that substitution needs; sources and children must be complete.
    pub(super) fn note_kept(&mut self) {
        let (variables, rows) = (self.variables.len(), self.rows.len());
        let mut offsets: Vec<usize> = self.sources.iter().map(|source| source.1 as usize).collect();
        for (_, map) in &self.children {
            let places: Vec<FrontPlace> = map.places().collect();
            for (k, &a) in places.iter().enumerate().take(map.variables.len()) {
                offsets.extend(places[k..].iter().map(|&b| self.offset(a, b)));
            }
        }
        let tall = self.tall;
        let mirrored = |offset: usize| [offset, offset % tall * tall + offset / tall];
        let hessian: Vec<usize> =
            offsets.iter().copied().filter(|&offset| offset < self.jacobian).flat_map(mirrored).collect();
        let mut pairs: Vec<(usize, u32)> =
            hessian.iter().filter_map(|offset| Some((offset / tall, u32::try_from(offset % tall).ok()?))).collect();
        pairs.sort_unstable();
        pairs.dedup();
        self.partners = vec![Vec::new(); variables];
        for (variable, partner) in pairs {
            self.partners[variable].push(partner);
        }
        // Free variables and deferred rows couple with any variable.
        let deferred = (0..variables).flat_map(|v| (0..self.first_other()).map(move |slot| (v, slot)));
        let own = offsets.iter().filter(|&&offset| (self.coupling..self.row_coupling).contains(&offset));
        let coupling = own.map(|offset| offset - self.coupling).chain(deferred.map(|(v, slot)| v * self.wide + slot));
        let blocks = (0..rows * self.wide).step_by(LANES);
        let row_coupling = blocks.filter(|offset| self.coupled[offset % self.wide / LANES]);
        let kept = KeptNumbers {
            row_coupling: BlockColumns::new(rows, self.wide, row_coupling),
            coupling: BlockColumns::new(variables, self.wide, coupling),
            hessian: BlockColumns::new(variables, tall, hessian.into_iter()),
            starts: [0; 6],
        };
        let lengths = [
            tall * rows,
            kept.row_coupling.length(),
            kept.coupling.length(),
            kept.hessian.length(),
            self.wide * self.pivot_slots(),
        ];
        self.kept = kept;
        for (k, length) in lengths.into_iter().enumerate() {
            self.kept.starts[k + 1] = self.kept.starts[k] + length;
        }
    }

    /// Copies the numbers that substitution needs; `first` is the first used slot.
    #[inline(always)]
    pub(super) fn keep(&self, numbers: &[f64], first: usize, kept: &mut [f64]) {
        let KeptNumbers { row_coupling, coupling, hessian, starts } = &self.kept;
        kept[..starts[1]].copy_from_slice(&numbers[self.jacobian..self.coupling]);
        row_coupling.pack(&numbers[self.row_coupling..self.row_diagonal], &mut kept[starts[1]..starts[2]]);
        coupling.pack(&numbers[self.coupling..self.row_coupling], &mut kept[starts[2]..starts[3]]);
        hessian.pack(&numbers[..self.jacobian], &mut kept[starts[3]..starts[4]]);
        let pivots = first * self.wide..self.pivot_slots() * self.wide;
        kept[starts[4]..][pivots.clone()].copy_from_slice(&numbers[self.reduced..][pivots]);
    }

    /// Positions of the diagonals of the rows of stage 1 in the values of the matrix.
    pub(super) fn neglected(&self) -> impl Iterator<Item = u32> + '_ {
        let diagonal = self.row_diagonal..self.row_diagonal + self.rows.len();
        self.sources.iter().filter(move |s| diagonal.contains(&(s.1 as usize))).map(|s| s.0)
    }
}
