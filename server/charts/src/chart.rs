//! Line charts as SVG.

use super::axis::{ChartAxis, power_of_ten};
use super::escaped_text::escape;
use super::series::{Band, PointLink, Series, Stroke};
use std::fmt::Write;

/// A named interval of the x axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Span {
    /// Start.
    pub from: f64,
    /// End.
    pub to: f64,
    /// Name above the interval, if there is room.
    pub name: String,
    /// Whether it is shaded.
    pub shaded: bool,
}

/// The cycle of a leg on an x axis in percent: from its own heel strike, or from that of the other leg.
#[derive(Debug, Clone, PartialEq)]
pub struct LegCycle {
    /// Colour of the lines of this leg; `None`: all lines.
    pub colour: Option<usize>,
    /// Where in the stride the axis begins, percent from right heel strike.
    pub begins_percent: f64,
    /// End of stance, percent of the axis; `None`: not marked.
    pub toe_off_percent: Option<f64>,
}

/// A chart of lines over one axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Title.
    pub title: String,
    /// Label of the x axis, with its unit.
    pub x_label: String,
    /// Label of the y axis, with its unit.
    pub y_label: String,
    /// Areas behind the lines.
    pub bands: Vec<Band>,
    /// The lines.
    pub series: Vec<Series>,
    /// Vertical lines, numbered above the chart and named in the legend.
    pub marks: Vec<(f64, String)>,
    /// Named intervals of the x axis.
    pub spans: Vec<Span>,
    /// The cycles of the x axis, if it is one: for the marks of stance and swing, and for the cursor of the page.
    pub cycles: Vec<LegCycle>,
    /// Where lines are at equal shares of the stride, from its start to its end, for the cursor of the page: colour and
    /// points. For charts whose x axis is not the cycle.
    pub moments: Vec<(usize, Vec<(f64, f64)>)>,
    /// Whether the x axis shows whole numbers only.
    pub whole_x: bool,
    /// Whether the y axis is logarithmic.
    pub log_y: bool,
    /// Minimum range of the y axis, for charts that are compared.
    pub y_range: Option<(f64, f64)>,
    /// Ticks of the x axis. Empty: round values.
    pub x_ticks: Vec<f64>,
}

/// Size of the drawing and its margins. The margins leave room for the larger text that the style sheet sets in narrow
/// drawings.
const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 330.0;
const LEFT: f64 = 74.0;
const RIGHT: f64 = 24.0;
const TOP: f64 = 58.0;
const BOTTOM: f64 = 60.0;
/// Distance between the bars of two cycles, and height of the bars of more than two.
const STANCE_ROW: f64 = 10.0;
const STANCE_ROWS: f64 = 21.0;
/// Least gap between the numbers of two marks.
const MARK_GAP: f64 = 6.0;
/// Width of a character of a name above the chart, at the largest text size.
const NAME_CHARACTER: f64 = 16.0;
/// Meaning of the bars above a chart, for its legend.
const STANCES: &str = "bar above: stance, then swing; dotted line: foot off";
/// Smallest value on a logarithmic axis.
const MIN_LOG_VALUE: f64 = 1e-16;

impl Chart {
    /// A chart without lines.
    pub fn new(title: &str, x_label: &str, y_label: &str) -> Self {
        Self {
            title: title.to_owned(),
            x_label: x_label.to_owned(),
            y_label: y_label.to_owned(),
            bands: Vec::new(),
            series: Vec::new(),
            marks: Vec::new(),
            spans: Vec::new(),
            cycles: Vec::new(),
            moments: Vec::new(),
            whole_x: false,
            log_y: false,
            y_range: None,
            x_ticks: Vec::new(),
        }
    }

    /// Adds a line.
    #[must_use]
    pub fn with(mut self, label: &str, colour: usize, stroke: Stroke, points: Vec<(f64, f64)>) -> Self {
        self.series.push(Series { label: label.to_owned(), points, colour, stroke, links: Vec::new() });
        self
    }

