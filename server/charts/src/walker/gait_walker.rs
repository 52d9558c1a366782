//! The walker of a gait on a page: one pose, with everything that the script needs to move it.

use super::body_outline::{BodyPart, human_parts, parts};
use super::muscle_paths::{MusclePath, is_left, muscle_paths};
use super::segment::UNITS_PER_M;
use crate::escaped_text::escape;
use crate::gait_series::{MUSCLES, points};
use gait_optimizer::body::{GRAVITY, WalkerModel};
use gait_optimizer::gait::stick_figure::{LegPoints, StickFigure, stick_figure, stick_figures};
use gait_optimizer::{Gait, ModelError, ReferenceGait};
use std::fmt::Write;

/// Space beside the feet, above the head and below the ground, in units of the drawing.
const DRAWING_MARGIN: f64 = 9.0;
const ABOVE: f64 = 4.0;
const BELOW: f64 = 22.0;
/// From hip to the top of the head, in lengths of the trunk.
const TOP_OF_HEAD: f64 = 1.63;
/// Length of the arrow of a ground reaction force of one body weight, in units of the drawing.
const BODY_WEIGHT: f64 = 50.0;
/// Forces below this have no centre of pressure worth drawing, N.
const MIN_FORCE_N: f64 = 10.0;
/// Number of instants of a reference gait; the last one is the first of the next stride.
const GHOST_INSTANTS: usize = 51;

/// A gait at its nodes, as the walker is drawn from it.
#[derive(Debug, Clone)]
pub struct GaitWalker {
    /// Poses by time.
    pub(super) stick_figures: Vec<StickFigure>,
    /// Ground forces on left heel, left toe, right heel and right toe at each pose, N.
    forces: Vec<[[f64; 2]; 4]>,
    /// Activations of the muscles at each pose.
    activations: Option<Vec<[f64; 10]>>,
    /// Weight of the subject, N.
    weight_n: f64,
    pub(super) stride_length_m: f64,
    ghost: Option<Ghost>,
}

/// A second walker behind the first one.
#[derive(Debug, Clone)]
pub enum Ghost {
    /// The reference gait on the body of the subject, over one stride.
    Reference(Vec<StickFigure>),
    /// Another gait, whose poses a script fetches: any pose of it, for the size of its body.
    OtherGait(Option<StickFigure>),
}

impl Ghost {
    /// A reference gait on the body of a subject who walks without a prosthesis. The reference has no positions, so the
    /// hip is above the same place, and the lowest point of the feet is on the ground.
    ///
    /// # Errors
    /// [`ModelError`] if subject or device of the gait is invalid.
    pub fn of_reference(gait: &Gait, reference: &ReferenceGait) -> Result<Self, ModelError> {
        let mut model = WalkerModel::new(&gait.subject, &gait.device)?;
        model.right = model.left;
        let pose = |instant: usize| {
            let share = instant as f64 / (GHOST_INSTANTS - 1) as f64;
            let [torso, hip_l, knee_l, ankle_l, hip_r, knee_r, ankle_r] = reference.seven_angles(share);
            let at_height = |height: f64| {
                let q = [0.0, height, torso, hip_l, knee_l, ankle_l, hip_r, knee_r, ankle_r];
                stick_figure(&model, share * gait.stride_time_s, &q)
            };
            let hanging = at_height(0.0);
            let soles = [&hanging.left, &hanging.right].into_iter().flat_map(|leg| [leg.heel[1], leg.toe[1]]);
            at_height(-soles.fold(f64::INFINITY, f64::min))
        };
        Ok(Self::Reference((0..GHOST_INSTANTS).map(pose).collect()))
    }
}

/// The walker at one instant.
pub(super) struct Pose<'a> {
    pub(super) stick_figure: &'a StickFigure,
    pub(super) forces: &'a [[f64; 2]; 4],
    pub(super) activations: Option<&'a [f64; 10]>,
}

