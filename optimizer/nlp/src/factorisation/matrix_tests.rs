//! Factorisations of matrices with known inertia; inaccurate ones must show in the inertia or the residual.

use super::delayed_pivots::DelayedPivots;
use super::front::{PivotKind, RoomForDeferred};
use super::kkt_solver::{Inertia, KktSolver, MatrixChange};
use super::multifrontal::Multifrontal;
#[cfg(feature = "supernodal")]
use super::supernodal::Supernodal;

/// Deterministic uniform numbers in (-1, 1).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// A symmetric matrix, lower triangle by columns.
struct Matrix {
    starts: Vec<usize>,
    rows: Vec<usize>,
    values: Vec<f64>,
}

impl Matrix {
    fn from_dense(a: &[Vec<f64>]) -> Self {
        let (mut starts, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
        for j in 0..a.len() {
            for i in j..a.len() {
                if a[i][j] != 0.0 || i == j {
                    rows.push(i);
                    values.push(a[i][j]);
                }
            }
            starts.push(rows.len());
        }
        Self { starts, rows, values }
    }

    fn product(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        for j in 0..x.len() {
            for q in self.starts[j]..self.starts[j + 1] {
                let i = self.rows[q];
                y[i] += self.values[q] * x[j];
                if i != j {
                    y[j] += self.values[q] * x[i];
                }
            }
        }
        y
    }

    /// Every factorisation; fronts of `width` indices in a chain.
    fn solvers(&self, width: usize) -> Vec<(&'static str, Box<dyn KktSolver>)> {
        let order = self.starts.len() - 1;
        let front_of: Vec<usize> = (0..order).map(|i| i / width).collect();
        let mut solvers: Vec<(&'static str, Box<dyn KktSolver>)> = Vec::new();
        #[cfg(feature = "supernodal")]
        if order > 1 {
            let own = Some((0..order).collect());
            solvers.push(("supernodal, AMD", Box::new(Supernodal::new(&self.starts, &self.rows, None).unwrap())));
            solvers.push(("supernodal, own order", Box::new(Supernodal::new(&self.starts, &self.rows, own).unwrap())));
        }
        let kinds = vec![PivotKind::Other; order];
        let frontal = Multifrontal::new(&self.starts, &self.rows, &front_of, &kinds, RoomForDeferred::Full, 1).unwrap();
        solvers.push(("multifrontal", Box::new(frontal)));
        let dense =
            Multifrontal::new(&self.starts, &self.rows, &vec![0; order], &kinds, RoomForDeferred::Full, 1).unwrap();
        solvers.push(("one front", Box::new(dense)));
        let delayed = DelayedPivots::new(&self.starts, &self.rows, &front_of);
        solvers.push(("delayed pivots", Box::new(delayed)));
        solvers
    }

    /// Relative residual of a random system after `refinements`.
    fn residual(&self, solver: &mut dyn KktSolver, refinements: usize) -> f64 {
        let mut random = Random(99);
        let b: Vec<f64> = (0..self.starts.len() - 1).map(|_| random.next()).collect();
        let mut x = b.clone();
        solver.solve(&mut x);
        let size = |v: &[f64]| v.iter().fold(0.0, |m: f64, a| if a.is_nan() { f64::INFINITY } else { m.max(a.abs()) });
        let mut worst = f64::INFINITY;
        for step in 0..=refinements {
            let mut r: Vec<f64> = self.product(&x).iter().zip(&b).map(|(a, b)| b - a).collect();
            worst = size(&r) / size(&b);
            if step < refinements {
                solver.solve(&mut r);
                for (x, d) in x.iter_mut().zip(&r) {
                    *x += d;
                }
            }
        }
        worst
    }
}

/// A = L D L^T with sparse unit lower L: inertia by Sylvester's law from the signs of D.
fn with_inertia(order: usize, negative: usize, seed: u64) -> Matrix {
    let mut random = Random(seed);
    let mut l = vec![vec![0.0; order]; order];
    for i in 0..order {
        l[i][i] = 1.0;
        for j in i.saturating_sub(9)..i {
            if random.next() > 0.2 {
                l[i][j] = random.next();
            }
        }
    }
    let d: Vec<f64> = (0..order)
        .map(|k| {
            let steps = (k + 1) * negative / order - k * negative / order;
            let sign = if steps > 0 { -1.0 } else { 1.0 };
            sign * (0.5 + random.next().abs())
        })
        .collect();
    let mut a = vec![vec![0.0; order]; order];
    for i in 0..order {
        for j in 0..=i {
            a[i][j] = (0..=j).map(|k| l[i][k] * d[k] * l[j][k]).sum();
        }
    }
    Matrix::from_dense(&a)
}

#[test]
fn inertia_of_random_matrices_is_right() {
    for (order, negative) in [(1, 0), (1, 1), (40, 13), (150, 75), (301, 20), (400, 399)] {
        for seed in 1..6 {
            let matrix = with_inertia(order, negative, seed);
            for (name, mut solver) in matrix.solvers(23) {
                let inertia = solver.factor(&matrix.values, MatrixChange::Any);
                assert_eq!(
                    inertia,
                    Some(Inertia { positive: order - negative, negative, zero: 0 }),
                    "{name}, order {order}, seed {seed}"
                );
                let residual = matrix.residual(solver.as_mut(), 1);
                assert!(residual < 1e-9, "{name}, order {order}, seed {seed}: {residual}");
            }
        }
    }
}

/// [diag(sigma) + H, J^T; J, -delta], interleaved in chunks of 4 variables and 3 rows; with `repeat` the last two
/// rows are equal.
fn saddle(chunks: usize, spread: f64, delta: f64, repeat: bool) -> Matrix {
    let mut random = Random(5);
    let order = 7 * chunks;
    let mut a = vec![vec![0.0; order]; order];
    for k in 0..chunks {
        let base = 7 * k;
        for i in 0..4 {
            let exponent = 0.5 * (random.next() + 1.0) * spread.log10();
            a[base + i][base + i] = 10f64.powf(exponent - 0.5 * spread.log10());
            for j in 0..i {
                // Diagonally dominant after scaling: the Hessian is positive definite.
                let scale = (a[base + i][base + i] * a[base + j][base + j]).sqrt();
                a[base + i][base + j] = 0.2 * scale * random.next();
            }
        }
        for i in 4..7 {
            for j in 0..4 {
                a[base + i][base + j] = random.next() + if i == j + 4 { 2.0 } else { 0.0 };
            }
            if k > 0 {
                a[base + i][base - 7 + i - 4] = -1.0;
            }
            a[base + i][base + i] = -delta;
        }
    }
    if repeat {
        // The last row becomes a copy of the one before.
        let last = order - 1;
        for j in 0..order - 2 {
            a[last][j] = a[last - 1][j];
        }
        a[last][last - 1] = 0.0;
    }
    Matrix::from_dense(&a)
}

#[test]
fn saddle_matrices_with_barrier_spread_are_solved() {
    for chunks in [5, 60] {
        for spread in [1.0, 1e6, 1e12] {
            let matrix = saddle(chunks, spread, 1e-8, false);
            for (name, mut solver) in matrix.solvers(7) {
                let inertia = solver.factor(&matrix.values, MatrixChange::Any);
                assert_eq!(
                    inertia,
                    Some(Inertia { positive: 4 * chunks, negative: 3 * chunks, zero: 0 }),
                    "{name}, {chunks} chunks, spread {spread}"
                );
                let residual = matrix.residual(solver.as_mut(), 3);
                assert!(residual < 1e-7, "{name}, {chunks} chunks, spread {spread}: {residual}");
            }
        }
    }
}

#[test]
fn singular_matrices_show_in_inertia_or_residual() {
    for chunks in [1, 5, 60] {
        let matrix = saddle(chunks, 1e3, 0.0, true);
        for (name, mut solver) in matrix.solvers(7) {
            let Some(inertia) = solver.factor(&matrix.values, MatrixChange::Any) else { continue };
            let expected = Inertia { positive: 4 * chunks, negative: 3 * chunks, zero: 0 };
            let residual = matrix.residual(solver.as_mut(), 3);
            assert!(inertia != expected || residual > 1e-5, "{name}, {chunks} chunks: {inertia:?}, {residual}");
        }
    }
    // All zero, with a coupling in its pattern.
    let mut zero = Matrix::from_dense(&vec![vec![1.0; 4]; 4]);
    zero.values.fill(0.0);
    for (name, mut solver) in zero.solvers(2) {
        let inertia = solver.factor(&zero.values, MatrixChange::Any);
        assert!(inertia.is_none_or(|i| i.zero > 0), "{name}: {inertia:?}");
    }
}

#[test]
fn factorisations_do_not_depend_on_earlier_ones() {
    let (a, b) = (saddle(20, 1e6, 1e-8, false), saddle(20, 1.0, 1e-8, false));
    for ((name, mut used), (_, mut fresh)) in a.solvers(7).into_iter().zip(a.solvers(7)) {
        used.factor(&b.values, MatrixChange::Any);
        used.factor(&vec![f64::NAN; a.values.len()], MatrixChange::Any);
        assert_eq!(used.factor(&a.values, MatrixChange::Any), fresh.factor(&a.values, MatrixChange::Any), "{name}");
        let rhs: Vec<f64> = (0..140).map(f64::from).collect();
        let (mut x, mut y) = (rhs.clone(), rhs);
        used.solve(&mut x);
        fresh.solve(&mut y);
        assert_eq!(x, y, "{name}");
    }
}

#[test]
fn results_are_bit_for_bit_the_same_for_every_number_of_threads() {
    // Eight independent chains under one root, large enough for threads.
    let (chains, length) = (8, 220);
    let order = chains * length + 40;
    let mut random = Random(11);
    let (mut starts, mut rows, mut values, mut front_of) = (vec![0], Vec::new(), Vec::new(), Vec::new());
    for j in 0..order {
        let chain = j / length;
        rows.push(j);
        values.push(if j % 3 == 0 { -2.0 } else { 2.0 } + random.next());
        if chain < chains {
            let end = (chain + 1) * length;
            for i in j + 1..end.min(j + 100) {
                rows.push(i);
                values.push(0.1 * random.next());
            }
        }
        for i in (chains * length).max(j + 1)..order {
            rows.push(i);
            values.push(0.1 * random.next());
        }
        front_of.push(if chain < chains { 2 * chain + (j % length) / (length / 2) } else { 2 * chains });
        starts.push(rows.len());
    }
    let kinds = vec![PivotKind::Other; order];
    let solve_with = |threads| {
        let mut solver = Multifrontal::new(&starts, &rows, &front_of, &kinds, RoomForDeferred::Full, threads).unwrap();
        let inertia = solver.factor(&values, MatrixChange::Any).unwrap();
        let mut x: Vec<f64> = (0..order).map(|i| (i % 17) as f64).collect();
        solver.solve(&mut x);
        (inertia, x)
    };
    let one = solve_with(1);
    for threads in 2..6 {
        assert!(one == solve_with(threads), "{threads} threads");
    }
}

/// A KKT matrix of `points` blocks below one root: each block has nearly as many equality rows as variables, two
/// inequality rows with a small diagonal, a fixed variable (unit pivot, no row), and couples with ten root variables.
fn kkt_of_points(points: usize, hessian: f64) -> (Matrix, Vec<usize>, Vec<PivotKind>) {
    let (variables, equalities, inequalities, shared) = (24, 22, 2, 10);
    let per_point = variables + equalities + inequalities;
    let order = points * per_point + shared;
    let mut random = Random(23);
    let (mut starts, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
    let (mut front_of, mut kinds) = (Vec::new(), Vec::new());
    for j in 0..order {
        let (point, own) = (j / per_point, j % per_point);
        let mut entry = |i: usize, v: f64| {
            rows.push(i);
            values.push(v);
        };
        if point == points {
            kinds.push(PivotKind::Variable);
            entry(j, 3.0 + random.next());
        } else if own < variables {
            kinds.push(PivotKind::Variable);
            entry(j, if own == 0 { 1.0 } else { hessian * random.next() });
            let end = (point + 1) * per_point;
            for i in j + 1..end {
                let is_row = i % per_point >= variables;
                if own > 0 && (is_row || i % 3 == 0) {
                    entry(i, if is_row { random.next() } else { hessian * random.next() });
                }
            }
        } else {
            let equality = own < variables + equalities;
            kinds.push(if equality { PivotKind::Equality } else { PivotKind::Other });
            entry(j, if equality { 0.0 } else { -1e-6 });
        }
        for i in (points * per_point).max(j + 1)..order {
            if own > 0 {
                entry(i, random.next());
            }
        }
        front_of.push(point);
        starts.push(rows.len());
    }
    (Matrix { starts, rows, values }, front_of, kinds)
}

#[test]
fn null_space_stage_gives_the_same_solution_as_bunch_kaufman() {
    for hessian in [0.0, 1.0, 1e3] {
        let (matrix, front_of, kinds) = kkt_of_points(6, hessian);
        let alike = vec![PivotKind::Other; kinds.len()];
        let mut one =
            Multifrontal::new(&matrix.starts, &matrix.rows, &front_of, &alike, RoomForDeferred::Full, 1).unwrap();
        let mut two =
            Multifrontal::new(&matrix.starts, &matrix.rows, &front_of, &kinds, RoomForDeferred::Full, 1).unwrap();
        assert!(two.suits(&matrix.values));
        assert_eq!(
            one.factor(&matrix.values, MatrixChange::Any).unwrap(),
            two.factor(&matrix.values, MatrixChange::Any).unwrap(),
            "H {hessian}"
        );
        let mut neglected = vec![false; kinds.len()];
        two.mark_neglected(&mut neglected);
        assert_eq!(neglected.iter().filter(|n| **n).count(), 6 * 22);
        let right: Vec<f64> = (0..kinds.len()).map(|i| (i % 13) as f64 - 6.0).collect();
        let (mut x, mut y) = (right.clone(), right);
        one.solve(&mut x);
        two.solve(&mut y);
        let size = x.iter().fold(0.0f64, |a, v| a.max(v.abs()));
        for (x, y) in x.iter().zip(&y) {
            assert!((x - y).abs() <= 1e-7 * size, "H {hessian}: {x} {y}");
        }
    }
}

#[test]
fn multifrontal_does_not_suit_rows_with_large_diagonals() {
    let (mut matrix, front_of, kinds) = kkt_of_points(2, 1.0);
    let row = kinds.iter().position(|k| *k == PivotKind::Equality).unwrap();
    let solver = Multifrontal::new(&matrix.starts, &matrix.rows, &front_of, &kinds, RoomForDeferred::Full, 1).unwrap();
    assert!(solver.suits(&matrix.values));
    matrix.values[matrix.starts[row]] = -0.1;
    assert!(!solver.suits(&matrix.values));
}

#[test]
fn dependent_rows_are_deferred() {
    // Two equal rows in one block: the pivot of the second is the regularisation.
    let (mut matrix, front_of, kinds) = kkt_of_points(2, 1.0);
    let (first, second) = (24, 25);
    for j in 0..24 {
        let range = matrix.starts[j]..matrix.starts[j + 1];
        let of_first = range.clone().find(|&q| matrix.rows[q] == first);
        let of_second = range.clone().find(|&q| matrix.rows[q] == second);
        if let (Some(a), Some(b)) = (of_first, of_second) {
            matrix.values[b] = matrix.values[a];
        }
    }
    matrix.values[matrix.starts[second]] = -1e-7;
    let mut solver =
        Multifrontal::new(&matrix.starts, &matrix.rows, &front_of, &kinds, RoomForDeferred::Full, 1).unwrap();
    let alike = vec![PivotKind::Other; kinds.len()];
    let mut one = Multifrontal::new(&matrix.starts, &matrix.rows, &front_of, &alike, RoomForDeferred::Full, 1).unwrap();
    assert_eq!(
        solver.factor(&matrix.values, MatrixChange::Any).unwrap(),
        one.factor(&matrix.values, MatrixChange::Any).unwrap()
    );
    let mut neglected = vec![false; kinds.len()];
    solver.mark_neglected(&mut neglected);
    assert_eq!(neglected.iter().filter(|n| **n).count(), 2 * 22 - 1);
}

#[test]
fn reuse_after_a_diagonal_change_gives_the_same_bits_as_a_new_factorisation() {
    let (matrix, front_of, kinds) = kkt_of_points(6, 1.0);
    let mut heavier = matrix.values.clone();
    for (j, kind) in kinds.iter().enumerate() {
        heavier[matrix.starts[j]] += if *kind == PivotKind::Variable { 0.3 } else { -1e-8 };
    }
    let new = || Multifrontal::new(&matrix.starts, &matrix.rows, &front_of, &kinds, RoomForDeferred::Full, 1).unwrap();
    let (mut used, mut fresh) = (new(), new());
    used.factor(&matrix.values, MatrixChange::Any).unwrap();
    assert_eq!(used.factor(&heavier, MatrixChange::Diagonal), fresh.factor(&heavier, MatrixChange::Any));
    let right: Vec<f64> = (0..kinds.len()).map(|i| (i % 13) as f64 - 6.0).collect();
    let (mut x, mut y) = (right.clone(), right);
    used.solve(&mut x);
    fresh.solve(&mut y);
    assert_eq!(x, y);
}

/// A chain of fronts, each with two variables and two rows whose Jacobian is singular up to `regular`.
fn ill_conditioned_fronts(count: usize, regular: f64) -> (Matrix, Vec<usize>) {
    let order = 5 * count + 2;
    let mut random = Random(3);
    let mut a = vec![vec![0.0; order]; order];
    for k in 0..count {
        let (at, next) = (5 * k, 5 * (k + 1));
        for i in 0..2 {
            a[at + i][at + i] = 1.0 + random.next();
            for r in 2..4 {
                a[at + r][at + i] = 1.0 + if i + 2 == r { regular } else { 0.0 };
            }
            for border in [next, next + 1] {
                a[border][at + 2 + i] = random.next();
                a[border][at + i] = random.next();
            }
        }
        a[at + 4][at + 4] = -1.0;
        a[next][at + 4] = random.next();
    }
    for i in order - 2..order {
        a[i][i] = 2.0 + random.next();
    }
    (Matrix::from_dense(&a), (0..order).map(|i| i / 5).collect())
}

#[test]
fn delayed_pivots_have_the_right_inertia_where_static_ones_do_not() {
    let mut wrong = 0;
    for regular in [1e-3, 1e-6, 1e-9, 1e-11] {
        let (matrix, front_of) = ill_conditioned_fronts(8, regular);
        let order = front_of.len();
        let kinds = vec![PivotKind::Other; order];
        let mut one =
            Multifrontal::new(&matrix.starts, &matrix.rows, &vec![0; order], &kinds, RoomForDeferred::Full, 1).unwrap();
        let mut fronts =
            Multifrontal::new(&matrix.starts, &matrix.rows, &front_of, &kinds, RoomForDeferred::Full, 1).unwrap();
        let mut delayed = DelayedPivots::new(&matrix.starts, &matrix.rows, &front_of);
        let right = one.factor(&matrix.values, MatrixChange::Any).unwrap();
        assert_eq!(delayed.factor(&matrix.values, MatrixChange::Any), Some(right), "{regular}");
        let residual = matrix.residual(&mut delayed, 0);
        assert!(residual < 1e-11, "{regular}: {residual}");
        if fronts.factor(&matrix.values, MatrixChange::Any) != Some(right) {
            wrong += 1;
            let residual = matrix.residual(&mut fronts, 0);
            assert!(residual > 1e-5, "wrong inertia with a small residual, {regular}: {residual}");
        }
    }
    assert!(wrong > 0, "no matrix had a wrong inertia with static pivots");
}