    /// Adds points that are links on a page.
    #[must_use]
    pub fn with_links(mut self, label: &str, colour: usize, points: Vec<((f64, f64), PointLink)>) -> Self {
        let (points, links) = points.into_iter().unzip();
        self.series.push(Series { label: label.to_owned(), points, colour, stroke: Stroke::Points, links });
        self
    }

    /// Adds an area between two lines.
    #[must_use]
    pub fn with_band(mut self, label: &str, colour: usize, points: Vec<(f64, f64, f64)>) -> Self {
        self.bands.push(Band { label: label.to_owned(), points, colour });
        self
    }

    /// Width and height of the drawing.
    pub(super) const SIZE: (f64, f64) = (WIDTH, HEIGHT);

    /// The chart as an SVG element.
    pub fn svg(&self) -> String {
        let name = escape(&format!("{}: {} over {}", self.title, self.y_label, self.x_label));
        let body = self.drawn(true);
        // The content of a picture cannot have links.
        let role = if self.series.iter().any(|series| !series.links.is_empty()) { "group" } else { "img" };
        let (x, y) = self.axes();
        // Position and range of the axes, for the script that reads values under the pointer.
        let plot = format!(
            "data-right=\"{LEFT} {} {} {}\" data-up=\"{} {TOP} {} {}\" data-logarithmic=\"{}\"",
            WIDTH - RIGHT,
            x.from,
            x.to,
            HEIGHT - BOTTOM,
            y.from,
            y.to,
            self.log_y
        );
        let labels = format!("data-across=\"{}\" data-along=\"{}\"", escape(&self.x_label), escape(&self.y_label));
        format!(
            "<svg class=\"chart\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"{role}\" aria-label=\"{name}\" {plot} {labels}{}>{body}</svg>",
            self.cursor_data(&x, &y)
        )
    }

    /// For the script of the cursor: the lines of each cycle and where in the stride it begins, and places of lines.
    fn cursor_data(&self, x: &ChartAxis, y: &ChartAxis) -> String {
        let cycle = |cycle: &LegCycle| {
            let lines = cycle.colour.map_or_else(|| "*".to_owned(), |colour| format!("c{}", colour % 10));
            format!("{lines} {:.2}", cycle.begins_percent)
        };
        let moments = |(colour, points): &(usize, Vec<(f64, f64)>)| {
            let place = |&(right, up): &(f64, f64)| {
                let across = LEFT + x.place(right) * (WIDTH - RIGHT - LEFT);
                format!(" {across:.1} {:.1}", HEIGHT - BOTTOM - y.place(self.height(up)) * (HEIGHT - BOTTOM - TOP))
            };
            format!("c{}{}", colour % 10, points.iter().map(place).collect::<String>())
        };
        let attribute = |name: &str, values: Vec<String>| {
            if values.is_empty() { String::new() } else { format!(" data-{name}=\"{}\"", values.join(",")) }
        };
        let cycles = attribute("cycles", self.cycles.iter().map(cycle).collect());
        cycles + &attribute("moments", self.moments.iter().map(moments).collect())
    }

    /// The elements of a self-contained figure, without links.
    pub(super) fn body(&self) -> String {
        self.drawn(false)
    }

    fn drawn(&self, with_links: bool) -> String {
        let (x, y) = self.axes();
        let mut svg = String::with_capacity(16 * 1024);
        // Writing to a String cannot fail.
        let _ = self.draw(&mut svg, &x, &y, with_links);
        svg
    }

    fn axes(&self) -> (ChartAxis, ChartAxis) {
        let all = || self.series.iter().flat_map(|series| series.points.iter());
        let mut x = ChartAxis::over(all().map(|p| p.0), 8, true);
        if self.whole_x {
            x.keep_whole_ticks();
        }
        if !self.x_ticks.is_empty() {
            x.set_ticks(&self.x_ticks);
        }
        let areas = self.bands.iter().flat_map(|band| band.points.iter()).flat_map(|p| [p.1, p.2]);
        let least = self.y_range.into_iter().flat_map(|(low, high)| [low, high]);
        let values = all().map(|p| p.1).chain(areas).chain(least).filter(|value| value.is_finite());
        let mut y = ChartAxis::over(values.map(|value| self.height(value)), 5, false);
        if self.log_y {
            y.keep_whole_ticks();
        }
        (x, y)
    }