impl GaitWalker {
    /// The walker of a gait.
    ///
    /// # Errors
    /// [`ModelError`] if subject or device of the gait is invalid.
    pub fn new(gait: &Gait) -> Result<Self, ModelError> {
        let points = points(gait);
        let four = |f: &[f64; 8]| [[f[0], f[1]], [f[2], f[3]], [f[4], f[5]], [f[6], f[7]]];
        Ok(Self {
            stick_figures: stick_figures(gait)?,
            forces: points.iter().map(|point| four(&point.forces)).collect(),
            activations: points.iter().map(|point| point.activation.copied()).collect(),
            weight_n: gait.subject.body_mass_kg * GRAVITY,
            stride_length_m: gait.stride_length_m,
            ghost: None,
        })
    }

    /// With a second walker behind it, which is hidden until a script shows it.
    #[must_use]
    pub fn with_ghost(mut self, ghost: Ghost) -> Self {
        self.ghost = Some(ghost);
        self
    }

    /// This gait as the second walker beside another one.
    pub fn as_ghost(&self) -> Ghost {
        Ghost::OtherGait(self.stick_figures.first().copied())
    }

    /// Left edge, top, width and height of the drawing.
    pub(super) fn view_box(&self) -> [f64; 4] {
        let top = |stick_figure: &StickFigure| {
            let up = |axis: usize| TOP_OF_HEAD * (stick_figure.shoulder[axis] - stick_figure.hip[axis]);
            stick_figure.hip[1] + up(0).hypot(up(1))
        };
        let reach = |stick_figure: &StickFigure| {
            let feet =
                [&stick_figure.left, &stick_figure.right].into_iter().flat_map(|leg| [leg.ankle, leg.heel, leg.toe]);
            feet.map(|place| (place[0] - stick_figure.hip[0]).abs()).fold(0.0, f64::max)
        };
        let most = |of: &dyn Fn(&StickFigure) -> f64| {
            self.stick_figures.iter().map(of).filter(|value| value.is_finite()).fold(0.5, f64::max) * UNITS_PER_M
        };
        let (top, half) = ((most(&top) + ABOVE).round(), (most(&reach) + DRAWING_MARGIN).round());
        [-half, -top, 2.0 * half, top + BELOW]
    }

