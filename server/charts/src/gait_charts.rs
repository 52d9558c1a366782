//! The charts of a gait.

use crate::gait_series::{MUSCLES, Point, points};
use crate::{Chart, Figure, Span, Stroke, band_in_words, over_reference};
use gait_optimizer::solve::SolvePhase;
use gait_optimizer::walking::stick_figure::StickFigure;
use gait_optimizer::walking::{Progress, progress};
use gait_optimizer::{Gait, IterationRecord, ModelError, ReferenceGait};

/// The phases of the stride, in their order, for either leg.
pub const PHASES: [(&str, &str); 4] = [
    ("DS2", "double support: heel of the leading foot and toe of the trailing foot on the ground"),
    ("DS3", "double support: leading foot flat, toe of the trailing foot still on the ground"),
    ("SS2", "single support on the flat foot while the other leg swings"),
    ("SS1", "single support on the toe until the other heel strikes"),
];

const CYCLE: &str = "gait cycle from right heel strike, %";
/// Title and index into q and into the reference of the five human coordinates.
const ANGLES: [(&str, usize, usize); 5] = [
    ("Torso lean", 2, 0),
    ("Left hip", 3, 1),
    ("Left knee", 4, 2),
    ("Left ankle", 5, 3),
    ("Right hip (prosthetic side)", 6, 4),
];
const JOINTS: [&str; 6] = ["Left hip", "Left knee", "Left ankle", "Right hip", "Right knee", "Right ankle"];
const MUSCLE_GROUPS: [(&str, &[usize]); 3] =
    [("left thigh and hip", &[0, 1, 2, 4]), ("left shank", &[3, 5, 6]), ("right (residual limb)", &[7, 8, 9])];
/// Names of q, apart from the place of the hip.
const COORDINATES: [&str; 7] =
    ["Torso lean", "Left hip", "Left knee", "Left ankle", "Right hip", "Right knee", "Right ankle"];

/// Colour of the right leg, as in the stick figures; the left one has the first colour.
const RIGHT: usize = 3;

/// Figures that belong together.
#[derive(Debug)]
pub struct Group {
    /// Name in addresses.
    pub id: &'static str,
    /// Heading on the page.
    pub heading: &'static str,
    /// What the figures show, in a sentence; empty: the heading says it.
    pub hint: String,
    /// The figures, in reading order.
    pub figures: Vec<Figure>,
}

impl Group {
    fn new(id: &'static str, heading: &'static str, hint: impl Into<String>, charts: Vec<Chart>) -> Self {
        let figures = charts.into_iter().map(|chart| Figure::chart(id, chart)).collect();
        Self { id, heading, hint: hint.into(), figures }
    }
}

/// Number of drawn points for each node of a gait.
const DRAWN_PARTS: usize = 6;

/// A gait as it is drawn: smooth between its nodes.
fn drawn(gait: &Gait) -> Gait {
    gait.refined(DRAWN_PARTS)
}

/// The points of a gait on the axis of the gait cycle.
struct Cycle<'a> {
    points: Vec<Point<'a>>,
    end: f64,
    spans: Vec<Span>,
}

impl<'a> Cycle<'a> {
    fn of(gait: &'a Gait) -> Self {
        let points = points(gait);
        let end = points.last().map_or(1.0, |point| point.time_s).max(1e-9);
        let spans = domains(&points, end);
        Self { points, end, spans }
    }