    /// Position of a value on the y axis.
    fn height(&self, value: f64) -> f64 {
        if self.log_y { value.max(MIN_LOG_VALUE).log10() } else { value }
    }

    /// Class and label of each visible line and other mark, for a legend in HTML.
    pub fn legend(&self) -> Vec<(String, String)> {
        let seen = |s: &&Series| s.points.iter().any(|(x, y)| x.is_finite() && y.is_finite());
        let lines = self.series.iter().filter(seen);
        let lines = lines.map(|s| (format!("key c{} {}", s.colour % 10, s.stroke.class()), s.label.clone()));
        let bands = self.bands.iter().map(|b| (format!("key c{} band", b.colour % 10), b.label.clone()));
        let marks = self.marks.iter().zip(1..).map(|((_, name), n)| ("key begins".to_owned(), format!("{n} {name}")));
        let has_stances = self.cycles.iter().any(|cycle| cycle.colour.is_some() && cycle.toe_off_percent.is_some());
        let stances = has_stances.then(|| ("key stance".to_owned(), STANCES.to_owned()));
        lines.chain(bands).chain(marks).chain(stances).collect()
    }

    fn draw(&self, svg: &mut String, x: &ChartAxis, y: &ChartAxis, with_links: bool) -> std::fmt::Result {
        let (right, bottom) = (WIDTH - RIGHT, HEIGHT - BOTTOM);
        let px = |value: f64| LEFT + x.place(value) * (right - LEFT);
        let at_height = |height: f64| bottom - y.place(height) * (bottom - TOP);
        let py = |value: f64| at_height(self.height(value));
        self.draw_spans(svg, &px)?;
        self.draw_stances(svg, &px)?;
        for &tick in &y.ticks {
            let at = at_height(tick);
            let text = if self.log_y { power_of_ten(format_args!("{tick:.0}")) } else { y.text(tick) };
            write!(svg, "<path class=\"grid\" d=\"M{LEFT} {at:.1}H{right}\"/>")?;
            write!(svg, "<text class=\"tick y\" x=\"{}\" y=\"{:.1}\">{text}</text>", LEFT - 8.0, at + 5.0)?;
        }
        for &tick in &x.ticks {
            let at = px(tick);
            write!(svg, "<path class=\"grid\" d=\"M{at:.1} {bottom}v5\"/>")?;
            write!(svg, "<text class=\"tick x\" x=\"{at:.1}\" y=\"{}\">{}</text>", bottom + 27.0, x.text(tick))?;
        }
        write!(svg, "<path class=\"axis\" d=\"M{LEFT} {TOP}V{bottom}H{right}\"/>")?;
        for band in &self.bands {
            band.draw(svg, &px, &py)?;
        }
        for series in &self.series {
            series.draw(svg, &px, &py, with_links)?;
        }
        self.draw_marks(svg, &px)?;
        write!(
            svg,
            "<text class=\"label\" x=\"{:.1}\" y=\"{}\">{}</text>",
            f64::midpoint(LEFT, right),
            HEIGHT - 8.0,
            escape(&self.x_label)
        )?;
        write!(svg, "<text class=\"label start\" x=\"4\" y=\"18\">{}</text>", escape(&self.y_label))
    }
}

