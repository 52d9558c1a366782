//! Sparse problems as sums of terms in few variables, with elimination blocks: optimal control by the trapezoidal rule.

use interior_point::{EliminationBlocks, NonlinearProgram, SparsityPattern};

use super::{Dual, INF};

/// A scalar function of a few variables.
pub struct Term {
    pub variables: Vec<usize>,
    pub function: Box<dyn Fn(&[Dual]) -> Dual + Sync>,
}

impl Term {
    pub fn new(variables: Vec<usize>, function: impl Fn(&[Dual]) -> Dual + Sync + 'static) -> Self {
        Self { variables, function: Box::new(function) }
    }

    fn evaluate(&self, x: &[f64], i: usize, j: usize) -> Dual {
        let mut point = [Dual::constant(0.0); 32];
        for (p, v) in point.iter_mut().zip(&self.variables) {
            p.v = x[*v];
        }
        if i < 32 {
            point[i].a = 1.0;
        }
        if j < 32 {
            point[j].b = 1.0;
        }
        (self.function)(&point[..self.variables.len()])
    }
}

/// Sum of objective terms, one term per row.
pub struct Sparse {
    pub start: Vec<f64>,
    pub lower: Vec<f64>,
    pub upper: Vec<f64>,
    pub row_lower: Vec<f64>,
    pub row_upper: Vec<f64>,
    pub blocks: Option<EliminationBlocks>,
    objective: Vec<Term>,
    rows: Vec<Term>,
    jacobian: SparsityPattern,
    hessian: SparsityPattern,
}

fn position(pattern: &SparsityPattern, i: usize, j: usize) -> usize {
    let range = pattern.column_starts[j]..pattern.column_starts[j + 1];
    range.start + pattern.row_indices[range].binary_search(&i).unwrap()
}

impl Sparse {
    pub fn new(start: Vec<f64>, objective: Vec<Term>, rows: Vec<Term>, row_bounds: Vec<(f64, f64)>) -> Self {
        let (n, m) = (start.len(), rows.len());
        let mut jacobian = Vec::new();
        let mut hessian = Vec::new();
        for (i, row) in rows.iter().enumerate() {
            jacobian.extend(row.variables.iter().map(|&j| (i, j)));
        }
        for term in objective.iter().chain(&rows) {
            for &a in &term.variables {
                hessian.extend(term.variables.iter().filter(|&&b| b >= a).map(|&b| (b, a)));
            }
        }
        Self {
            lower: vec![-INF; n],
            upper: vec![INF; n],
            row_lower: row_bounds.iter().map(|b| b.0).collect(),
            row_upper: row_bounds.iter().map(|b| b.1).collect(),
            blocks: None,
            objective,
            rows,
            jacobian: SparsityPattern::from_entries(m, n, &jacobian).0,
            hessian: SparsityPattern::from_entries(n, n, &hessian).0,
            start,
        }
    }
}

impl NonlinearProgram for Sparse {
    fn variables(&self) -> usize {
        self.start.len()
    }
    fn rows(&self) -> usize {
        self.rows.len()
    }
    fn variable_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&self.lower);
        upper.copy_from_slice(&self.upper);
    }
    fn row_bounds(&self, lower: &mut [f64], upper: &mut [f64]) {
        lower.copy_from_slice(&self.row_lower);
        upper.copy_from_slice(&self.row_upper);
    }
    fn jacobian_pattern(&self) -> &SparsityPattern {
        &self.jacobian
    }
    fn hessian_pattern(&self) -> &SparsityPattern {
        &self.hessian
    }
    fn objective(&self, x: &[f64]) -> f64 {
        self.objective.iter().map(|t| t.evaluate(x, 32, 32).v).sum()
    }
    fn gradient(&self, x: &[f64], gradient: &mut [f64]) {
        gradient.fill(0.0);
        for t in &self.objective {
            for (k, &j) in t.variables.iter().enumerate() {
                gradient[j] += t.evaluate(x, k, 32).a;
            }
        }
    }
    fn constraints(&self, x: &[f64], values: &mut [f64]) {
        for (v, t) in values.iter_mut().zip(&self.rows) {
            *v = t.evaluate(x, 32, 32).v;
        }
    }
    fn jacobian(&self, x: &[f64], values: &mut [f64]) {
        values.fill(0.0);
        for (i, t) in self.rows.iter().enumerate() {
            for (k, &j) in t.variables.iter().enumerate() {
                values[position(&self.jacobian, i, j)] += t.evaluate(x, k, 32).a;
            }
        }
    }
    fn hessian(&self, x: &[f64], sigma: f64, multipliers: &[f64], values: &mut [f64]) {
        values.fill(0.0);
        let weighted =
            self.objective.iter().map(|t| (t, sigma)).chain(self.rows.iter().zip(multipliers.iter().copied()));
        for (t, weight) in weighted.filter(|(_, w)| *w != 0.0) {
            for (ka, &a) in t.variables.iter().enumerate() {
                for (kb, &b) in t.variables.iter().enumerate().filter(|(_, b)| **b >= a) {
                    values[position(&self.hessian, b, a)] += weight * t.evaluate(x, ka, kb).ab;
                }
            }
        }
    }
    fn elimination_blocks(&self) -> Option<&EliminationBlocks> {
        self.blocks.as_ref()
    }
}

