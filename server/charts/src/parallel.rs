//! Parallel coordinates: one axis for each tuned bound and one for the outcome, and a line for each trial. The better the
//! outcome, the stronger the line. The last axis shows the outcome itself, so no information is in the colour alone.

use super::axis::ChartAxis;
use super::escaped_text::escape;
use super::series::PointLink;
use std::fmt::Write;

/// The axis of a bound.
#[derive(Debug, Clone, PartialEq)]
pub struct ParallelAxis {
    /// Short name.
    pub name: String,
    /// Meaning with its unit.
    pub meaning: String,
    /// Values, ascending.
    pub values: Vec<f64>,
}

/// The line of a trial.
#[derive(Debug, Clone, PartialEq)]
pub struct ParallelLine {
    /// The trial.
    pub link: PointLink,
    /// The level on each axis.
    pub levels: Vec<usize>,
    /// The outcome; `None` without a gait.
    pub outcome: Option<f64>,
}

/// Parallel coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct Parallel {
    /// Title.
    pub title: String,
    /// The axes of the bounds.
    pub axes: Vec<ParallelAxis>,
    /// The outcome, with its unit.
    pub outcome: String,
    /// Whether a low outcome is a good one.
    pub low_is_good: bool,
    /// The lines.
    pub lines: Vec<ParallelLine>,
}

const WIDTH: f64 = 960.0;
const HEIGHT: f64 = 360.0;
const LEFT: f64 = 56.0;
const RIGHT: f64 = 40.0;
const TOP: f64 = 40.0;
const BOTTOM: f64 = 44.0;
/// Where lines without an outcome end, below the last axis.
const NO_GAIT: f64 = HEIGHT - 14.0;
/// How far lines at the same level are spread.
const SPREAD: f64 = 14.0;
/// Opacity of the worst line.
const FAINTEST: f64 = 0.15;

impl Parallel {
    /// An SVG element for a page, with links.
    pub fn svg(&self) -> String {
        let name = escape(&self.title);
        let body = self.drawn(true);
        format!(
            "<svg class=\"chart parallel\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"group\" aria-label=\"{name}\">{body}</svg>"
        )
    }

    /// Class and label of the kinds of lines, for a legend in HTML.
    pub fn legend(&self) -> Vec<(String, String)> {
        let mut legend = Vec::new();
        if self.lines.iter().any(|line| line.outcome.is_some()) {
            legend.push((
                "key c0 solid".to_owned(),
                "trial with a gait: the fainter the line, the worse the gait".to_owned(),
            ));
        }
        if self.lines.iter().any(|line| line.outcome.is_none()) {
            legend.push(("key c1 dashed".to_owned(), "trial without a gait".to_owned()));
        }
        legend
    }

    pub(super) const SIZE: (f64, f64) = (WIDTH, HEIGHT);

    /// The elements of a self-contained figure, without links.
    pub(super) fn body(&self) -> String {
        self.drawn(false)
    }

    fn drawn(&self, with_links: bool) -> String {
        let mut svg = String::with_capacity(32 * 1024);
        // Writing to a String cannot fail.
        let _ = self.draw(&mut svg, with_links);
        svg
    }

    /// The lines from the worst to the best, so that the best is drawn over the others; without an outcome first.
    pub(super) fn ranked(&self) -> Vec<&ParallelLine> {
        let mut ranked: Vec<&ParallelLine> = self.lines.iter().collect();
        let badness = |line: &ParallelLine| {
            let outcome = line.outcome.filter(|outcome| outcome.is_finite())?;
            Some(if self.low_is_good { outcome } else { -outcome })
        };
        ranked.sort_by(|a, b| match (badness(a), badness(b)) {
            (Some(a), Some(b)) => b.total_cmp(&a),
            (a, b) => a.is_some().cmp(&b.is_some()),
        });
        ranked
    }

