//! A gait as a picture that moves by itself: one stride, repeated without end.

use super::body_outline::parts;
use super::gait_walker::{GaitWalker, Pose, muscle_line, muscle_opacity, muscle_width, share_of_peak};
use super::muscle_paths::{is_left, muscle_paths};
use super::segment::{Placement, Segment, UNITS_PER_M};
use gait_optimizer::gait::stick_figure::StickFigure;
use std::fmt::Write;

/// Pictures of a stride. The last one is the first of the next stride.
const PICTURES: usize = 61;
/// Distance between two marks on the ground, m, before it is fitted to the stride.
const MARK_M: f64 = 0.25;

/// Longest stride that is drawn, m.
const MAX_STRIDE_M: f64 = 5.0;

/// One stride of a walker that repeats.
#[derive(Debug, Clone)]
pub struct Animation {
    walker: GaitWalker,
}

impl Animation {
    /// The animation of a walker.
    pub fn new(walker: GaitWalker) -> Self {
        Self { walker }
    }

    /// The poses of the stride.
    pub(crate) fn stick_figures(&self) -> &[StickFigure] {
        &self.walker.stick_figures
    }

    /// Width and height.
    pub(crate) fn size(&self) -> (f64, f64) {
        let [.., width, height] = self.walker.view_box();
        (SCALE * width, SCALE * height)
    }

    /// The elements of the drawing. Programs that do not animate show the first picture.
    pub(crate) fn body(&self) -> String {
        let mut svg = String::with_capacity(64 * 1024);
        // Writing to a String cannot fail.
        let _ = self.draw(&mut svg);
        svg
    }

    /// The pose of each picture: the node nearest in time.
    fn pictures(&self) -> Vec<Pose<'_>> {
        let poses: Vec<Pose<'_>> = self.walker.poses().collect();
        let end = poses.last().map_or(0.0, |pose| pose.stick_figure.time_s);
        let nearest = |picture: usize| {
            let time = end * picture as f64 / (PICTURES - 1) as f64;
            poses.iter().position(|pose| pose.stick_figure.time_s >= time - 1e-9)
        };
        let mut places: Vec<usize> = (0..PICTURES).filter_map(nearest).collect();
        places.dedup();
        let mut poses: Vec<Option<Pose<'_>>> = poses.into_iter().map(Some).collect();
        places.into_iter().filter_map(|place| poses[place].take()).collect()
    }

    fn draw(&self, svg: &mut String) -> std::fmt::Result {
        let [x, y, width, height] = self.walker.view_box();
        let (wide, high) = self.size();
        write!(
            svg,
            "<svg class=\"gait-walker\" width=\"{wide}\" height=\"{high}\" viewBox=\"{x} {y} {width} {height}\">"
        )?;
        let pictures = self.pictures();
        if let (Some(first), Some(last)) = (pictures.first(), pictures.last()) {
            let seconds = (last.stick_figure.time_s - first.stick_figure.time_s).max(0.1);
            let begin = first.stick_figure.time_s;
            let times: Vec<String> =
                pictures.iter().map(|pose| format!("{:.4}", (pose.stick_figure.time_s - begin) / seconds)).collect();
            let clock = PictureTimes { seconds, times: times.join(";") };
            self.draw_ground(svg, &clock)?;
            let stick_figures: Vec<&StickFigure> = pictures.iter().map(|pose| pose.stick_figure).collect();
            for part in parts(first.stick_figure) {
                if part.class == "right" {
                    self.draw_muscles(svg, &pictures, &clock, true)?;
                }
                draw_moving(svg, part.class, &part.outline, &placements(part.segment, &stick_figures), &clock)?;
                if part.class == "right" {
                    self.draw_muscles(svg, &pictures, &clock, false)?;
                }
            }
            self.draw_forces(svg, &pictures, &clock)?;
        }
        write!(svg, "</svg>")
    }

    /// Marks at a whole share of the stride, so that the end of the loop is not seen.
    fn draw_ground(&self, svg: &mut String, clock: &PictureTimes) -> std::fmt::Result {
        let [left, _, width, _] = self.walker.view_box();
        // A malformed gait may have any length.
        let stride_m = self.walker.stride_length_m.clamp(MARK_M, MAX_STRIDE_M);
        let stride = stride_m * UNITS_PER_M;
        let mark = stride / (stride_m / MARK_M).round();
        write!(svg, "<path class=\"ground\" d=\"M{left} 0h{width}\"/><path class=\"ground\" d=\"")?;
        let mut x = left;
        while x < left + width + stride {
            write!(svg, "M{x:.1} 0v5")?;
            x += mark;
        }
        write!(
            svg,
            "\"><animateTransform attributeName=\"transform\" type=\"translate\" values=\"0 0;{:.1} 0\" dur=\"{:.3}s\" repeatCount=\"indefinite\"/></path>",
            -stride, clock.seconds
        )
    }

    fn draw_muscles(
        &self,
        svg: &mut String,
        pictures: &[Pose<'_>],
        clock: &PictureTimes,
        of_left: bool,
    ) -> std::fmt::Result {
        let Some(first) = pictures.first().filter(|_| self.walker.has_muscles()) else { return Ok(()) };
        let peaks = self.walker.peaks();
        for (muscle, path) in
            muscle_paths(first.stick_figure).iter().enumerate().filter(|(muscle, _)| is_left(*muscle) == of_left)
        {
            let share = |pose: &Pose<'_>| pose.activations.map_or(0.0, |now| share_of_peak(now[muscle], peaks[muscle]));
            let line = |pose: &Pose<'_>| muscle_line(path, pose.stick_figure);
            write!(
                svg,
                "<path class=\"muscle\" d=\"{}\" stroke-width=\"{:.1}\" stroke-opacity=\"{:.2}\">",
                line(first),
                muscle_width(share(first)),
                muscle_opacity(share(first))
            )?;
            clock.animate(svg, "d", pictures.iter().map(line))?;
            clock.animate(
                svg,
                "stroke-width",
                pictures.iter().map(|pose| format!("{:.1}", muscle_width(share(pose)))),
            )?;
            clock.animate(
                svg,
                "stroke-opacity",
                pictures.iter().map(|pose| format!("{:.2}", muscle_opacity(share(pose)))),
            )?;
            write!(svg, "</path>")?;
        }
        Ok(())
    }

    fn draw_forces(&self, svg: &mut String, pictures: &[Pose<'_>], clock: &PictureTimes) -> std::fmt::Result {
        for side in 0..2 {
            // A path keeps its commands while it moves, so a foot in swing has an arrow of no length, out of sight.
            let arrow = |pose: &Pose<'_>| {
                let arrow = self.walker.arrows(pose)[side].clone();
                if arrow.is_empty() { "M0 900L0 900M0 900L0 900L0 900".to_owned() } else { arrow }
            };
            let Some(first) = pictures.first() else { return Ok(()) };
            write!(svg, "<path class=\"force\" d=\"{}\">", arrow(first))?;
            clock.animate_in_steps(svg, "d", pictures.iter().map(arrow))?;
            write!(svg, "</path>")?;
        }
        Ok(())
    }
}

