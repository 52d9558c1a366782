//! The charts of a gait.

use crate::http::gait_series::{MUSCLES, Point, points};
use crate::plots::{Chart, Stroke};
use gait_optimizer::solve::Phase;
use gait_optimizer::{Gait, IterationRecord, ReferenceGait};

/// A chart ready for the page.
pub(super) struct Drawn {
    pub(super) title: String,
    pub(super) note: &'static str,
    pub(super) svg: String,
    pub(super) legend: Vec<(String, String)>,
}

impl Drawn {
    pub(super) fn new(chart: &Chart, note: &'static str) -> Self {
        let legend = chart.legend().into_iter().map(|(class, label)| (class, label.to_owned())).collect();
        Self { title: chart.title.clone(), note, svg: chart.svg(), legend }
    }
}

/// The phases of the stride, in their order, for either leg.
pub(super) const PHASES: [(&str, &str); 4] = [
    ("DS2", "double support: the heel of the leading foot and the toe of the trailing foot are down"),
    ("DS3", "double support: the leading foot is flat, the toe of the trailing foot is still down"),
    ("SS2", "single support on the flat foot, the other leg swings"),
    ("SS1", "single support on the toe, until the other heel strikes"),
];

const CYCLE: &str = "gait cycle from right heel strike, %";
/// Title and index into q and into the reference of the five human coordinates.
const ANGLES: [(&str, usize, usize); 5] = [
    ("Torso lean", 2, 0),
    ("Left hip", 3, 1),
    ("Left knee", 4, 2),
    ("Left ankle", 5, 3),
    ("Right hip (prosthesis side)", 6, 4),
];
const JOINTS: [&str; 6] = ["left hip", "left knee", "left ankle", "right hip", "right knee", "right ankle"];

/// Joint angles against the reference, ground forces, torques, activations.
pub(super) fn of_gait(gait: &Gait, reference: &ReferenceGait) -> Vec<Drawn> {
    let points = points(gait);
    let end = points.last().map_or(1.0, |point| point.time_s).max(1e-9);
    // A gap between domains: forces, torques and accelerations may jump there.
    let over = |f: &dyn Fn(&Point<'_>) -> f64| -> Vec<(f64, f64)> {
        let mut line: Vec<(f64, f64)> = Vec::with_capacity(points.len() + 8);
        for (i, point) in points.iter().enumerate() {
            if i > 0 && points[i - 1].domain != point.domain {
                line.push((f64::NAN, f64::NAN));
            }
            line.push((100.0 * point.time_s / end, f(point)));
        }
        line
    };
    let marks = domain_starts(&points, end);
    let mut drawn = Vec::new();
    let mut draw = |mut chart: Chart, note: &'static str| {
        chart.marks.clone_from(&marks);
        drawn.push(Drawn::new(&chart, note));
    };
    for (title, q, column) in ANGLES {
        let measured = reference.angles_rad.iter().enumerate().map(|(i, row)| (i as f64, row[column].to_degrees()));
        let chart = Chart::new(title, CYCLE, "angle, °").with("reference", 7, Stroke::Dashed, measured.collect()).with(
            "this gait",
            0,
            Stroke::Solid,
            over(&|p| p.q[q].to_degrees()),
        );
        draw(chart, "Flexion, dorsiflexion and forward lean are positive.");
    }
    let knee_and_ankle = Chart::new("Prosthesis", CYCLE, "angle, °")
        .with("right knee", 0, Stroke::Solid, over(&|p| p.q[7].to_degrees()))
        .with("right ankle", 1, Stroke::Dashed, over(&|p| p.q[8].to_degrees()));
    draw(knee_and_ankle, "The prosthetic joints have no reference.");
    for (title, axis) in [("Ground force, vertical", 1), ("Ground force, forward", 0)] {
        let chart = Chart::new(title, CYCLE, "force, N")
            .with("left foot", 0, Stroke::Solid, over(&|p| p.forces[axis] + p.forces[2 + axis]))
            .with("right foot (prosthesis)", 1, Stroke::Dashed, over(&|p| p.forces[4 + axis] + p.forces[6 + axis]));
        draw(chart, "Heel and toe together.");
    }
    for (title, first) in [("Joint torques, left", 0), ("Joint torques, right (prosthesis side)", 3)] {
        let mut chart = Chart::new(title, CYCLE, "torque, N m");
        for joint in first..first + 3 {
            let stroke = if joint % 3 == 1 { Stroke::Dashed } else { Stroke::Solid };
            chart = chart.with(JOINTS[joint], joint % 3, stroke, over(&|p| p.u[joint]));
        }
        draw(chart, "");
    }
    if points.iter().any(|point| point.activation.is_some()) {
        for (title, muscles) in [
            ("Muscle activation, left thigh and hip", &[0_usize, 1, 2, 4][..]),
            ("Muscle activation, left shank", &[3, 5, 6]),
            ("Muscle activation, right (residual limb)", &[7, 8, 9]),
        ] {
            let mut chart = Chart::new(title, CYCLE, "activation, 0 to 1");
            for (place, &muscle) in muscles.iter().enumerate() {
                let stroke = if place % 2 == 1 { Stroke::Dashed } else { Stroke::Solid };
                let line = over(&|p| p.activation.map_or(f64::NAN, |a| a[muscle]));
                chart = chart.with(MUSCLES[muscle], place, stroke, line);
            }
            draw(chart, "");
        }
    }
    drawn
}