    pub(super) fn poses(&self) -> impl Iterator<Item = Pose<'_>> {
        self.stick_figures.iter().zip(&self.forces).enumerate().map(|(place, (stick_figure, forces))| Pose {
            stick_figure,
            forces,
            activations: self.activations.as_ref().and_then(|all| all.get(place)),
        })
    }

    /// The largest activation of each muscle over the stride.
    pub(super) fn peaks(&self) -> [f64; 10] {
        let all = self.activations.iter().flatten();
        all.fold([0.0; 10], |peaks: [f64; 10], now| std::array::from_fn(|muscle| peaks[muscle].max(now[muscle])))
    }

    pub(super) fn has_muscles(&self) -> bool {
        self.activations.is_some()
    }

    /// Newtons per unit of the drawing.
    pub(super) fn force_scale_n(&self) -> f64 {
        self.weight_n / BODY_WEIGHT
    }

    /// The walker at right heel strike as an SVG element.
    pub fn svg(&self, label: &str) -> String {
        let mut svg = String::with_capacity(16 * 1024);
        // Writing to a String cannot fail.
        let _ = self.draw(&mut svg, label);
        svg
    }

    fn draw(&self, svg: &mut String, label: &str) -> std::fmt::Result {
        let [x, y, width, height] = self.view_box();
        write!(
            svg,
            "<svg class=\"gait-walker\" viewBox=\"{x} {y} {width} {height}\" role=\"img\" aria-label=\"{}\" data-force-scale=\"{:.2}\">",
            escape(label),
            self.force_scale_n()
        )?;
        write!(svg, "<path class=\"ground\" d=\"M-999 0H999\"/><g data-ground></g>")?;
        let Some(pose) = self.poses().next() else { return write!(svg, "</svg>") };
        match &self.ghost {
            Some(Ghost::Reference(stick_figures)) => {
                write!(svg, "<g class=\"ghost\" data-ghost=\"{}\" visibility=\"hidden\">", millimetres(stick_figures))?;
                for part in stick_figures.first().map(human_parts).unwrap_or_default() {
                    draw_part(svg, &part, pose.stick_figure)?;
                }
                write!(svg, "</g>")?;
            }
            Some(Ghost::OtherGait(other)) => {
                write!(svg, "<g class=\"ghost\" data-ghost visibility=\"hidden\">")?;
                for part in other.as_ref().map(parts).unwrap_or_default() {
                    draw_part(svg, &part, pose.stick_figure)?;
                }
                write!(svg, "</g>")?;
            }
            None => {}
        }
        let peaks = self.peaks();
        let muscles = |svg: &mut String, of_left: bool| -> std::fmt::Result {
            let paths = if self.has_muscles() { muscle_paths(pose.stick_figure) } else { Default::default() };
            for (muscle, path) in
                paths.iter().enumerate().filter(|(muscle, path)| is_left(*muscle) == of_left && !path.is_empty())
            {
                let share = pose.activations.map_or(0.0, |now| share_of_peak(now[muscle], peaks[muscle]));
                let via = path.iter().map(|(segment, [x, y])| format!("{} {x:.1} {y:.1}", segment.name()));
                write!(
                    svg,
                    "<path class=\"muscle\" data-muscle=\"{muscle}\" data-peak=\"{:.4}\" data-via=\"{}\" d=\"{}\" stroke-width=\"{:.1}\" stroke-opacity=\"{:.2}\"><title>{}</title></path>",
                    peaks[muscle],
                    via.collect::<Vec<_>>().join(","),
                    muscle_line(path, pose.stick_figure),
                    muscle_width(share),
                    muscle_opacity(share),
                    MUSCLES[muscle]
                )?;
            }
            Ok(())
        };
        write!(svg, "<g data-body>")?;
        for part in parts(pose.stick_figure) {
            // The right leg is in front of the muscles of the left one; its muscles end in the socket.
            if part.class == "right" {
                muscles(svg, true)?;
            }
            draw_part(svg, &part, pose.stick_figure)?;
            if part.class == "right" {
                muscles(svg, false)?;
            }
        }
        write!(svg, "</g>")?;
        for (side, arrow) in ["left", "right"].into_iter().zip(self.arrows(&pose)) {
            write!(svg, "<path class=\"force\" data-force=\"{side}\" d=\"{arrow}\"/>")?;
        }
        write!(svg, "</svg>")
    }

    /// The arrows of the ground reaction forces under the left and the right foot; empty in swing.
    pub(super) fn arrows(&self, pose: &Pose<'_>) -> [String; 2] {
        let [left_heel, left_toe, right_heel, right_toe] = *pose.forces;
        let arrow = |leg: &LegPoints, heel: [f64; 2], toe: [f64; 2]| {
            ground_reaction(leg, heel, toe).map_or_else(String::new, |(place, force)| {
                let x = (place - pose.stick_figure.hip[0]) * UNITS_PER_M;
                arrow(x, force[0] / self.force_scale_n(), -force[1] / self.force_scale_n())
            })
        };
        [arrow(&pose.stick_figure.left, left_heel, left_toe), arrow(&pose.stick_figure.right, right_heel, right_toe)]
    }
}

/// Centre of pressure, m, and ground reaction force, N, of a foot on the ground.
fn ground_reaction(leg: &LegPoints, heel: [f64; 2], toe: [f64; 2]) -> Option<(f64, [f64; 2])> {
    let force = [heel[0] + toe[0], heel[1] + toe[1]];
    (force[1] >= MIN_FORCE_N).then(|| ((heel[1] * leg.heel[0] + toe[1] * leg.toe[0]) / force[1], force))
}

/// An arrow from a place on the ground.
fn arrow(x: f64, right: f64, down: f64) -> String {
    let length = right.hypot(down);
    let head = 5.0_f64.min(length) / length.max(1e-9);
    let tip = [x + right, down];
    let barb = |side: f64| [tip[0] - head * (right + side * 0.5 * down), tip[1] - head * (down - side * 0.5 * right)];
    let [a, b] = [barb(1.0), barb(-1.0)];
    format!(
        "M{x:.1} 0L{:.1} {:.1}M{:.1} {:.1}L{:.1} {:.1}L{:.1} {:.1}",
        tip[0], tip[1], a[0], a[1], tip[0], tip[1], b[0], b[1]
    )
}

pub(super) fn share_of_peak(activation: f64, peak: f64) -> f64 {
    if peak > 0.0 { (activation / peak).clamp(0.0, 1.0) } else { 0.0 }
}