/// Units of the file per unit of the walker.
const SCALE: f64 = 3.0;

/// When the pictures of the stride are shown.
struct PictureTimes {
    seconds: f64,
    /// Share of the stride at each picture.
    times: String,
}

impl PictureTimes {
    fn animate(&self, svg: &mut String, attribute: &str, values: impl Iterator<Item = String>) -> std::fmt::Result {
        self.write(svg, "animate", &format!("attributeName=\"{attribute}\""), values)
    }

    fn animate_in_steps(
        &self,
        svg: &mut String,
        attribute: &str,
        values: impl Iterator<Item = String>,
    ) -> std::fmt::Result {
        self.write(svg, "animate", &format!("attributeName=\"{attribute}\" calcMode=\"discrete\""), values)
    }

    fn write(
        &self,
        svg: &mut String,
        element: &str,
        what: &str,
        values: impl Iterator<Item = String>,
    ) -> std::fmt::Result {
        let values = values.collect::<Vec<_>>().join(";");
        write!(
            svg,
            "<{element} {what} values=\"{values}\" keyTimes=\"{}\" dur=\"{:.3}s\" repeatCount=\"indefinite\"/>",
            self.times, self.seconds
        )
    }
}

/// The placements of a segment, with rotations that never jump by a whole turn.
fn placements(segment: Segment, stick_figures: &[&StickFigure]) -> Vec<Placement> {
    let mut placements: Vec<Placement> =
        stick_figures.iter().map(|stick_figure| segment.placement(stick_figure)).collect();
    for place in 1..placements.len() {
        let turns = ((placements[place - 1].degrees - placements[place].degrees) / 360.0).round();
        placements[place].degrees += 360.0 * turns;
    }
    placements
}

fn draw_moving(
    svg: &mut String,
    class: &str,
    outline: &str,
    places: &[Placement],
    clock: &PictureTimes,
) -> std::fmt::Result {
    let Some(first) = places.first() else { return Ok(()) };
    write!(svg, "<g transform=\"translate({:.1} {:.1})\">", first.x, first.y)?;
    let what = |kind: &str| format!("attributeName=\"transform\" type=\"{kind}\"");
    clock.write(
        svg,
        "animateTransform",
        &what("translate"),
        places.iter().map(|p| format!("{:.1} {:.1}", p.x, p.y)),
    )?;
    write!(svg, "<path class=\"{class}\" transform=\"rotate({:.1})\" d=\"{outline}\">", first.degrees)?;
    clock.write(svg, "animateTransform", &what("rotate"), places.iter().map(|p| format!("{:.1}", p.degrees)))?;
    write!(svg, "</path></g>")
}

#[cfg(test)]
mod tests {
    use super::super::segment::tests::standing;
    use super::*;

    #[test]
    fn rotation_never_jumps_by_a_whole_turn() {
        let toe_at = |degrees: f64| {
            let mut stick_figure = standing();
            let (sine, cosine) = degrees.to_radians().sin_cos();
            stick_figure.left.toe = [stick_figure.left.heel[0] + 0.2 * cosine, stick_figure.left.heel[1] - 0.2 * sine];
            stick_figure
        };
        let stick_figures: Vec<StickFigure> = [170.0, 179.0, 188.0, 197.0].map(toe_at).into();
        let turned = placements(Segment::LeftFoot, &stick_figures.iter().collect::<Vec<_>>());
        for pair in turned.windows(2) {
            assert!((pair[1].degrees - pair[0].degrees - 9.0).abs() < 1e-6, "{turned:?}");
        }
    }
}
