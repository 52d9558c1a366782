//! Static multifrontal LBL^T over a given partition of the indices into fronts.
//!
//! Front f eliminates its pivots p with a border b of later indices, by dense Bunch-Kaufman (faer) on its assembled
//! pivot block, P A_pp P^T = L B L^T:
//!
//! ```text
//! W = A_bp P^T L^-T,   X = W B^-1,   update to the parent: A_bb - X W^T
//! ```
//!
//! Inertia adds over the fronts (Haynsworth). Pivots are never delayed to the parent: a front whose pivot block is
//! singular breaks the factorisation down (`None`), one that is nearly so shows in the residual, and either way the
//! caller regularises or changes the method.
//!
//! Independent subtrees are factorised by several threads. Each front is computed by one thread, from its own entries
//! and then its children in fixed order, so the result is bit for bit that of one thread.

use faer::diag::DiagMut;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::lblt::factor as lblt;
use faer::linalg::matmul::triangular::{BlockStructure, matmul as triangular_matmul};
use faer::linalg::triangular_solve::{solve_unit_lower_triangular_in_place, solve_unit_upper_triangular_in_place};
use faer::{Accum, MatMut, MatRef, Par, Spec};

use super::kkt_solver::{Inertia, KktSolver};
use super::status::NlpError;

/// Operations below which starting threads costs more than it saves.
const WORTH_A_THREAD: f64 = 2e7;

/// Structure of a front.
#[derive(Debug)]
struct Front {
    /// Indices eliminated here, and those of the border, by elimination order.
    pivots: Vec<usize>,
    border: Vec<usize>,
    /// (position in the matrix values, offset in the panel).
    sources: Vec<(u32, u32)>,
    /// Child front and the local index of each entry of its border.
    children: Vec<(usize, Vec<u32>)>,
    flops: f64,
}

/// Numbers of a front.
#[derive(Debug, Default)]
struct Factor {
    /// (pivots + border) x pivots, column-major: L and the diagonal of B above, X below.
    panel: Vec<f64>,
    /// border x border, column-major, lower triangle.
    update: Vec<f64>,
    /// Subdiagonal of B.
    subdiagonal: Vec<f64>,
    forward: Vec<usize>,
    inverse: Vec<usize>,
    inertia: Inertia,
    broke_down: bool,
}

/// Workspace of one thread.
struct Workspace {
    w: Vec<f64>,
    memory: MemBuffer,
}

/// Something a thread can do independently, or the sequential top of the forest.
#[derive(Debug, Clone, Copy)]
struct Piece {
    /// Range of fronts.
    start: usize,
    end: usize,
    /// Thread that does it; `None`: after all the others.
    thread: Option<usize>,
}

/// Analysis, factor and workspace.
pub(super) struct Multifrontal {
    order: usize,
    fronts: Vec<Front>,
    factors: Vec<Factor>,
    pieces: Vec<Piece>,
    workspaces: Vec<Workspace>,
    segment: Vec<f64>,
    border_values: Vec<f64>,
}

impl Multifrontal {
    /// Analyses the lower triangle. `front_of` gives each index its front; fronts are eliminated by ascending number
    /// as far as their couplings demand.
    pub(super) fn new(
        column_starts: &[usize],
        row_indices: &[usize],
        front_of: &[usize],
        threads: usize,
    ) -> Result<Self, NlpError> {
        let order = column_starts.len() - 1;
        let fail = |reason: &str| NlpError::Analysis { order, reason: reason.to_owned() };
        let members = postordered(column_starts, row_indices, front_of);
        let fronts = analyse(column_starts, row_indices, members).ok_or_else(|| fail("a front is too large"))?;
        let factors = fronts
            .iter()
            .map(|f| {
                let (p, b) = (f.pivots.len(), f.border.len());
                Factor {
                    panel: vec![0.0; (p + b) * p],
                    update: vec![0.0; b * b],
                    subdiagonal: vec![0.0; p],
                    forward: (0..p).collect(),
                    inverse: (0..p).collect(),
                    ..Factor::default()
                }
            })
            .collect();
        let flops: f64 = fronts.iter().map(|f| f.flops).sum();
        let threads = if flops < WORTH_A_THREAD { 1 } else { threads.max(1) };
        let widest = fronts.iter().map(|f| f.pivots.len()).max().unwrap_or(0);
        let largest_panel = fronts.iter().map(|f| f.pivots.len() * f.border.len()).max().unwrap_or(0);
        let mut workspaces = Vec::new();
        for _ in 0..threads {
            let request = lblt::cholesky_in_place_scratch::<usize, f64>(widest, Par::Seq, Spec::default());
            let memory = MemBuffer::try_new(request).map_err(|_| fail("not enough memory"))?;
            workspaces.push(Workspace { w: vec![0.0; largest_panel], memory });
        }
        let pieces = schedule(&fronts, threads);
        let widest_border = fronts.iter().map(|f| f.border.len()).max().unwrap_or(0);
        Ok(Self {
            order,
            pieces,
            factors,
            workspaces,
            segment: vec![0.0; widest],
            border_values: vec![0.0; widest_border],
            fronts,
        })
    }