/// Width of a muscle with a share of its largest activation.
pub(super) fn muscle_width(share: f64) -> f64 {
    1.2 + 3.8 * share
}

pub(super) fn muscle_opacity(share: f64) -> f64 {
    0.25 + 0.75 * share
}

/// The `d` of a muscle.
pub(super) fn muscle_line(path: &MusclePath, stick_figure: &StickFigure) -> String {
    let mut line = String::new();
    for (place, (segment, point)) in path.iter().enumerate() {
        let [x, y] = segment.placement(stick_figure).applied(*point);
        // Writing to a String cannot fail.
        let _ = write!(line, "{}{x:.1} {y:.1}", if place == 0 { 'M' } else { 'L' });
    }
    line
}

pub(super) fn draw_part(svg: &mut String, part: &BodyPart, stick_figure: &StickFigure) -> std::fmt::Result {
    let (segment, place) = (part.segment.name(), part.segment.placement(stick_figure).transform());
    write!(
        svg,
        "<path class=\"{}\" data-segment=\"{segment}\" transform=\"{place}\" d=\"{}\"/>",
        part.class, part.outline
    )
}

/// The joints of stick figures in mm, hip first, with semicolons between stick figures.
fn millimetres(stick_figures: &[StickFigure]) -> String {
    let mut text = String::with_capacity(stick_figures.len() * 100);
    for (place, stick_figure) in stick_figures.iter().enumerate() {
        if place > 0 {
            text.push(';');
        }
        let (l, r) = (&stick_figure.left, &stick_figure.right);
        let joints =
            [stick_figure.hip, stick_figure.shoulder, l.knee, l.ankle, l.heel, l.toe, r.knee, r.ankle, r.heel, r.toe];
        for (place, value) in joints.iter().flatten().enumerate() {
            // Writing to a String cannot fail.
            let _ = write!(text, "{}{:.0}", if place == 0 { "" } else { " " }, value * 1000.0);
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::segment::tests::standing;
    use super::*;

    fn on_both_feet() -> GaitWalker {
        GaitWalker {
            stick_figures: vec![standing()],
            forces: vec![[[0.0, 300.0], [0.0, 100.0], [0.0, 0.0], [40.0, 400.0]]],
            activations: Some(vec![[0.2; 10]]),
            weight_n: 800.0,
            stride_length_m: 1.3,
            ghost: None,
        }
    }

    #[test]
    fn force_is_drawn_at_the_centre_of_pressure_and_to_scale() {
        let walker = on_both_feet();
        let pose = walker.poses().next().unwrap();
        let [left, right] = walker.arrows(&pose);
        // A quarter of the way from heel (-6) to toe (15), half a body weight long.
        assert!(left.starts_with("M-0.8 0L-0.8 -25.0M"), "{left}");
        assert!(right.starts_with("M15.0 0L17.5 -25.0M"), "{right}");
    }

    #[test]
    fn foot_in_swing_has_no_force() {
        let mut walker = on_both_feet();
        walker.forces[0][0] = [0.0; 2];
        walker.forces[0][1] = [0.0; 2];
        assert_eq!(walker.arrows(&walker.poses().next().unwrap())[0], "");
    }

    #[test]
    fn walker_shows_body_muscles_and_forces_without_scripts() {
        let svg = on_both_feet().svg("A <person>");
        assert!(svg.contains("aria-label=\"A &lt;person&gt;\"") && !svg.contains("NaN"), "{svg}");
        for (what, count) in [("data-muscle=", 10), ("data-force=", 2), ("class=\"device\"", 3), ("data-segment=", 10)]
        {
            assert_eq!(svg.matches(what).count(), count, "{what}");
        }
        assert!(!svg.contains("dash"), "no human limb is dashed");
        // Each muscle is at its own peak here.
        assert_eq!(svg.matches("stroke-width=\"5.0\"").count(), 10);
    }

    #[test]
    fn walker_leaves_room_for_the_head() {
        let [_, top, _, height] = on_both_feet().view_box();
        // The head ends 1.745 m above the ground.
        assert_eq!((top, height), (-178.0, 200.0));
    }
}
