//! Static multifrontal factorisation over a given partition of the indices into fronts (Duff & Reid 1983).
//!
//! Each front ([`super::front`]) assembles its own entries and the Schur complements of its children, eliminates its
//! pivots ([`super::null_space`], then [`super::bunch_kaufman`]) and passes the Schur complement of its border to its
//! parent. The inertia is the sum over the fronts (Haynsworth). Pivots are never delayed to the parent: a front with
//! a singular pivot block is a breakdown (`None`), a nearly singular one shows in the residual, and in both cases the
//! caller regularises or changes the method.
//!
//! Several threads ([`super::thread_pool`]) factorise independent parts of the forest at once ([`super::schedule`]).
//! One thread computes each front, from its own entries and then its children in a fixed order, so the result is bit
//! for bit that of a single thread.

// Vector code gets the instructions of the machine only where it is inlined into the dispatched call.
#![allow(clippy::inline_always)]

use std::sync::{Arc, Mutex, PoisonError, RwLock};

use pulp::{Arch, Simd, WithSimd};

use super::bunch_kaufman::{self, Pivots};
use super::dense_kernels::all_finite;
use super::front::{ChildMap, Front, FrontPlace, PivotKind, RoomForDeferred};
use super::front_factor::FrontFactor;
use super::kkt_solver::{Inertia, KktSolver, MatrixChange};
use super::null_space::{self, MAX_DIAGONAL, Workspace};
use super::schedule::{Direction, Schedule, SubtreeTask};
use super::substitution::{Substitution, SubstitutionWorkspace};
use super::symbolic_analysis::{analyse, postordered};
use super::thread_pool::{SharedWork, ThreadPool, lock};
use crate::status::NlpError;

/// Number of operations below which threads cost more than they save.
const MIN_OPERATIONS_PER_THREAD: f64 = 8e6;

/// Analysis, factor and work space.
pub(super) struct Multifrontal {
    order: usize,
    forest: Arc<Forest>,
    /// The threads in addition to the caller.
    threads: Option<ThreadPool>,
    /// Positions of the diagonals that stage 1 neglects.
    neglected: Vec<u32>,
}

/// The data that the threads share.
struct Forest {
    architecture: Arch,
    fronts: Vec<Front>,
    factors: Vec<Mutex<FrontFactor>>,
    schedule: Schedule,
    substitution: Substitution,
    /// One per thread.
    workspaces: Vec<Mutex<(Workspace, SubstitutionWorkspace)>>,
    /// The current pass, and a copy of its values or right-hand side.
    call: RwLock<(Pass, Vec<f64>)>,
}

/// The passes over the forest: factorisation of the values of a matrix, and the two substitutions of a right-hand side.
#[derive(Debug, Clone, Copy)]
enum Pass {
    Factor(MatrixChange),
    Forward,
    Backward,
}

impl Forest {
    /// Takes part in a pass as thread number `member`.
    fn take_part_in(&self, pass: Pass, numbers: &[f64], member: usize) {
        let Self { architecture, fronts, factors, schedule, substitution, workspaces, .. } = self;
        let Some(workspace) = workspaces.get(member) else { return };
        let (work, space) = &mut *lock(workspace);
        schedule.take_part(|task| match pass {
            Pass::Factor(change) => {
                architecture.dispatch(FactorSubtree { fronts, values: numbers, change, task, factors, work });
            }
            Pass::Forward => substitution.forward(*architecture, fronts, factors, task, numbers, space),
            Pass::Backward => substitution.backward(*architecture, fronts, factors, task, space),
        });
    }
}

impl SharedWork for Forest {
    fn take_part(&self, member: usize) {
        let call = self.call.read().unwrap_or_else(PoisonError::into_inner);
        self.take_part_in(call.0, &call.1, member);
    }
}

