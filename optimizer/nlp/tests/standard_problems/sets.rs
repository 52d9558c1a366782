//! The problems by sets, for the examples.

use interior_point::NonlinearProgram;

use super::sparse::{Sparse, cart_pole, gait_sized};
use super::swing_up::SwingUp;
use super::{hock_schittkowski, optimal_control};

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

/// Name and problems of each set.
pub fn all() -> Vec<(&'static str, Vec<Case>)> {
    let small = hock_schittkowski::all().into_iter().map(|problem| Case {
        name: problem.name.to_owned(),
        start: problem.start.clone(),
        optima: problem.optima.clone(),
        within: 2e-6,
        unit: 1.0,
        program: Box::new(problem),
    });
    let sparse = |name: &str, program: Sparse, optimum: f64| Case {
        name: name.to_owned(),
        start: program.start.clone(),
        optima: vec![optimum],
        within: 1e-6,
        unit: 0.0,
        program: Box::new(program),
    };
    let swing_ups = SWING_UPS.into_iter().map(|(intervals, optimum)| {
        let program = SwingUp::new(intervals);
        Case {
            name: format!("swing-up {intervals}"),
            start: program.start(),
            optima: vec![optimum],
            within: 1e-6,
            unit: 0.0,
            program: Box::new(program),
        }
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
        ("sparse", large.into_iter().collect()),
        ("cart-pole swing-up", swing_ups.collect()),
        ("optimal control", control.collect()),
    ]
}