/// Swing-up of a cart-pole in `intervals` trapezoids of free common duration: minimise T + 0.01 int u^2 dt.
/// Variables per point: x (m), theta (rad), v (m/s), omega (rad/s), u (N); last the duration T (s). `limit`: |u| in N.
/// `copies`: how often each defect row occurs; redundant rows for more than one.
pub fn cart_pole(intervals: usize, limit: f64, copies: usize) -> Sparse {
    let points = intervals + 1;
    let n = 5 * points + 1;
    let duration = n - 1;
    let h = 1.0 / intervals as f64;
    let mut start = vec![0.0; n];
    for k in 0..points {
        let s = k as f64 * h;
        start[5 * k] = s;
        start[5 * k + 1] = s * std::f64::consts::PI;
    }
    start[duration] = 2.0;
    fn rates(s: &[Dual]) -> [Dual; 4] {
        let (cart, pole, length, gravity) = (1.0, 0.3, 0.5, 9.81);
        let (sin, cos) = (s[1].sin(), s[1].cos());
        let mass = cart + pole * sin * sin;
        let push = (s[4] + pole * sin * (length * s[3] * s[3] + gravity * cos)) / mass;
        let turn =
            -(s[4] * cos + pole * length * s[3] * s[3] * cos * sin + (cart + pole) * gravity * sin) / (length * mass);
        [s[2], s[3], push, turn]
    }
    let mut rows = Vec::new();
    let mut block_of_row = Vec::new();
    let (parent, block_of_point) = dissect(points, 4);
    for k in 0..intervals {
        for e in 0..4 {
            for _ in 0..copies {
                let mut variables: Vec<usize> = (5 * k..5 * k + 10).collect();
                variables.push(duration);
                rows.push(Term::new(variables, move |s| {
                    let (a, b) = (rates(&s[..5])[e], rates(&s[5..10])[e]);
                    s[5 + e] - s[e] - 0.5 * h * s[10] * (a + b)
                }));
                block_of_row.push(block_of_point[k].min(block_of_point[k + 1]));
            }
        }
    }
    let mut objective = vec![Term::new(vec![duration], |s| s[0])];
    for k in 0..points {
        let weight = if k == 0 || k == intervals { 0.5 * h } else { h };
        objective.push(Term::new(vec![5 * k + 4, duration], move |s| 0.01 * weight * s[0] * s[0] * s[1]));
    }
    let bounds = vec![(0.0, 0.0); rows.len()];
    let mut problem = Sparse::new(start, objective, rows, bounds);
    for k in 0..points {
        problem.lower[5 * k] = -2.0;
        problem.upper[5 * k] = 2.0;
        problem.lower[5 * k + 4] = -limit;
        problem.upper[5 * k + 4] = limit;
    }
    for (e, (first, last)) in [(0.0, 1.0), (0.0, std::f64::consts::PI), (0.0, 0.0), (0.0, 0.0)].into_iter().enumerate()
    {
        for (j, value) in [(e, first), (5 * intervals + e, last)] {
            problem.lower[j] = value;
            problem.upper[j] = value;
            problem.start[j] = value;
        }
    }
    problem.lower[duration] = 0.2;
    problem.upper[duration] = 5.0;
    let root = parent.len() - 1;
    let mut block_of_variable: Vec<usize> = (0..5 * points).map(|j| block_of_point[j / 5]).collect();
    block_of_variable.push(root);
    problem.blocks = Some(EliminationBlocks { parent, block_of_variable, block_of_row });
    problem
}

/// Nested dissection of a chain: parents and the block of each point; the last block is an empty root.
pub fn dissect(points: usize, leaf: usize) -> (Vec<Option<usize>>, Vec<usize>) {
    fn cut(low: usize, high: usize, leaf: usize, parent: usize, parents: &mut Vec<usize>, of: &mut [usize]) {
        if low >= high {
            return;
        }
        let own = parents.len();
        parents.push(parent);
        if high - low <= leaf {
            of[low..high].fill(own);
        } else {
            let middle = (low + high) / 2;
            of[middle] = own;
            cut(low, middle, leaf, own, parents, of);
            cut(middle + 1, high, leaf, own, parents, of);
        }
    }
    // Numbered from the root, then reversed, so that parents come last.
    let mut parents = vec![0];
    let mut of = vec![0; points];
    cut(0, points, leaf, 0, &mut parents, &mut of);
    let count = parents.len();
    let mut parent = vec![None; count];
    for b in 1..count {
        parent[count - 1 - b] = Some(count - 1 - parents[b]);
    }
    (parent, of.into_iter().map(|b| count - 1 - b).collect())
}