    /// Multiplications and additions of a factorisation.
    pub(super) fn flops(&self) -> f64 {
        self.fronts.iter().map(|f| f.flops).sum()
    }
}

/// Members of each front, fronts renumbered so that every subtree of the front forest is contiguous and ends with its
/// root.
fn postordered(column_starts: &[usize], row_indices: &[usize], front_of: &[usize]) -> Vec<Vec<usize>> {
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

fn analyse(column_starts: &[usize], row_indices: &[usize], members: Vec<Vec<usize>>) -> Option<Vec<Front>> {
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
    let mut local = vec![0u32; order];
    for (f, pivots) in members.into_iter().enumerate() {
        let mut border: Vec<usize> = entries[f].iter().map(|e| e.2).filter(|&i| front_of[i] != f).collect();
        for &child in &children[f] {
            border.extend(fronts[child].border.iter().copied().filter(|&i| front_of[i] != f));
        }
        border.sort_unstable_by_key(|&i| rank[i]);
        border.dedup();
        if let Some(&i) = border.first() {
            children[front_of[i]].push(f);
        }
        let height = pivots.len() + border.len();
        u32::try_from(height * height).ok()?;
        for (k, &i) in pivots.iter().chain(&border).enumerate() {
            local[i] = u32::try_from(k).ok()?;
        }
        let mut sources = Vec::with_capacity(entries[f].len());
        for &(q, first, last) in &entries[f] {
            let offset = local[first] as usize * height + local[last] as usize;
            sources.push((u32::try_from(q).ok()?, u32::try_from(offset).ok()?));
        }
        let kids = children[f].iter().map(|&c| (c, fronts[c].border.iter().map(|&i| local[i]).collect())).collect();
        let flops = (0..pivots.len()).map(|k| ((height - k) as f64).powi(2)).sum();
        fronts.push(Front { pivots, border, sources, children: kids, flops });
    }
    Some(fronts)
}

/// Cuts the forest into subtrees for the threads and a sequential top: the heaviest subtree is split until no subtree
/// is larger than a quarter of a thread's share; subtrees go to the least loaded thread, heaviest first.
fn schedule(fronts: &[Front], threads: usize) -> Vec<Piece> {
    let count = fronts.len();
    let (mut weight, mut start): (Vec<f64>, Vec<usize>) = (vec![0.0; count], (0..count).collect());
    let mut has_parent = vec![false; count];
    for f in 0..count {
        weight[f] = fronts[f].flops;
        for (child, _) in &fronts[f].children {
            weight[f] += weight[*child];
            start[f] = start[f].min(start[*child]);
            has_parent[*child] = true;
        }
    }
    let mut subtrees: Vec<usize> = (0..count).filter(|&f| !has_parent[f]).collect();
    let mut top = Vec::new();
    if threads > 1 {
        let limit = subtrees.iter().map(|&f| weight[f]).sum::<f64>() / (4 * threads) as f64;
        while let Some(k) = subtrees.iter().position(|&f| weight[f] > limit && !fronts[f].children.is_empty()) {
            let f = subtrees.swap_remove(k);
            top.push(f);
            subtrees.extend(fronts[f].children.iter().map(|c| c.0));
        }
    }
    subtrees.sort_unstable_by(|a, b| weight[*b].total_cmp(&weight[*a]).then(a.cmp(b)));
    let mut load = vec![0.0; threads];
    let mut pieces: Vec<Piece> = top.iter().map(|&f| Piece { start: f, end: f + 1, thread: None }).collect();
    for f in subtrees {
        let mut thread = 0;
        for t in 1..threads {
            if load[t] < load[thread] {
                thread = t;
            }
        }
        load[thread] += weight[f];
        pieces.push(Piece { start: start[f], end: f + 1, thread: Some(thread) });
    }
    pieces.sort_unstable_by_key(|p| p.start);
    pieces
}

/// Factorises front `own` (its children are in `before`, which begins with front number `base`).
fn factor_front(front: &Front, values: &[f64], before: &[Factor], base: usize, own: &mut Factor, work: &mut Workspace) {
    let (p, b) = (front.pivots.len(), front.border.len());
    let height = p + b;
    own.panel.fill(0.0);
    own.update.fill(0.0);
    own.inertia = Inertia::default();
    own.broke_down = true;
    for &(q, offset) in &front.sources {
        own.panel[offset as usize] += values[q as usize];
    }
    for (child, map) in &front.children {
        let child = &before[child - base];
        if child.broke_down {
            return;
        }
        let width = map.len();
        for (column, &local) in map.iter().enumerate() {
            let local = local as usize;
            let source = &child.update[column * width + column..(column + 1) * width];
            // Local indices ascend with the child's border, so lower stays lower.
            let target = if local < p { &mut own.panel[local * height..] } else { &mut own.update[(local - p) * b..] };
            let shift = if local < p { 0 } else { p };
            for (v, &row) in source.iter().zip(&map[column..]) {
                target[row as usize - shift] += v;
            }
        }
    }
    // The kernel writes the subdiagonal of pairs only.
    own.subdiagonal.fill(0.0);
    lblt::cholesky_in_place(
        MatMut::from_column_major_slice_mut(&mut own.panel, height, p).subrows_mut(0, p),
        DiagMut::from_slice_mut(&mut own.subdiagonal),
        &mut own.forward,
        &mut own.inverse,
        Par::Seq,
        MemStack::new(&mut work.memory),
        Spec::default(),
    );
    let mut j = 0;
    while j < p {
        let e = own.subdiagonal[j];
        if e != 0.0 && j + 1 < p {
            own.inertia.count_pair(own.panel[j * height + j], e, own.panel[(j + 1) * height + j + 1]);
            j += 2;
        } else {
            own.inertia.count(own.panel[j * height + j]);
            j += 1;
        }
    }
    if b > 0 {
        let w = &mut work.w[..b * p];
        for j in 0..p {
            let source = own.forward[j] * height + p;
            w[j * b..(j + 1) * b].copy_from_slice(&own.panel[source..source + b]);
        }
        let l = MatRef::from_column_major_slice(&own.panel, height, p).subrows(0, p);
        solve_unit_lower_triangular_in_place(l, MatMut::from_column_major_slice_mut(w, b, p).transpose_mut(), Par::Seq);
        divide_columns(&mut own.panel, &own.subdiagonal, p, b, w);
        let w = MatRef::from_column_major_slice(&*w, b, p);
        let x = MatRef::from_column_major_slice(&own.panel, height, p).subrows(p, b);
        triangular_matmul(
            MatMut::from_column_major_slice_mut(&mut own.update, b, b),
            BlockStructure::TriangularLower,
            Accum::Add,
            x,
            BlockStructure::Rectangular,
            w.transpose(),
            BlockStructure::Rectangular,
            -1.0,
            Par::Seq,
        );
    }
    own.broke_down = !own.panel.iter().all(|v| v.is_finite());
}

/// X = W B^-1, X being the lower part of the panel.
fn divide_columns(panel: &mut [f64], subdiagonal: &[f64], p: usize, b: usize, w: &[f64]) {
    let height = p + b;
    let mut j = 0;
    while j < p {
        let e = subdiagonal[j];
        let diagonal = panel[j * height + j];
        if e != 0.0 && j + 1 < p {
            let (inverse_a, inverse_e, inverse_d) = inverse_pair(diagonal, e, panel[(j + 1) * height + j + 1]);
            for r in 0..b {
                let (u, v) = (w[j * b + r], w[(j + 1) * b + r]);
                panel[j * height + p + r] = inverse_a * u + inverse_e * v;
                panel[(j + 1) * height + p + r] = inverse_e * u + inverse_d * v;
            }
            j += 2;
        } else {
            let inverse = 1.0 / diagonal;
            for r in 0..b {
                panel[j * height + p + r] = inverse * w[j * b + r];
            }
            j += 1;
        }
    }
}

/// Inverse of [a e; e d] as (first, off-diagonal, last), scaled by e against overflow.
fn inverse_pair(a: f64, e: f64, d: f64) -> (f64, f64, f64) {
    let (ra, rd) = (a / e, d / e);
    let r = 1.0 / (e * (ra * rd - 1.0));
    (rd * r, -r, ra * r)
}

/// Factorises fronts [start, end) whose children all lie in the range.
fn factor_piece(
    fronts: &[Front],
    start: usize,
    end: usize,
    values: &[f64],
    factors: &mut [Factor],
    work: &mut Workspace,
) {
    for f in start..end {
        let (before, rest) = factors.split_at_mut(f - start);
        if let Some(own) = rest.first_mut() {
            factor_front(&fronts[f], values, before, start, own, work);
        }
    }
}

impl KktSolver for Multifrontal {
    fn factor(&mut self, values: &[f64]) -> Option<Inertia> {
        let fronts = &self.fronts;
        let threads = self.workspaces.len();
        // Disjoint slices of the factors, one per piece, dealt to the threads.
        let mut hands: Vec<Vec<(Piece, &mut [Factor])>> = (0..threads).map(|_| Vec::new()).collect();
        let mut rest = self.factors.as_mut_slice();
        let mut at = 0;
        for piece in &self.pieces {
            let (_, tail) = rest.split_at_mut(piece.start - at);
            let (own, tail) = tail.split_at_mut(piece.end - piece.start);
            if let Some(thread) = piece.thread {
                hands[thread].push((*piece, own));
            }
            rest = tail;
            at = piece.end;
        }
        let play = |hand: Vec<(Piece, &mut [Factor])>, work: &mut Workspace| {
            for (piece, factors) in hand {
                factor_piece(fronts, piece.start, piece.end, values, factors, work);
            }
        };
        std::thread::scope(|scope| {
            let mut players = hands.into_iter().zip(&mut self.workspaces);
            let first = players.next();
            for (hand, work) in players.filter(|(hand, _)| !hand.is_empty()) {
                scope.spawn(move || play(hand, work));
            }
            if let Some((hand, work)) = first {
                play(hand, work);
            }
        });
        if let Some(work) = self.workspaces.first_mut() {
            for piece in self.pieces.iter().filter(|p| p.thread.is_none()) {
                let (before, rest) = self.factors.split_at_mut(piece.start);
                if let Some(own) = rest.first_mut() {
                    factor_front(&self.fronts[piece.start], values, before, 0, own, work);
                }
            }
        }
        let mut inertia = Inertia::default();
        for factor in &self.factors {
            if factor.broke_down {
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
        for (front, factor) in self.fronts.iter().zip(&self.factors) {
            let (p, b) = (front.pivots.len(), front.border.len());
            let height = p + b;
            let segment = &mut self.segment[..p];
            for (t, &k) in segment.iter_mut().zip(&factor.forward) {
                *t = x[front.pivots[k]];
            }
            let l = MatRef::from_column_major_slice(&factor.panel, height, p).subrows(0, p);
            solve_unit_lower_triangular_in_place(l, MatMut::from_column_major_slice_mut(segment, p, 1), Par::Seq);
            let sums = &mut self.border_values[..b];
            sums.fill(0.0);
            for (j, t) in segment.iter().enumerate() {
                let column = &factor.panel[j * height + p..(j + 1) * height];
                for (s, v) in sums.iter_mut().zip(column) {
                    *s += v * t;
                }
            }
            for (s, &i) in sums.iter().zip(&front.border) {
                x[i] -= s;
            }
            let mut j = 0;
            while j < p {
                let e = factor.subdiagonal[j];
                let diagonal = factor.panel[j * height + j];
                if e != 0.0 && j + 1 < p {
                    let (a, c, d) = inverse_pair(diagonal, e, factor.panel[(j + 1) * height + j + 1]);
                    let (u, v) = (segment[j], segment[j + 1]);
                    segment[j] = a * u + c * v;
                    segment[j + 1] = c * u + d * v;
                    j += 2;
                } else {
                    segment[j] /= diagonal;
                    j += 1;
                }
            }
            for (t, &i) in segment.iter().zip(&front.pivots) {
                x[i] = *t;
            }
        }
        for (front, factor) in self.fronts.iter().zip(&self.factors).rev() {
            let (p, b) = (front.pivots.len(), front.border.len());
            let height = p + b;
            let (segment, values) = (&mut self.segment[..p], &mut self.border_values[..b]);
            for (v, &i) in values.iter_mut().zip(&front.border) {
                *v = x[i];
            }
            for (j, t) in segment.iter_mut().enumerate() {
                let column = &factor.panel[j * height + p..(j + 1) * height];
                *t = x[front.pivots[j]] - dot(column, values);
            }
            let l = MatRef::from_column_major_slice(&factor.panel, height, p).subrows(0, p);
            solve_unit_upper_triangular_in_place(
                l.transpose(),
                MatMut::from_column_major_slice_mut(segment, p, 1),
                Par::Seq,
            );
            for (t, &k) in segment.iter().zip(&factor.forward) {
                x[front.pivots[k]] = *t;
            }
        }
    }

    fn factor_entries(&self) -> usize {
        self.factors.iter().map(|f| f.panel.len()).sum()
    }
}

/// Dot product in four fixed partial sums.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let tail: f64 = a4.remainder().iter().zip(b4.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a4.zip(b4) {
        for k in 0..4 {
            sums[k] += x[k] * y[k];
        }
    }
    (sums[0] + sums[2]) + (sums[1] + sums[3]) + tail
}
