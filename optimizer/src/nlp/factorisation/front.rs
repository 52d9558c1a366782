//! Structure of one front of the multifrontal factorisation, found once for a fixed pattern.
//!
//! A front eliminates its pivots and hands the Schur complement of its border to its parent. Where it holds nearly as
//! many equality rows as variables it works in two stages:
//!
//! 1. Null space: its rows determine as many of its variables, whatever the Hessian (see [`super::null_space`]).
//! 2. The variables and rows that are left, together with everything that is no candidate for stage 1, are eliminated by
//!    Bunch-Kaufman.
//!
//! All numbers of a front lie in one array; the *slots* of its reduced matrix are, in this order: spare slots for
//! deferred rows, free variables, other pivots, border.

// Vector code is compiled for a machine's instructions only where it is inlined into the dispatched call.
#![allow(clippy::inline_always)]

use std::collections::HashMap;

use super::block_columns::BlockColumns;
use super::dense_kernels::{LANES, padded};

/// What an index of the matrix is to the factorisation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PivotKind {
    /// A variable.
    Variable,
    /// An equality row: negligible diagonal.
    Equality,
    /// Any other row.
    Other,
}

/// Room of a front for rows that stage 1 leaves to stage 2 because no variable of the front can take them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RoomForDeferred {
    /// What the padding of the columns leaves, so that it costs nothing; at most [`MOST_DEFERRED`] rows.
    Padding,
    /// [`MOST_DEFERRED`] rows.
    Full,
}

/// Rows of a front that can be deferred at most.
const MOST_DEFERRED: usize = 3;
/// Fewer rows are not worth a stage of their own.
const FEWEST_ROWS: usize = 6;

/// Structure of a front.
#[derive(Debug, Default)]
pub(super) struct Front {
    /// Stage 1: variables and rows. At least as many variables as rows.
    pub variables: Vec<usize>,
    pub rows: Vec<usize>,
    /// Pivots of stage 2 only.
    pub others: Vec<usize>,
    /// Rows that may be deferred; each takes two spare slots.
    pub most_deferred: usize,
    /// Later indices it couples with, by elimination order.
    pub border: Vec<usize>,
    /// (position in the matrix values, offset in the numbers of the front).
    pub sources: Vec<(u32, u32)>,
    /// Child front and the places of its border.
    pub children: Vec<(usize, ChildMap)>,
    /// Multiplications and additions of a factorisation.
    pub flops: f64,

    /// Column stride of what is as long as the variables: Hessian, Jacobian.
    pub tall: usize,
    /// Column stride of what is as long as the slots: couplings, reduced matrix.
    pub wide: usize,
    /// By block of [`LANES`] slots: whether a row of stage 1, or a free variable, couples with one of them; and the
    /// ranges of slots in which one does.
    pub coupled: Vec<bool>,
    pub ranges: Vec<(usize, usize)>,
    /// Offsets: transposed Jacobian (becomes L and U), coupling of the variables with the slots, coupling of the rows
    /// with the slots (becomes X), diagonal of the rows, reduced matrix. The Hessian is at 0.
    pub jacobian: usize,
    pub coupling: usize,
    pub row_coupling: usize,
    pub row_diagonal: usize,
    pub reduced: usize,
    /// Length of the numbers while it is factorised.
    pub length: usize,
    /// Which variables of stage 1 each of them couples with in the Hessian, itself included; ascending.
    pub partners: Vec<Vec<u32>>,
    /// What solves need of them.
    pub kept: Kept,
}

/// The numbers that solves need, one part after the other: L and U of stage 1; X, couplings and Hessian of its variables
/// without the blocks that are always zero; columns of the pivots of stage 2.
#[derive(Debug, Default)]
pub(super) struct Kept {
    /// By position of the null space.
    pub row_coupling: BlockColumns,
    /// By variable.
    pub coupling: BlockColumns,
    pub hessian: BlockColumns,
    /// Where the parts begin, and where the last one ends.
    starts: [usize; 6],
}

impl Kept {
    /// The parts, in order: L and U, X, couplings, Hessian, columns of the pivots.
    #[inline]
    pub(super) fn parts<'a>(&self, numbers: &'a [f64]) -> [&'a [f64]; 5] {
        std::array::from_fn(|k| &numbers[self.starts[k]..self.starts[k + 1]])
    }

    pub(super) fn length(&self) -> usize {
        self.starts[5]
    }
}

/// Place of an index in a front.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    Variable(u32),
    Row(u32),
    Slot(u32),
}

/// Where the border of a child lies in its parent: first variables, then slots in ascending order.
#[derive(Debug, Default)]
pub(super) struct ChildMap {
    pub variables: Vec<u32>,
    pub slots: Vec<u32>,
}

impl ChildMap {
    /// `None` for places in another order.
    pub(super) fn new(places: impl Iterator<Item = Place>) -> Option<Self> {
        let mut map = Self::default();
        for place in places {
            match place {
                Place::Variable(variable) if map.slots.is_empty() => map.variables.push(variable),
                Place::Slot(slot) if map.slots.last().is_none_or(|last| *last < slot) => map.slots.push(slot),
                _ => return None,
            }
        }
        Some(map)
    }

    fn places(&self) -> impl Iterator<Item = Place> + '_ {
        let variables = self.variables.iter().map(|&variable| Place::Variable(variable));
        variables.chain(self.slots.iter().map(|&slot| Place::Slot(slot)))
    }
}