/// A synthetic problem of the size and structure of a gait optimisation: `domains` x `points` nodes with 18 state
/// and 42 algebraic variables, 42 algebraic rows and 18 defect rows each, 3 inequality rows, 30 parameters per domain,
/// 4 globals, periodic end. Blocks: the algebraic part of each point, then its states, by nested dissection of the
/// points inside a domain, domain parameters, and globals.
pub fn gait_sized(domains: usize, points: usize) -> Sparse {
    const STATES: usize = 18;
    const ALGEBRAIC: usize = 42;
    const LOCAL: usize = STATES + ALGEBRAIC;
    const PARAMETERS: usize = 30;
    const GLOBALS: usize = 4;
    let total = domains * points;
    let parameter = |d: usize, c: usize| total * LOCAL + d * PARAMETERS + c;
    let global = |c: usize| total * LOCAL + domains * PARAMETERS + c;
    let n = global(GLOBALS);
    let mut seed = 7u64;
    let mut random = move || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    // Blocks: interiors 0..total, then the dissected states, parameters with their domain's first point, globals.
    let mut parent: Vec<Option<usize>> = vec![None; total];
    let mut state_block = vec![0; total];
    let mut domain_root = Vec::new();
    for d in 0..domains {
        let (tree, of) = dissect(points - 1, 1);
        let base = parent.len();
        parent.extend(tree.iter().map(|p| p.map(|p| p + base)));
        for k in 0..points - 1 {
            state_block[d * points + k + 1] = base + of[k];
        }
        domain_root.push(parent.len() - 1);
    }
    let root = parent.len();
    parent.push(None);
    for d in 0..domains {
        parent[domain_root[d]] = Some(root);
        state_block[d * points] = root;
    }
    for k in 0..total {
        parent[k] = Some(state_block[k].min(state_block[(k + 1) % total]));
    }
    let mut block_of_variable = vec![0; n];
    for k in 0..total {
        block_of_variable[k * LOCAL..k * LOCAL + STATES].fill(state_block[k]);
        block_of_variable[k * LOCAL + STATES..(k + 1) * LOCAL].fill(k);
    }
    for d in 0..domains {
        for c in 0..PARAMETERS {
            block_of_variable[parameter(d, c)] = domain_root[d];
        }
    }
    for c in 0..GLOBALS {
        block_of_variable[global(c)] = root;
    }
    let (mut rows, mut bounds, mut block_of_row) = (Vec::new(), Vec::new(), Vec::new());
    let mut objective = Vec::new();
    for k in 0..total {
        let d = k / points;
        let x = k * LOCAL;
        for i in 0..ALGEBRAIC {
            let mut variables = vec![x + STATES + i];
            for _ in 0..3 {
                let j = x + (random() * STATES as f64) as usize;
                let a = x + STATES + (random() * ALGEBRAIC as f64) as usize;
                variables.extend([j, a]);
            }
            variables.push(parameter(d, i % PARAMETERS));
            variables.push(global(i % GLOBALS));
            variables.sort_unstable();
            variables.dedup();
            let own = variables.iter().position(|&v| v == x + STATES + i).unwrap();
            let w: Vec<f64> = variables.iter().map(|_| 0.6 * random() - 0.3).collect();
            rows.push(Term::new(variables, move |s| {
                let coupling = s.iter().zip(&w).fold(Dual::constant(0.0), |sum, (v, w)| sum + *w * v.sin());
                s[own] * 1.5 - coupling * (1.0 + 0.2 * s[0]) - 0.1
            }));
            bounds.push((0.0, 0.0));
            block_of_row.push(k);
        }
        let next = (k + 1) % total;
        for i in 0..STATES {
            let variables =
                vec![x + i, next * LOCAL + i, x + STATES + i, x + STATES + i + 18, parameter(d, PARAMETERS - 1)];
            let w = random() - 0.5;
            rows.push(Term::new(variables, move |s| s[1] - s[0] - 0.2 * (1.0 + s[4]) * (s[2] - w * s[3])));
            bounds.push((0.0, 0.0));
            block_of_row.push(state_block[k].min(state_block[next]));
        }
        for i in 0..3 {
            rows.push(Term::new(vec![x + i, x + STATES + 3 * i], |s| s[0] * s[0] + s[1] * s[1]));
            bounds.push((-INF, 2.5));
            block_of_row.push(k);
        }
        for i in 0..LOCAL {
            let target = 0.8 * ((k as f64 * 0.3) + i as f64).sin();
            objective.push(Term::new(vec![x + i], move |s| (s[0] - target) * (s[0] - target)));
        }
    }
    for j in total * LOCAL..n {
        objective.push(Term::new(vec![j], |s| 0.1 * s[0] * s[0]));
    }
    let mut problem = Sparse::new(vec![0.1; n], objective, rows, bounds);
    problem.lower[..total * LOCAL].fill(-3.0);
    problem.upper[..total * LOCAL].fill(3.0);
    problem.lower[total * LOCAL..].fill(-1.0);
    problem.upper[total * LOCAL..].fill(1.0);
    problem.blocks = Some(EliminationBlocks { parent, block_of_variable, block_of_row });
    problem
}
