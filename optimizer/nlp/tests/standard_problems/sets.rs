//! The problems by sets, for the examples.

use interior_point::NonlinearProgram;

use super::sparse::{Sparse, cart_pole, gait_sized};
use super::swing_up::SwingUp;
use super::{Small, hock_schittkowski, optimal_control};

/// A problem with its start and known optima.
pub struct Case {
    pub name: String,
    pub program: Box<dyn NonlinearProgram>,
    pub start: Vec<f64>,
    pub optima: Vec<f64>,
    /// Relative distance from an optimum that counts as reached; absolute for optima below `unit`.
    pub within: f64,
    pub unit: f64,
}

impl Case {
    /// Whether `objective` is one of the known optima.
    pub fn is_optimum(&self, objective: f64) -> bool {
        self.optima.iter().any(|f| (objective - f).abs() <= self.within * f.abs().max(self.unit))
    }
}

/// The swing-ups and the optima that IPOPT reaches (`optimizer/benches/casadi/cart_pole.py`).
const SWING_UPS: [(usize, f64); 3] = [(100, 11181.317719), (200, 22245.725103), (300, 33336.600907)];

fn of_small(problem: Small) -> Case {
    Case {
        name: problem.name.to_owned(),
        start: problem.start.clone(),
        optima: problem.optima.clone(),
        within: 2e-6,
        unit: 1.0,
        program: Box::new(problem),
    }
}

/// Three random starts of a problem, farther from its own the larger its values are.
pub fn random_starts(problem: &Small) -> Vec<Vec<f64>> {
    let mut seed = 777u64;
    let mut random = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    (0..3).map(|_| problem.start.iter().map(|v| v + (1.0 + v.abs()) * random()).collect()).collect()
}

/// Name and problems of each set.
pub fn all() -> Vec<(&'static str, Vec<Case>)> {
    let small = hock_schittkowski::all().into_iter().map(of_small);
    let random = (0..3).flat_map(|index| {
        hock_schittkowski::all().into_iter().map(move |problem| Case {
            name: format!("{} from start {index}", problem.name),
            start: random_starts(&problem).swap_remove(index),
            ..of_small(problem)
        })
    });
    let sparse = |name: &str, program: Sparse, optimum: f64| Case {
        name: name.to_owned(),
        start: program.start.clone(),
        optima: vec![optimum],
        within: 1e-6,
        unit: 0.0,
        program: Box::new(program),
    };
    let swing_up = |name: String, program: SwingUp, optimum: f64| Case {
        name,
        start: program.start(),
        optima: vec![optimum],
        within: 1e-6,
        unit: 0.0,
        program: Box::new(program),
    };
    let swing_ups = SWING_UPS
        .map(|(intervals, optimum)| swing_up(format!("swing-up {intervals}"), SwingUp::new(intervals), optimum));
    let ill_conditioned = SWING_UPS[..2].iter().map(|&(intervals, optimum)| {
        let program = SwingUp::with_ill_conditioned_fronts(intervals);
        swing_up(format!("ill-conditioned {intervals}"), program, optimum)
    });
    let large = [
        sparse("cart-pole 50", cart_pole(50, 20.0, 1), 2.288286949),
        sparse("cart-pole 100", cart_pole(100, 20.0, 1), 2.284912413),
        sparse("gait-sized 2 x 5", gait_sized(2, 5), 159.43500783),
    ];
    let control = optimal_control::all()
        .into_iter()
        .map(|problem| Case { within: problem.within, ..sparse(problem.name, problem.program, problem.optimum) });
    vec![
        ("Hock-Schittkowski", small.collect()),
        ("random starts", random.collect()),
        ("sparse", large.into_iter().collect()),
        ("cart-pole swing-up", swing_ups.into_iter().collect()),
        ("ill-conditioned", ill_conditioned.collect()),
        ("optimal control", control.collect()),
    ]
}