impl Front {
    /// Front with these pivots and border. `touched`: pivots that a child contributes to; such rows have a diagonal, so
    /// they are no candidates for stage 1.
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
        if rows.len() >= FEWEST_ROWS && rows.len() <= variables.len() {
            front.others = pivots.iter().copied().filter(|i| kinds[*i] != PivotKind::Variable && !is_row(i)).collect();
            (front.variables, front.rows) = (variables, rows);
        } else {
            front.others = pivots.to_vec();
        }
        let (variables, rows) = (front.variables.len(), front.rows.len());
        if rows > 0 {
            let unused = padded(front.slots()) - front.slots();
            front.most_deferred =
                if room == RoomForDeferred::Full { MOST_DEFERRED } else { MOST_DEFERRED.min(unused / 2) };
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

    /// Orders the rows of stage 1 by their number of couplings with other pivots: rows that determine few variables do so
    /// before the others, which would fill them. `couplings`: pairs of pivots, each once.
    pub(super) fn put_sparse_rows_first(&mut self, couplings: impl Iterator<Item = [usize; 2]>) {
        let mut couplings_of: HashMap<usize, usize> = HashMap::new();
        for i in couplings.flatten() {
            *couplings_of.entry(i).or_default() += 1;
        }
        self.rows.sort_by_key(|i| couplings_of.get(i).copied());
    }

    /// Spare slots, at the beginning.
    pub(super) fn spare(&self) -> usize {
        2 * self.most_deferred
    }

    /// Slots of stage 2's pivots, spare ones included.
    pub(super) fn pivot_slots(&self) -> usize {
        self.first_other() + self.others.len()
    }

    /// Slot of the first of the others.
    pub(super) fn first_other(&self) -> usize {
        self.spare() + self.variables.len() - self.rows.len()
    }

    /// All slots.
    pub(super) fn slots(&self) -> usize {
        self.pivot_slots() + self.border.len()
    }

    /// Length of the Schur complement, columns of the lower triangle one after the other.
    pub(super) fn schur_length(&self) -> usize {
        self.border.len() * (self.border.len() + 1) / 2
    }

    /// Index and place of everything in the front.
    pub(super) fn places(&self) -> impl Iterator<Item = (usize, Place)> + '_ {
        let first = self.first_other();
        let number = |k: usize| u32::try_from(k).unwrap_or(u32::MAX);
        let variables = self.variables.iter().enumerate().map(move |(k, i)| (*i, Place::Variable(number(k))));
        let rows = self.rows.iter().enumerate().map(move |(k, i)| (*i, Place::Row(number(k))));
        let slots = self.others.iter().chain(&self.border).enumerate();
        variables.chain(rows).chain(slots.map(move |(k, i)| (*i, Place::Slot(number(first + k)))))
    }

    /// Offset of the entry that couples two places.
    #[inline]
    pub(super) fn offset(&self, a: Place, b: Place) -> usize {
        use Place::{Row, Slot, Variable};
        match (a, b) {
            (Variable(i), Variable(j)) => i.min(j) as usize * self.tall + i.max(j) as usize,
            (Variable(i), Row(e)) | (Row(e), Variable(i)) => self.jacobian + e as usize * self.tall + i as usize,
            (Variable(i), Slot(s)) | (Slot(s), Variable(i)) => self.coupling + i as usize * self.wide + s as usize,
            // Rows do not couple with each other but on the diagonal.
            (Row(e), Row(_)) => self.row_diagonal + e as usize,
            (Row(e), Slot(s)) | (Slot(s), Row(e)) => self.row_coupling + e as usize * self.wide + s as usize,
            (Slot(i), Slot(j)) => self.reduced + i.min(j) as usize * self.wide + i.max(j) as usize,
        }
    }

    /// Notes which slots the rows of stage 1 couple with; the sources must be complete. No child contributes to rows.
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

    /// Notes what solves need; sources and children must be complete.
    pub(super) fn note_kept(&mut self) {
        let (variables, rows) = (self.variables.len(), self.rows.len());
        let mut offsets: Vec<usize> = self.sources.iter().map(|source| source.1 as usize).collect();
        for (_, map) in &self.children {
            let places: Vec<Place> = map.places().collect();
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
        let kept = Kept {
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

    /// Copies what solves need; `first`: the first slot in use.
    #[inline(always)]
    pub(super) fn keep(&self, numbers: &[f64], first: usize, kept: &mut [f64]) {
        let Kept { row_coupling, coupling, hessian, starts } = &self.kept;
        kept[..starts[1]].copy_from_slice(&numbers[self.jacobian..self.coupling]);
        row_coupling.pack(&numbers[self.row_coupling..self.row_diagonal], &mut kept[starts[1]..starts[2]]);
        coupling.pack(&numbers[self.coupling..self.row_coupling], &mut kept[starts[2]..starts[3]]);
        hessian.pack(&numbers[..self.jacobian], &mut kept[starts[3]..starts[4]]);
        let pivots = first * self.wide..self.pivot_slots() * self.wide;
        kept[starts[4]..][pivots.clone()].copy_from_slice(&numbers[self.reduced..][pivots]);
    }

    /// Positions in the matrix values of the diagonals of the rows of stage 1.
    pub(super) fn neglected(&self) -> impl Iterator<Item = u32> + '_ {
        let diagonal = self.row_diagonal..self.row_diagonal + self.rows.len();
        self.sources.iter().filter(move |s| diagonal.contains(&(s.1 as usize))).map(|s| s.0)
    }
}
