//! Reads the variables in their order and converts them to physical units.

use crate::domains::{Domain, Kind};
use crate::{Scalar, constant};

pub(crate) struct Point<D> {
    pub(crate) q: [D; 9],
    pub(crate) qd: [D; 9],
    pub(crate) qdd: [D; 9],
    pub(crate) u: [D; 6],
    pub(crate) force: Vec<D>,
    /// Fibre length / optimal length, velocity (optimal lengths per second), activation.
    pub(crate) fibres: Option<[[D; 10]; 3]>,
}

pub(crate) struct DomainVariables<D> {
    pub(crate) points: Vec<Point<D>>,
    pub(crate) duration: D,
    pub(crate) phase_start: D,
    pub(crate) phase_end: Option<D>,
    /// For each output.
    pub(crate) bezier: Vec<[D; 6]>,
    pub(crate) impulse: Vec<D>,
}

pub(crate) struct GaitVariables<D> {
    pub(crate) domains: Vec<DomainVariables<D>>,
    pub(crate) hip_velocities: [D; 4],
    pub(crate) right_step: D,
    pub(crate) stride: D,
}

struct Reader<'a, D> {
    x: &'a [D],
    next: usize,
}

impl<D: Scalar> Reader<'_, D> {
    fn one(&mut self, scale: f64) -> D {
        self.next += 1;
        self.x[self.next - 1] * scale
    }

    fn some<const N: usize>(&mut self, scale: f64) -> [D; N] {
        std::array::from_fn(|_| self.one(scale))
    }

    fn many(&mut self, count: usize, scale: f64) -> Vec<D> {
        (0..count).map(|_| self.one(scale)).collect()
    }
}

/// Reads all variables; `x` must have exactly as many as there are.
pub(crate) fn read<D: Scalar>(domains: &[Domain], muscles: bool, x: &[D]) -> GaitVariables<D> {
    let mut reader = Reader { x, next: 0 };
    let points: Vec<Vec<Point<D>>> = domains
        .iter()
        .map(|domain| {
            (0..domain.points())
                .map(|_| Point {
                    q: reader.some(1.0),
                    qd: reader.some(3.0),
                    qdd: reader.some(30.0),
                    u: reader.some(100.0),
                    force: reader.many(domain.contacts.len(), 500.0),
                    fibres: muscles.then(|| [reader.some(1.0), reader.some(3.0), reader.some(1.0)]),
                })
                .collect()
        })
        .collect();
    let hip_velocities = reader.some(1.0);
    let (right_step, stride) = (reader.one(1.0), reader.one(1.0));
    let domains = domains
        .iter()
        .zip(points)
        .map(|(domain, points)| {
            let duration = reader.one(0.2);
            let phase_start = reader.one(1.0);
            let phase_end = (domain.kind == Kind::Ss1).then(|| reader.one(1.0));
            let outputs = domain.outputs.len();
            let mut bezier = vec![[constant::<D>(0.0); 6]; outputs];
            for i in 0..6 {
                for curve in &mut bezier {
                    curve[i] = reader.one(1.0);
                }
            }
            let impulse =
                if domain.opens_with_impact() { reader.many(domain.contacts.len(), 20.0) } else { Vec::new() };
            DomainVariables { points, duration, phase_start, phase_end, bezier, impulse }
        })
        .collect();
    assert_eq!(reader.next, x.len(), "number of variables");
    GaitVariables { domains, hip_velocities, right_step, stride }
}