impl Chart {
    /// Draws marks with numbers instead of names, because names would overlap the lines.
    fn draw_marks(&self, svg: &mut String, px: &impl Fn(f64) -> f64) -> std::fmt::Result {
        let bottom = HEIGHT - BOTTOM;
        let places: Vec<f64> = self.marks.iter().map(|(value, _)| px(*value)).collect();
        for at in &places {
            write!(svg, "<path class=\"mark\" d=\"M{at:.1} {TOP}V{bottom}\"/>")?;
        }
        for (x, text) in numbers(&places) {
            // Right of the mark, so that the number of a mark on the axis does not touch the topmost tick.
            let x = x + NAME_CHARACTER / 2.0;
            write!(svg, "<text class=\"label\" x=\"{x:.1}\" y=\"{}\">{text}</text>", TOP - 6.0)?;
        }
        Ok(())
    }

    /// Draws a bar above the chart for each cycle, thick in stance and thin in swing, and a line at the end of stance.
    fn draw_stances(&self, svg: &mut String, px: &impl Fn(f64) -> f64) -> std::fmt::Result {
        let bottom = HEIGHT - BOTTOM;
        let (first, distance) = match self.cycles.len() {
            0..=2 => (TOP - 20.0, STANCE_ROW),
            more => (TOP - 26.0, STANCE_ROWS / (more - 1) as f64),
        };
        for (row, cycle) in self.cycles.iter().enumerate() {
            let (Some(colour), Some(toe_off)) = (cycle.colour, cycle.toe_off_percent) else { continue };
            let (y, colour) = (first + distance * row as f64, colour % 10);
            let (strike, toe_off, end) = (px(0.0), px(toe_off), px(100.0));
            write!(svg, "<path class=\"stance c{colour}\" d=\"M{strike:.1} {y}H{toe_off:.1}\"/>")?;
            write!(svg, "<path class=\"swing c{colour}\" d=\"M{toe_off:.1} {y}H{end:.1}\"/>")?;
            write!(svg, "<path class=\"toe_off c{colour}\" d=\"M{toe_off:.1} {TOP}V{bottom}\"/>")?;
        }
        Ok(())
    }

    fn draw_spans(&self, svg: &mut String, px: &impl Fn(f64) -> f64) -> std::fmt::Result {
        let bottom = HEIGHT - BOTTOM;
        for span in &self.spans {
            let (from, to) = (px(span.from), px(span.to));
            if span.shaded {
                write!(svg, "<path class=\"span\" d=\"M{from:.1} {TOP}H{to:.1}V{bottom}H{from:.1}Z\"/>")?;
            } else {
                write!(svg, "<path class=\"mark\" d=\"M{from:.1} {TOP}V{bottom}\"/>")?;
            }
            if NAME_CHARACTER * span.name.chars().count() as f64 <= to - from {
                let (middle, above) = (f64::midpoint(from, to), TOP - 6.0);
                let name = escape(&span.name);
                write!(svg, "<text class=\"label\" x=\"{middle:.1}\" y=\"{above}\">{name}</text>")?;
            }
        }
        Ok(())
    }
}

/// Position and text of the numbers of marks. Numbers that would touch are merged, as in `2\u{2013}4`.
fn numbers(places: &[f64]) -> Vec<(f64, String)> {
    let text = |from: usize, to: usize| {
        if from == to { format!("{}", from + 1) } else { format!("{}\u{2013}{}", from + 1, to + 1) }
    };
    let middle = |from: usize, to: usize| f64::midpoint(places[from], places[to]);
    let half = |from: usize, to: usize| NAME_CHARACTER * text(from, to).chars().count() as f64 / 2.0;
    let mut groups: Vec<(usize, usize)> = Vec::new();
    for mark in 0..places.len() {
        let mut group = (mark, mark);
        // A merged number is wider and may touch the previous one.
        while let Some(&(from, to)) = groups.last() {
            let free = middle(group.0, group.1) - half(group.0, group.1) - middle(from, to) - half(from, to);
            if free >= MARK_GAP {
                break;
            }
            groups.pop();
            group.0 = from;
        }
        groups.push(group);
    }
    groups.into_iter().map(|(from, to)| (middle(from, to), text(from, to))).collect()
}

#[cfg(test)]
mod tests;
