//! Static multifrontal factorisation over a given partition of the indices into fronts.
//!
//! Each front ([`super::front`]) assembles its own entries and its children's Schur complements, eliminates its pivots
//! ([`super::null_space`], then [`super::bunch_kaufman`]) and leaves the Schur complement of its border to its parent.
//! Inertia adds over the fronts (Haynsworth). Pivots are never delayed to the parent: a front whose pivot block is
//! singular breaks the factorisation down (`None`), one that is nearly so shows in the residual, and either way the
//! caller regularises or changes the method.
//!
//! Several threads ([`super::thread_pool`]) factorise independent parts of the forest at once ([`super::schedule`]). Each front is
//! computed by one thread, from its own entries and then its children in fixed order, so the result is bit for bit that of
//! one thread.

// Vector code is compiled for a machine's instructions only where it is inlined into the dispatched call.
#![allow(clippy::inline_always)]

use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock};

use pulp::{Arch, Simd, WithSimd};

use super::aligned::Aligned;
use super::bunch_kaufman::{self, Pivots};
use super::dense_kernels::all_finite;
use super::front::{ChildMap, Front, PivotKind, Place, RoomForDeferred};
use super::kkt_solver::{Change, Inertia, KktSolver};
use super::null_space::{self, LARGEST_DIAGONAL, NullSpace, Workspace};
use super::schedule::{Direction, Schedule, SubtreeTask};
use super::substitution::{Space, Substitution};
use super::thread_pool::{Job, ThreadPool};
use crate::nlp::status::NlpError;

/// Operations below which starting threads costs more than it saves.
const WORTH_A_THREAD: f64 = 8e6;

/// Numbers of a front.
#[derive(Debug, Default)]
pub(super) struct Factor {
    /// What solves need.
    pub numbers: Aligned,
    /// The Schur complement, where its parent is done by another task of the schedule; the others wait on a stack.
    schur: Vec<f64>,
    pub null_space: NullSpace,
    /// Subdiagonal of B and order of the slots, of stage 2.
    pub off_diagonal: Vec<f64>,
    pub order: Vec<usize>,
    inertia: Inertia,
    broke_down: bool,
}

impl Factor {
    fn new(front: &Front) -> Self {
        let pivots = front.pivot_slots();
        let null_space = NullSpace {
            variables: (0..front.variables.len()).collect(),
            rows: (0..front.rows.len()).collect(),
            rank: front.rows.len(),
        };
        Self {
            numbers: Aligned::zeros(front.kept.length()),
            null_space,
            off_diagonal: vec![0.0; pivots],
            order: (0..pivots).collect(),
            ..Self::default()
        }
    }
}

/// Analysis, factor and work space.
pub(super) struct Multifrontal {
    order: usize,
    forest: Arc<Forest>,
    /// The threads beside the caller's.
    threads: Option<ThreadPool>,
    /// Positions of the diagonals that stage 1 neglects.
    neglected: Vec<u32>,
}

/// What the threads share.
struct Forest {
    architecture: Arch,
    fronts: Vec<Front>,
    factors: Vec<Mutex<Factor>>,
    schedule: Schedule,
    substitution: Substitution,
    /// By thread.
    workspaces: Vec<Mutex<(Workspace, Space)>>,
    /// What the threads are called for.
    call: RwLock<(Pass, Vec<f64>)>,
}

/// What is done in a round over the forest, with the values of the matrix or a right-hand side.
#[derive(Debug, Clone, Copy)]
enum Pass {
    Factor(Change),
    Forward,
    Backward,
}

impl Forest {
    /// Takes part in a round.
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

impl Job for Forest {
    fn take_part(&self, member: usize) {
        let call = self.call.read().unwrap_or_else(PoisonError::into_inner);
        self.take_part_in(call.0, &call.1, member);
    }
}

/// The lock of something that is whole at any time.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Multifrontal {
    /// Analyses the lower triangle. `front_of` gives each index its front; fronts are eliminated by ascending number
    /// as far as their couplings demand.
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
        let mut factors: Vec<Factor> = fronts.iter().map(Factor::new).collect();
        let flops: f64 = fronts.iter().map(|f| f.flops).sum();
        let threads = if flops < WORTH_A_THREAD { 1 } else { threads.max(1) };
        let schedule = Schedule::new(&fronts, threads);
        for root in schedule.tasks.iter().map(|task| task.end - 1) {
            factors[root].schur = vec![0.0; fronts[root].schur_length()];
        }
        let neglected = fronts.iter().flat_map(Front::neglected).collect();
        let workspace = |_| Mutex::new((Workspace::new(&fronts), Space::new(&fronts)));
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
    pub(super) fn flops(&self) -> f64 {
        self.forest.fronts.iter().map(|f| f.flops).sum()
    }

