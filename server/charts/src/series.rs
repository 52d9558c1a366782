//! Lines and areas of a chart.

use super::escaped_text::escape;
use super::simplified::simplified;
use std::fmt::Write;

/// Style of a series. Lines differ by dash pattern, not by colour alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stroke {
    /// A line.
    Solid,
    /// A dashed line.
    Dashed,
    /// A dotted line.
    Dotted,
    /// A line of alternating dashes and dots.
    DashDotted,
    /// A line of long dashes.
    LongDashed,
    /// Points only.
    Points,
    /// A step line with a mark at each point.
    Steps,
    /// A dashed step line with a mark at each point.
    DashedSteps,
    /// A dotted step line with a mark at each point.
    DottedSteps,
    /// A step line of alternating dashes and dots with a mark at each point.
    DashDottedSteps,
    /// A step line of long dashes with a mark at each point.
    LongDashedSteps,
    /// A line with a mark at each point.
    Marked,
}

/// An area between two lines.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// Name in the legend.
    pub label: String,
    /// x, lower y, upper y.
    pub points: Vec<(f64, f64, f64)>,
    /// Colour of the palette, 0 to 9.
    pub colour: usize,
}

/// One line of a chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub label: String,
    /// Points. A point that is not finite interrupts the line.
    pub points: Vec<(f64, f64)>,
    /// Colour of the palette, 0 to 9.
    pub colour: usize,
    /// Style.
    pub stroke: Stroke,
    /// Link of each point on a page; empty if the points are no links.
    pub links: Vec<PointLink>,
}

/// A link of a page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PointLink {
    /// Address.
    pub address: String,
    /// Name.
    pub name: String,
}

impl PointLink {
    /// Opens the link. Not in the order of the keyboard: a table of the page has the same links.
    pub(super) fn open(&self, svg: &mut String) -> std::fmt::Result {
        let (address, name) = (escape(&self.address), escape(&self.name));
        write!(svg, "<a href=\"{address}\" tabindex=\"-1\" aria-label=\"{name}\">")
    }
}

impl Stroke {
    /// Dash patterns that distinguish lines without colours. They repeat after five.
    pub const DISTINCT: [Self; 5] = [Self::Solid, Self::Dashed, Self::Dotted, Self::DashDotted, Self::LongDashed];

    /// The same dash patterns for step lines.
    pub const DISTINCT_STEPS: [Self; 5] =
        [Self::Steps, Self::DashedSteps, Self::DottedSteps, Self::DashDottedSteps, Self::LongDashedSteps];

    pub(super) fn class(self) -> &'static str {
        match self {
            Self::Solid | Self::Steps | Self::Marked => "solid",
            Self::Dashed | Self::DashedSteps => "dashed",
            Self::Dotted | Self::DottedSteps => "dotted",
            Self::DashDotted | Self::DashDottedSteps => "dash_dotted",
            Self::LongDashed | Self::LongDashedSteps => "long_dashed",
            Self::Points => "points",
        }
    }
}

impl Band {
    pub(super) fn draw(
        &self,
        svg: &mut String,
        px: &impl Fn(f64) -> f64,
        py: &impl Fn(f64) -> f64,
    ) -> std::fmt::Result {
        write!(svg, "<path class=\"band c{}\" d=\"", self.colour % 10)?;
        let low = self.points.iter().map(|&(x, low, _)| (x, low));
        let high = self.points.iter().rev().map(|&(x, _, high)| (x, high));
        for (i, (x, y)) in low.chain(high).enumerate() {
            write!(svg, "{}{:.1} {:.1}", if i == 0 { 'M' } else { 'L' }, px(x), py(y))?;
        }
        write!(svg, "Z\"/>")
    }
}

impl Series {
    pub(super) fn draw(
        &self,
        svg: &mut String,
        px: &impl Fn(f64) -> f64,
        py: &impl Fn(f64) -> f64,
        with_links: bool,
    ) -> std::fmt::Result {
        let colour = self.colour % 10;
        if self.stroke != Stroke::Points {
            write!(svg, "<path class=\"line c{colour} {}\" d=\"", self.stroke.class())?;
            let seen = |(x, y): &(f64, f64)| x.is_finite() && y.is_finite();
            for run in self.points.split(|point| !seen(point)) {
                let mut places: Vec<(f64, f64)> = run.iter().map(|&(x, y)| (px(x), py(y))).collect();
                let steps = Stroke::DISTINCT_STEPS.contains(&self.stroke);
                if Stroke::DISTINCT.contains(&self.stroke) {
                    places = simplified(&places);
                }
                let last = places.len().saturating_sub(1);
                for (place, (x, y)) in places.iter().enumerate() {
                    // A step to the same height continues the line.
                    let continues = place > 0 && place < last && *y == places[place - 1].1 && *y == places[place + 1].1;
                    match (place, steps) {
                        (0, _) => write!(svg, "M{x:.1} {y:.1}")?,
                        (_, true) if continues => {}
                        (_, true) => write!(svg, "H{x:.1}V{y:.1}")?,
                        (_, false) => write!(svg, "L{x:.1} {y:.1}")?,
                    }
                }
            }
            write!(svg, "\"/>")?;
        }
        if !Stroke::DISTINCT.contains(&self.stroke) {
            let links = self.links.iter().map(Some).chain(std::iter::repeat(None));
            let drawn = self.points.iter().zip(links).filter(|((x, y), _)| x.is_finite() && y.is_finite());
            for (&(x, y), link) in drawn {
                let link = link.filter(|_| with_links);
                let radius = if link.is_some() { 5 } else { 3 };
                link.map_or(Ok(()), |link| link.open(svg))?;
                let (x, y) = (px(x), py(y));
                write!(svg, "<circle class=\"dot c{colour}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\"/>")?;
                svg.push_str(if link.is_some() { "</a>" } else { "" });
            }
        }
        Ok(())
    }
}