    /// A line over the cycle, with a gap between domains: forces, torques and accelerations may jump there.
    fn over(&self, y: impl FnMut(&Point<'_>) -> f64) -> Vec<(f64, f64)> {
        self.line(|point| 100.0 * point.time_s / self.end, y, |_| true)
    }

    /// The orbit of a coordinate, °, °/s, with a gap where an impact makes its velocity jump: before each double support.
    fn orbit(&self, q: usize) -> Vec<(f64, f64)> {
        self.line(|p| p.q[q].to_degrees(), |p| p.qd[q].to_degrees(), |domain| domain.starts_with("DS"))
    }

    fn line(
        &self,
        x: impl Fn(&Point<'_>) -> f64,
        mut y: impl FnMut(&Point<'_>) -> f64,
        jumps_into: impl Fn(&str) -> bool,
    ) -> Vec<(f64, f64)> {
        let mut line: Vec<(f64, f64)> = Vec::with_capacity(self.points.len() + 8);
        for (i, point) in self.points.iter().enumerate() {
            if i > 0 && self.points[i - 1].domain != point.domain && jumps_into(point.domain) {
                line.push((f64::NAN, f64::NAN));
            }
            line.push((x(point), y(point)));
        }
        line
    }

    fn marked(&self, mut chart: Chart) -> Chart {
        chart.spans.clone_from(&self.spans);
        chart
    }
}

/// The stride as a row of pictures.
pub fn tiles(figures: Vec<StickFigure>) -> Figure {
    Figure::tiles("The stride", figures)
}

/// All figures of a gait.
///
/// # Errors
/// When its subject or device is invalid.
pub fn of_gait(gait: &Gait, reference: &ReferenceGait) -> Result<Vec<Group>, ModelError> {
    let gait = &drawn(gait);
    let cycle = Cycle::of(gait);
    let mut groups = vec![angles(&cycle, reference), forces(&cycle), torques(&cycle, gait)];
    if gait.muscles {
        groups.push(muscles(&cycle));
    }
    groups.push(progress_of(&cycle, gait)?);
    groups.push(portraits(&cycle));
    Ok(groups)
}

/// Phase and hip velocity, which the virtual constraints control in most domains.
fn progress_of(cycle: &Cycle<'_>, gait: &Gait) -> Result<Group, ModelError> {
    let made = progress(gait)?;
    let over = |value: fn(&Progress) -> f64| {
        let mut values = made.iter();
        cycle.over(|_| values.next().map_or(f64::NAN, value))
    };
    let velocity = Chart::new("Hip velocity", CYCLE, "velocity, m/s")
        .with("linearised", 0, Stroke::Solid, over(|point| point.hip_velocity_m_s))
        .with("hip", 1, Stroke::Dashed, cycle.over(|point| point.qd[0]));
    let phase =
        Chart::new("Phase", CYCLE, "phase variable, 0 to 1").with("phase", 0, Stroke::Solid, over(|point| point.phase));
    let charts = vec![cycle.marked(velocity), cycle.marked(phase)];
    let hint = "The phase replaces time: it rises from 0 at the planned start of a domain to 1 at its planned end, in proportion \
                to the linearised position of the hip over the stance toe. Its velocity is constant in all domains but SS1.";
    Ok(Group::new("phase", "Hip velocity and phase", hint, charts))
}

fn angles(cycle: &Cycle<'_>, reference: &ReferenceGait) -> Group {
    let draw = |&(title, q, column): &(&str, usize, usize)| {
        let chart = over_reference(Chart::new(title, CYCLE, "angle, °"), reference, column);
        let colour = if q >= 6 { RIGHT } else { 0 };
        cycle.marked(chart.with("this gait", colour, Stroke::Solid, cycle.over(|p| p.q[q].to_degrees())))
    };
    let prosthesis = Chart::new("Prosthesis", CYCLE, "angle, °")
        .with("right knee", RIGHT, Stroke::Solid, cycle.over(|p| p.q[7].to_degrees()))
        .with("right ankle", RIGHT, Stroke::Dashed, cycle.over(|p| p.q[8].to_degrees()));
    let mut charts: Vec<Chart> = ANGLES.iter().map(draw).collect();
    charts.push(cycle.marked(prosthesis));
    let hint = format!(
        "Flexion, dorsiflexion and forward lean are positive. {} The joints of the prosthesis have no reference.",
        band_in_words(reference)
    );
    Group::new("angles", "Joint angles", hint, charts)
}

fn forces(cycle: &Cycle<'_>) -> Group {
    let draw = |(title, axis): (&str, usize)| {
        let chart = Chart::new(title, CYCLE, "force, N")
            .with("left foot", 0, Stroke::Solid, cycle.over(|p| p.forces[axis] + p.forces[2 + axis]))
            .with(
                "right foot (prosthesis)",
                RIGHT,
                Stroke::Dashed,
                cycle.over(|p| p.forces[4 + axis] + p.forces[6 + axis]),
            );
        cycle.marked(chart)
    };
    let charts = [("Ground force, vertical", 1), ("Ground force, forward", 0)].map(draw).into();
    Group::new("forces", "Ground reaction forces", "Sum of heel and toe.", charts)
}

fn torques(cycle: &Cycle<'_>, gait: &Gait) -> Group {
    let limits = gait.settings.limits.joint_torques_n_m(&gait.device);
    let draw = |(joint, name): (usize, &&str)| {
        let (low, high) = limits[joint];
        // Two lines with a gap between them.
        let limit = vec![(0.0, high), (100.0, high), (f64::NAN, f64::NAN), (0.0, low), (100.0, low)];
        let chart = Chart::new(name, CYCLE, "torque, N m").with("limits", 7, Stroke::Dashed, limit).with(
            "torque",
            if joint < 3 { 0 } else { RIGHT },
            Stroke::Solid,
            cycle.over(|p| p.u[joint]),
        );
        cycle.marked(chart)
    };
    let charts = JOINTS.iter().enumerate().map(draw).collect();
    let hint = "The prosthesis drives the right knee and ankle; the subject drives the other joints.";
    Group::new("torques", "Joint torques", hint, charts)
}

fn muscles(cycle: &Cycle<'_>) -> Group {
    let mut charts = Vec::new();
    for (what, unit) in [("Activation", "activation, 0 to 1"), ("Fibre length", "length / optimal length")] {
        for (part, muscles) in MUSCLE_GROUPS {
            let mut chart = Chart::new(&format!("{what}, {part}"), CYCLE, unit);
            for (place, &muscle) in muscles.iter().enumerate() {
                let stroke = Stroke::APART[place % Stroke::APART.len()];
                let state = |p: &Point<'_>| if what == "Activation" { p.activation } else { p.fibre_length }.copied();
                let line = cycle.over(|p| state(p).map_or(f64::NAN, |values| values[muscle]));
                chart = chart.with(MUSCLES[muscle], place, stroke, line);
            }
            charts.push(cycle.marked(chart));
        }
    }
    let hint = "HAM hamstrings, GLU glutei, HFL hip flexors, GAS gastrocnemius, VAS vasti, SOL soleus, TA tibialis \
                anterior; L left, R right.";
    Group::new("muscles", "Muscles", hint, charts)
}

fn portraits(cycle: &Cycle<'_>) -> Group {
    let draw = |(place, name): (usize, &&str)| {
        let q = place + 2;
        let colour = if q >= 6 { RIGHT } else { 0 };
        Chart::new(name, "angle, °", "velocity, °/s").with("this gait", colour, Stroke::Solid, cycle.orbit(q))
    };
    let charts = COORDINATES.iter().enumerate().map(draw).collect();
    let hint = "Joint angle and velocity over the stride. A closed curve is a periodic motion; a gap is an impact.";
    Group::new("portraits", "Phase portraits", hint, charts)
}

/// The domains in percent of the cycle; double support is shaded.
fn domains(points: &[Point<'_>], end: f64) -> Vec<Span> {
    let mut spans: Vec<Span> = Vec::new();
    for point in points {
        let at = 100.0 * point.time_s / end;
        match spans.last_mut() {
            Some(span) if span.name == point.domain => span.to = at,
            _ => {
                let shaded = point.domain.starts_with("DS");
                spans.push(Span { from: at, to: at, name: point.domain.to_owned(), shaded });
            }
        }
    }
    spans
}

/// The joint angles of a reference alone: title and chart.
pub fn of_reference(reference: &ReferenceGait) -> Vec<Chart> {
    let chart = |&(title, _, column): &(&str, usize, usize)| {
        over_reference(Chart::new(title, CYCLE, "angle, °"), reference, column)
    };
    ANGLES.iter().map(chart).collect()
}

/// The human joint angles of gaits and of a reference. Each gait comes with its name.
pub fn with_reference(gaits: &[(&str, &Gait)], reference: &ReferenceGait) -> Vec<Chart> {
    let gaits: Vec<(&str, Gait)> = gaits.iter().map(|(name, gait)| (*name, drawn(gait))).collect();
    let draw = |&(title, q, column): &(&str, usize, usize)| {
        let mut chart = over_reference(Chart::new(title, CYCLE, "angle, °"), reference, column);
        for (place, (name, gait)) in gaits.iter().enumerate() {
            chart = chart.with(name, place, stroke(place), Cycle::of(gait).over(|p| p.q[q].to_degrees()));
        }
        chart
    };
    ANGLES.iter().map(draw).collect()
}

/// The orbits of each joint, with the orbits of all gaits in one chart. Each gait comes with its name.
pub fn orbits(gaits: &[(&str, &Gait)]) -> Vec<Chart> {
    let gaits: Vec<(&str, Gait)> = gaits.iter().map(|(name, gait)| (*name, drawn(gait))).collect();
    let draw = |(place, title): (usize, &&str)| {
        let mut chart = Chart::new(title, "angle, °", "velocity, °/s");
        for (colour, (name, gait)) in gaits.iter().enumerate() {
            chart = chart.with(name, colour, stroke(colour), Cycle::of(gait).orbit(place + 2));
        }
        chart
    };
    if gaits.is_empty() { Vec::new() } else { COORDINATES.iter().enumerate().map(draw).collect() }
}

/// The orbit of a coordinate of a gait, °, °/s.
pub fn orbit(gait: &Gait, coordinate: usize) -> Vec<(f64, f64)> {
    Cycle::of(&drawn(gait)).orbit(coordinate)
}

/// Stroke of a gait: solid for the first one, dashed for the others.
fn stroke(place: usize) -> Stroke {
    if place == 0 { Stroke::Solid } else { Stroke::Dashed }
}

/// In words.
fn phase_in_words(phase: SolvePhase) -> &'static str {
    match phase {
        SolvePhase::Tracking => "tracking",
        SolvePhase::MuscleTracking => "tracking with muscles",
        SolvePhase::PlainCost => "cost without muscles",
        SolvePhase::Cost => "cost",
        SolvePhase::InterNode => "bounds tightened between nodes",
    }
}

/// Where each phase of each guess begins.
fn solve_phases(iterations: &[&IterationRecord]) -> Vec<(f64, String)> {
    let several = iterations.iter().any(|r| r.guess != iterations[0].guess);
    let mut starts = Vec::new();
    let mut last = None;
    for (i, r) in iterations.iter().enumerate() {
        // A phase that runs again, in a cold start after a warm one, counts its iterations from zero.
        let again = i > 0 && r.iteration < iterations[i - 1].iteration;
        if last == Some((r.guess, r.phase)) && !again {
            continue;
        }
        last = Some((r.guess, r.phase));
        let phase = phase_in_words(r.phase);
        let of_guess = several && r.phase != SolvePhase::InterNode;
        let name = if of_guess { format!("initial guess {}: {phase}", r.guess + 1) } else { phase.to_owned() };
        starts.push((i as f64, name));
    }
    starts
}

/// The progress of a solve; `None` before its second iteration.
pub fn solve(iterations: &[IterationRecord]) -> Option<Figure> {
    // One point is no line.
    (iterations.len() > 1).then(|| Figure::chart("solve", of_iterations(iterations)))
}

fn of_iterations(iterations: &[IterationRecord]) -> Chart {
    // Guesses that were solved in parallel are drawn one after the other.
    let mut iterations: Vec<&IterationRecord> = iterations.iter().collect();
    iterations.sort_by_key(|r| r.guess);
    let line = |f: fn(&IterationRecord) -> f64| -> Vec<(f64, f64)> {
        iterations.iter().enumerate().map(|(i, r)| (i as f64, f(r))).collect()
    };
    let mut chart =
        Chart::new("Objective, violation and barrier parameter by iteration", "iteration", "scaled, no unit")
            .with("violation", 0, Stroke::Solid, line(|r| r.constraint_violation))
            .with("dual infeasibility", 1, Stroke::Dashed, line(|r| r.dual_infeasibility))
            .with("barrier parameter", 2, Stroke::Solid, line(|r| r.barrier))
            .with("objective", 3, Stroke::Dashed, line(|r| r.objective.abs()));
    chart.whole_x = true;
    chart.log_y = true;
    chart.marks = solve_phases(&iterations);
    chart
}