impl Multifrontal {
    /// Analyses the pattern of a lower triangle. `front_of` is the front of each index; coupled fronts are eliminated
    /// in ascending order.
    pub(super) fn new(
        column_starts: &[usize],
        row_indices: &[usize],
        front_of: &[usize],
        kinds: &[PivotKind],
        room: RoomForDeferred,
        threads: usize,
    ) -> Result<Self, NlpError> {
        let order = column_starts.len() - 1;
        let fail = |reason: &str| NlpError::Analysis { order, reason: reason.to_owned() };
        let members = postordered(column_starts, row_indices, front_of);
        let fronts =
            analyse(column_starts, row_indices, &members, kinds, room).ok_or_else(|| fail("a front is too large"))?;
        let mut factors: Vec<FrontFactor> = fronts.iter().map(FrontFactor::new).collect();
        let flops: f64 = fronts.iter().map(|f| f.flops).sum();
        let threads = if flops < MIN_OPERATIONS_PER_THREAD { 1 } else { threads.max(1) };
        let schedule = Schedule::new(&fronts, threads);
        for root in schedule.tasks.iter().map(|task| task.end - 1) {
            factors[root].schur = vec![0.0; fronts[root].schur_length()];
        }
        let neglected = fronts.iter().flat_map(Front::neglected).collect();
        let workspace = |_| Mutex::new((Workspace::new(&fronts), SubstitutionWorkspace::new(&fronts)));
        let longest = column_starts[order].max(order);
        let forest = Arc::new(Forest {
            architecture: Arch::new(),
            substitution: Substitution::new(&fronts),
            schedule,
            factors: factors.into_iter().map(Mutex::new).collect(),
            workspaces: (0..threads).map(workspace).collect(),
            call: RwLock::new((Pass::Forward, Vec::with_capacity(if threads > 1 { longest } else { 0 }))),
            fronts,
        });
        let threads = (threads > 1).then(|| ThreadPool::new(&forest, threads - 1));
        Ok(Self { order, forest, threads, neglected })
    }

    /// Multiplications and additions of a factorisation.
    #[cfg(feature = "supernodal")]
    pub(super) fn flops(&self) -> f64 {
        self.forest.fronts.iter().map(|f| f.flops).sum()
    }

    /// One pass over the forest; false when it was not completed.
    fn go_over(&self, pass: Pass, numbers: &[f64]) -> bool {
        let forest = &self.forest;
        forest.schedule.begin(if matches!(pass, Pass::Backward) { Direction::Down } else { Direction::Up });
        let Some(threads) = &self.threads else {
            forest.take_part_in(pass, numbers, 0);
            return true;
        };
        {
            let mut call = forest.call.write().unwrap_or_else(PoisonError::into_inner);
            call.0 = pass;
            call.1.clear();
            call.1.extend_from_slice(numbers);
        }
        threads.call(&**forest)
    }
}

/// The factorisation of a task: a subtree, or one front whose children are factorised.
struct FactorSubtree<'a> {
    fronts: &'a [Front],
    values: &'a [f64],
    change: MatrixChange,
    task: &'a SubtreeTask,
    factors: &'a [Mutex<FrontFactor>],
    work: &'a mut Workspace,
}

impl WithSimd for FactorSubtree<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { fronts, values, change, task, factors, work } = self;
        work.stack.clear();
        for f in task.start..task.end {
            let own = &mut *lock(&factors[f]);
            let mut numbers = std::mem::take(&mut work.numbers);
            let front = &fronts[f];
            let scratch = &mut numbers[..front.length];
            scratch.fill(0.0);
            for &(q, offset) in &front.sources {
                scratch[offset as usize] += values[q as usize];
            }
            // L, U and X can be reused only if no row is deferred.
            let same_rows =
                change == MatrixChange::Diagonal && !own.broke_down && own.null_space.rank == front.rows.len();
            own.broke_down = !add_children(fronts, f, scratch, factors, &mut work.stack)
                || !factor_front(simd, front, scratch, own, same_rows, work);
            if !own.broke_down {
                front.keep(scratch, front.first_slot(own.null_space.rank), &mut own.numbers);
                if f + 1 == task.end {
                    let mut at = 0;
                    for column in schur_columns(front, scratch) {
                        own.schur[at..at + column.len()].copy_from_slice(column);
                        at += column.len();
                    }
                } else {
                    schur_columns(front, scratch).for_each(|column| work.stack.extend_from_slice(column));
                }
            }
            work.numbers = numbers;
        }
    }
}

/// The columns of the lower triangle of the Schur complement.
#[inline(always)]
fn schur_columns<'a>(front: &'a Front, numbers: &'a [f64]) -> impl Iterator<Item = &'a [f64]> {
    let end = front.slots();
    (front.pivot_slots()..end).map(move |c| &numbers[front.reduced + c * front.wide..][c..end])
}