/// Where each domain begins, in percent of the cycle.
fn domain_starts(points: &[Point<'_>], end: f64) -> Vec<(f64, String)> {
    let mut starts: Vec<(f64, String)> = Vec::new();
    let mut current = "";
    for point in points {
        if point.domain != current {
            current = point.domain;
            starts.push((100.0 * point.time_s / end, current.to_owned()));
        }
    }
    starts
}

/// The human joint angles of two gaits, one over the other.
pub(super) fn of_pair(a: &Gait, b: &Gait, reference: &ReferenceGait) -> Vec<Drawn> {
    let line = |gait: &Gait, q: usize| -> Vec<(f64, f64)> {
        let points = points(gait);
        let end = points.last().map_or(1.0, |point| point.time_s).max(1e-9);
        points.iter().map(|point| (100.0 * point.time_s / end, point.q[q].to_degrees())).collect()
    };
    let draw = |&(title, q, column): &(&str, usize, usize)| {
        let measured = reference.angles_rad.iter().enumerate().map(|(i, row)| (i as f64, row[column].to_degrees()));
        let chart = Chart::new(title, CYCLE, "angle, °")
            .with("reference", 7, Stroke::Dashed, measured.collect())
            .with("gait A", 0, Stroke::Solid, line(a, q))
            .with("gait B", 1, Stroke::Dashed, line(b, q));
        Drawn::new(&chart, "")
    };
    ANGLES.iter().map(draw).collect()
}

/// In words.
fn phase_in_words(phase: Phase) -> &'static str {
    match phase {
        Phase::Tracking => "tracking",
        Phase::MuscleTracking => "tracking with muscles",
        Phase::PlainCost => "cost without muscles",
        Phase::Cost => "cost",
    }
}

/// Where each phase of each guess begins.
fn solve_phases(iterations: &[&IterationRecord]) -> Vec<(f64, String)> {
    let several = iterations.iter().any(|r| r.guess != iterations[0].guess);
    let mut starts = Vec::new();
    let mut last = None;
    for (i, r) in iterations.iter().enumerate() {
        // A phase that begins again (a cold start after a warm one) counts its iterations from a new beginning.
        let again = i > 0 && r.iteration < iterations[i - 1].iteration;
        if last == Some((r.guess, r.phase)) && !again {
            continue;
        }
        last = Some((r.guess, r.phase));
        let phase = phase_in_words(r.phase);
        let name = if several { format!("guess {}: {phase}", r.guess + 1) } else { phase.to_owned() };
        starts.push((i as f64, name));
    }
    starts
}

/// How the solve went.
pub(super) fn of_iterations(iterations: &[IterationRecord]) -> Option<Drawn> {
    if iterations.is_empty() {
        return None;
    }
    // Guesses that ran side by side are shown one after the other.
    let mut iterations: Vec<&IterationRecord> = iterations.iter().collect();
    iterations.sort_by_key(|r| r.guess);
    let line = |f: fn(&IterationRecord) -> f64| -> Vec<(f64, f64)> {
        iterations.iter().enumerate().map(|(i, r)| (i as f64, f(r).max(1e-16).log10())).collect()
    };
    let mut chart = Chart::new("How the solve went", "iteration", "log10")
        .with("constraint violation", 0, Stroke::Solid, line(|r| r.constraint_violation))
        .with("dual infeasibility", 1, Stroke::Dashed, line(|r| r.dual_infeasibility))
        .with("barrier", 2, Stroke::Solid, line(|r| r.barrier));
    chart.whole_x = true;
    chart.marks = solve_phases(&iterations);
    Some(Drawn::new(&chart, "Scaled; decimal logarithm. Vertical lines: where a phase of the solve begins."))
}