    fn draw(&self, svg: &mut String, with_links: bool) -> std::fmt::Result {
        let bottom = HEIGHT - BOTTOM;
        let step = (WIDTH - LEFT - RIGHT) / self.axes.len().max(1) as f64;
        let x = |place: usize| LEFT + step * place as f64;
        let outcomes = ChartAxis::over(self.lines.iter().filter_map(|line| line.outcome), 5, false);
        let height = |outcome: f64| {
            let place = outcomes.place(outcome);
            // Better outcomes are at the top.
            if self.low_is_good { TOP + place * (bottom - TOP) } else { bottom - place * (bottom - TOP) }
        };
        let level = |axis: &ParallelAxis, level: usize| {
            let levels = axis.values.len();
            let share = if levels < 2 { 0.5 } else { level as f64 / (levels - 1) as f64 };
            bottom - SPREAD - share * (bottom - TOP - 2.0 * SPREAD)
        };
        for (place, axis) in self.axes.iter().enumerate() {
            let at = x(place);
            write!(svg, "<path class=\"axis\" d=\"M{at:.1} {TOP}V{bottom}\"/>")?;
            let name = escape(&axis.name);
            write!(svg, "<text class=\"label\" x=\"{at:.1}\" y=\"{}\">{name}</text>", TOP - 14.0)?;
        }
        let last = x(self.axes.len());
        write!(svg, "<path class=\"axis\" d=\"M{last:.1} {TOP}V{bottom}\"/>")?;
        let name = escape(&self.outcome);
        write!(svg, "<text class=\"label end\" x=\"{}\" y=\"{}\">{name}</text>", WIDTH - 4.0, TOP - 14.0)?;
        let ranked = self.ranked();
        let worse = ranked.iter().filter(|line| line.outcome.is_none()).count();
        let range = ranked.len().saturating_sub(worse + 1).max(1) as f64;
        for (rank, line) in ranked.iter().enumerate() {
            let share = rank as f64 / ranked.len().saturating_sub(1).max(1) as f64 - 0.5;
            let mut path = String::new();
            for (place, (axis, own)) in self.axes.iter().zip(&line.levels).enumerate() {
                let start = if place == 0 { 'M' } else { 'L' };
                write!(path, "{start}{:.1} {:.1}", x(place), level(axis, *own) - SPREAD * share)?;
            }
            let (class, opacity, end) = match line.outcome.filter(|outcome| outcome.is_finite()) {
                Some(outcome) => {
                    let goodness = rank.saturating_sub(worse) as f64 / range;
                    ("c0 solid", FAINTEST + (1.0 - FAINTEST) * goodness * goodness, height(outcome))
                }
                None => ("c1 dashed", 0.5, NO_GAIT),
            };
            write!(path, "L{last:.1} {end:.1}")?;
            if with_links {
                line.link.open(svg)?;
            }
            write!(svg, "<path class=\"line {class}\" stroke-opacity=\"{opacity:.2}\" d=\"{path}\"/>")?;
            let colour = class.split(' ').next().unwrap_or_default();
            write!(svg, "<circle class=\"dot {colour}\" cx=\"{last:.1}\" cy=\"{end:.1}\" r=\"5\"/>")?;
            svg.push_str(if with_links { "</a>" } else { "" });
        }
        // Over the lines, which would make them hard to read.
        for (place, axis) in self.axes.iter().enumerate() {
            for (own, value) in axis.values.iter().enumerate() {
                let y = level(axis, own) - 5.0;
                write!(svg, "<text class=\"tick y over\" x=\"{:.1}\" y=\"{y:.1}\">{value}</text>", x(place) - 6.0)?;
            }
        }
        if ranked.len() > worse {
            for &tick in &outcomes.ticks {
                let (y, text) = (height(tick) + 5.0, outcomes.text(tick));
                write!(svg, "<text class=\"tick y over\" x=\"{:.1}\" y=\"{y:.1}\">{text}</text>", last - 9.0)?;
            }
        }
        if worse > 0 {
            write!(
                svg,
                "<text class=\"tick y over\" x=\"{:.1}\" y=\"{:.1}\">no gait</text>",
                last - 9.0,
                NO_GAIT + 5.0
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(number: usize, level: usize, outcome: Option<f64>) -> ParallelLine {
        let link = PointLink { address: format!("/trials/{number}"), name: format!("trial {number}") };
        ParallelLine { link, levels: vec![level, 0], outcome }
    }

    fn drawing(low_is_good: bool) -> Parallel {
        let axis = |name: &str, values: &[f64]| ParallelAxis {
            name: name.to_owned(),
            meaning: "speed, m/s".to_owned(),
            values: values.to_vec(),
        };
        Parallel {
            title: "All <trials>".to_owned(),
            axes: vec![axis("a1", &[1.0, 2.0]), axis("a2", &[0.5])],
            outcome: "Gait RMSE, rad".to_owned(),
            low_is_good,
            lines: vec![line(1, 0, Some(0.3)), line(2, 1, None), line(3, 1, Some(0.1))],
        }
    }

    #[test]
    fn better_lines_are_stronger_and_drawn_last() {
        let order = |drawing: &Parallel| drawing.ranked().iter().map(|line| line.link.name.clone()).collect::<Vec<_>>();
        assert_eq!(order(&drawing(true)), ["trial 2", "trial 1", "trial 3"]);
        assert_eq!(order(&drawing(false)), ["trial 2", "trial 3", "trial 1"]);
        let svg = drawing(true).svg();
        let opacity = |name: &str| {
            let after = svg.split(&format!("aria-label=\"{name}\"")).nth(1).unwrap();
            after.split("stroke-opacity=\"").nth(1).unwrap().split('"').next().unwrap().parse::<f64>().unwrap()
        };
        assert!(opacity("trial 3") > opacity("trial 1"), "{svg}");
        assert_eq!(drawing(true).legend().len(), 2);
    }

    #[test]
    fn lines_are_links_on_a_page_but_not_in_a_file() {
        let drawing = drawing(true);
        let svg = drawing.svg();
        assert!(svg.matches("<a href=\"/trials/").count() == 3 && svg.contains("All &lt;trials&gt;"), "{svg}");
        assert!(!drawing.body().contains("<a ") && drawing.body().contains("no gait"));
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        let empty = Parallel { lines: Vec::new(), ..drawing };
        assert!(!empty.svg().contains("NaN") && empty.legend().is_empty());
    }
}