/// Adds the Schur complements of the children of front `f`; false when one of them broke down. Those of other tasks
/// are with their factors, those of the same task on top of the stack.
#[inline(always)]
fn add_children(
    fronts: &[Front],
    f: usize,
    numbers: &mut [f64],
    factors: &[Mutex<FrontFactor>],
    stack: &mut Vec<f64>,
) -> bool {
    let front = &fronts[f];
    // Height of the children on the stack.
    let mut height = 0;
    for (child, _) in &front.children {
        let factor = lock(&factors[*child]);
        if factor.broke_down {
            return false;
        }
        height += if factor.schur.is_empty() { fronts[*child].schur_length() } else { 0 };
    }
    let bottom = stack.len() - height;
    let mut at = bottom;
    for (child, map) in &front.children {
        let factor = lock(&factors[*child]);
        if factor.schur.is_empty() {
            let length = fronts[*child].schur_length();
            add_child(front, numbers, &stack[at..at + length], map);
            at += length;
        } else {
            add_child(front, numbers, &factor.schur, map);
        }
    }
    stack.truncate(bottom);
    true
}

/// Factorises the assembled front; false on breakdown. `same_rows`: its rows are those of the previous matrix.
#[inline(always)]
fn factor_front<S: Simd>(
    simd: S,
    front: &Front,
    numbers: &mut [f64],
    own: &mut FrontFactor,
    same_rows: bool,
    work: &mut Workspace,
) -> bool {
    own.inertia = Inertia::default();
    if !front.rows.is_empty() {
        let before = same_rows.then_some(&*own.numbers);
        if !null_space::eliminate(simd, front, numbers, &mut own.null_space, before, work) {
            return false;
        }
        own.inertia.positive += own.null_space.rank;
        own.inertia.negative += own.null_space.rank;
    }
    let pivots = Pivots {
        first: front.first_slot(own.null_space.rank),
        end: front.pivot_slots(),
        size: front.slots(),
        stride: front.wide,
    };
    let reduced = &mut numbers[front.reduced..];
    let done = bunch_kaufman::eliminate(
        simd,
        reduced,
        pivots,
        &mut own.off_diagonal,
        &mut own.order,
        &mut own.inertia,
        &mut work.columns,
    );
    done && all_finite(reduced)
}

/// Adds the Schur complement of a child. Its border is in elimination order, in which the variables of a front come
/// before its slots, so slots ascend.
#[inline(always)]
fn add_child(front: &Front, numbers: &mut [f64], schur: &[f64], map: &ChildMap) {
    let count = map.variables.len();
    let size = count + map.slots.len();
    let mut rest = schur;
    for column in 0..size {
        let (mut source, below) = rest.split_at(size - column);
        rest = below;
        let target = if let Some(&variable) = map.variables.get(column) {
            let (among, others) = source.split_at(count - column);
            for (value, &other) in among.iter().zip(&map.variables[column..]) {
                numbers[front.offset(FrontPlace::Variable(variable), FrontPlace::Variable(other))] += value;
            }
            source = others;
            &mut numbers[front.coupling + variable as usize * front.wide..][..front.wide]
        } else {
            let slot = map.slots[column - count] as usize;
            &mut numbers[front.reduced + slot * front.wide..][..front.wide]
        };
        for (value, &slot) in source.iter().zip(&map.slots[column.max(count) - count..]) {
            target[slot as usize] += value;
        }
    }
}

impl KktSolver for Multifrontal {
    fn suits(&self, values: &[f64]) -> bool {
        self.neglected.iter().all(|&q| values[q as usize].abs() <= MAX_DIAGONAL)
    }

    fn factor(&mut self, values: &[f64], change: MatrixChange) -> Option<Inertia> {
        let done = self.go_over(Pass::Factor(change), values);
        let mut inertia = Inertia::default();
        for factor in &self.forest.factors {
            let factor = lock(factor);
            if !done || factor.broke_down {
                return None;
            }
            inertia.positive += factor.inertia.positive;
            inertia.negative += factor.inertia.negative;
            inertia.zero += factor.inertia.zero;
        }
        Some(inertia)
    }

    fn solve(&mut self, x: &mut [f64]) {
        debug_assert_eq!(x.len(), self.order);
        if self.go_over(Pass::Forward, x) && self.go_over(Pass::Backward, &[]) {
            self.forest.substitution.read(&self.forest.fronts, x);
        } else {
            // The caller finds out by the residual.
            x.fill(f64::NAN);
        }
    }

    fn mark_neglected(&self, neglected: &mut [bool]) {
        for (front, factor) in self.forest.fronts.iter().zip(&self.forest.factors) {
            let null_space = &lock(factor).null_space;
            for &row in &null_space.rows[..null_space.rank] {
                neglected[front.rows[row]] = true;
            }
        }
    }

    fn factor_entries(&self) -> usize {
        self.forest.fronts.iter().map(|front| front.kept.length()).sum()
    }
}