    /// One round over the forest; false when it was not done.
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

/// Members of each front, fronts renumbered so that every subtree of the front forest is contiguous and ends with its
/// root.
pub(super) fn postordered(column_starts: &[usize], row_indices: &[usize], front_of: &[usize]) -> Vec<Vec<usize>> {
    let count = front_of.iter().max().map_or(0, |f| f + 1);
    // Parent of a front: the first front its border meets, with the borders of its children passed on.
    let mut reach: Vec<Vec<usize>> = vec![Vec::new(); count];
    for j in 0..front_of.len() {
        for &i in &row_indices[column_starts[j]..column_starts[j + 1]] {
            let (a, b) = (front_of[i].min(front_of[j]), front_of[i].max(front_of[j]));
            if a != b {
                reach[a].push(b);
            }
        }
    }
    let mut parent = vec![None; count];
    for f in 0..count {
        let mut list = std::mem::take(&mut reach[f]);
        list.sort_unstable();
        list.dedup();
        if let Some(&p) = list.first() {
            parent[f] = Some(p);
            reach[p].extend(list.iter().copied().filter(|&g| g != p));
        }
    }
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); count];
    for f in 0..count {
        if let Some(p) = parent[f] {
            children[p].push(f);
        }
    }
    let mut sequence = Vec::with_capacity(count);
    for root in (0..count).filter(|&f| parent[f].is_none()) {
        let mut path = vec![(root, 0)];
        while let Some((f, next)) = path.last_mut() {
            if let Some(&child) = children[*f].get(*next) {
                *next += 1;
                path.push((child, 0));
            } else {
                sequence.push(*f);
                path.pop();
            }
        }
    }
    let mut members: Vec<Vec<usize>> = vec![Vec::new(); count];
    for (i, &f) in front_of.iter().enumerate() {
        members[f].push(i);
    }
    sequence.into_iter().map(|f| std::mem::take(&mut members[f])).filter(|m| !m.is_empty()).collect()
}

fn analyse(
    column_starts: &[usize],
    row_indices: &[usize],
    members: &[Vec<usize>],
    kinds: &[PivotKind],
    room: RoomForDeferred,
) -> Option<Vec<Front>> {
    let order = column_starts.len() - 1;
    let count = members.len();
    let (mut front_of, mut rank) = (vec![0; order], vec![0; order]);
    let mut next = 0;
    for (f, list) in members.iter().enumerate() {
        for &i in list {
            front_of[i] = f;
            rank[i] = next;
            next += 1;
        }
    }
    // Entries belong to the front of their earlier index.
    let mut entries: Vec<Vec<(usize, usize, usize)>> = vec![Vec::new(); count];
    for j in 0..order {
        for q in column_starts[j]..column_starts[j + 1] {
            let i = row_indices[q];
            let (first, last) = if rank[i] < rank[j] { (i, j) } else { (j, i) };
            entries[front_of[first]].push((q, first, last));
        }
    }
    let mut fronts: Vec<Front> = Vec::with_capacity(count);
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); count];
    let mut touched = vec![false; order];
    let mut places = vec![Place::Slot(0); order];
    for (f, pivots) in members.iter().enumerate() {
        let mut border: Vec<usize> = entries[f].iter().map(|e| e.2).filter(|&i| front_of[i] != f).collect();
        for &child in &children[f] {
            for &i in &fronts[child].border {
                touched[i] |= front_of[i] == f;
                if front_of[i] != f {
                    border.push(i);
                }
            }
        }
        border.sort_unstable_by_key(|&i| rank[i]);
        border.dedup();
        if let Some(&i) = border.first() {
            children[front_of[i]].push(f);
        }
        let mut front = Front::new(pivots, border, kinds, &touched, room);
        u32::try_from(front.length).ok()?;
        let within = entries[f].iter().filter(|entry| front_of[entry.2] == f);
        front.put_sparse_rows_first(within.map(|entry| [entry.1, entry.2]));
        for (i, place) in front.places() {
            places[i] = place;
        }
        for &(q, first, last) in &entries[f] {
            let offset = front.offset(places[first], places[last]);
            front.sources.push((u32::try_from(q).ok()?, u32::try_from(offset).ok()?));
        }
        front.note_couplings_of_rows();
        for &child in &children[f] {
            front.children.push((child, ChildMap::new(fronts[child].border.iter().map(|&i| places[i]))?));
        }
        front.note_kept();
        fronts.push(front);
    }
    Some(fronts)
}

/// Factorises a task: a subtree, or one front whose children are done.
struct FactorSubtree<'a> {
    fronts: &'a [Front],
    values: &'a [f64],
    change: Change,
    task: &'a SubtreeTask,
    factors: &'a [Mutex<Factor>],
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
            // Deferred rows are needed as they were.
            let same_rows = change == Change::Diagonal && !own.broke_down && own.null_space.rank == front.rows.len();
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

/// Columns of the lower triangle of the Schur complement.
#[inline(always)]
fn schur_columns<'a>(front: &'a Front, numbers: &'a [f64]) -> impl Iterator<Item = &'a [f64]> {
    let end = front.slots();
    (front.pivot_slots()..end).map(move |c| &numbers[front.reduced + c * front.wide..][c..end])
}

/// Adds the Schur complements of the children of front `f`; false when one of them broke down. The first front of a task
/// finds them with its children, the others on top of the stack.
#[inline(always)]
fn add_children(
    fronts: &[Front],
    f: usize,
    numbers: &mut [f64],
    factors: &[Mutex<Factor>],
    stack: &mut Vec<f64>,
) -> bool {
    let front = &fronts[f];
    // What waits on the stack.
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

/// Factorises the assembled front; false when it breaks down. `same_rows`: its rows are those of the last matrix.
#[inline(always)]
fn factor_front<S: Simd>(
    simd: S,
    front: &Front,
    numbers: &mut [f64],
    own: &mut Factor,
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

/// Adds a child's Schur complement. Its border is in elimination order, in which a front's variables come before its
/// slots, so places that are slots ascend.
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
                numbers[front.offset(Place::Variable(variable), Place::Variable(other))] += value;
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
        self.neglected.iter().all(|&q| values[q as usize].abs() <= LARGEST_DIAGONAL)
    }

    fn factor(&mut self, values: &[f64], change: Change) -> Option<Inertia> {
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
            // Whoever asks sees it in the residual.
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
