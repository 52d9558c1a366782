//! A gait over its cycle: from right heel strike, or for each leg from its own.

use crate::gait_series::{Point, points};
use crate::{Chart, LegCycle, Span, Stroke};
use gait_optimizer::Gait;

/// Colour of the right leg, as in the stick figures; the left one has the first colour.
pub(super) const RIGHT: usize = 3;

/// Number of moments of a stride at which the cursor is shown on a limit cycle.
const MOMENTS: usize = 101;

/// The points of a gait on the axis of the gait cycle.
pub(super) struct Cycle<'a> {
    points: Vec<Point<'a>>,
    end: f64,
    spans: Vec<Span>,
    /// Index of the node at which the left heel strikes.
    left_strike: usize,
    /// When the feet leave the ground, percent from right heel strike: left, right.
    toe_off_percent: [Option<f64>; 2],
}

/// A leg with its cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Leg {
    Left,
    Right,
}

impl Leg {
    pub(super) fn colour(self) -> usize {
        match self {
            Self::Left => 0,
            Self::Right => RIGHT,
        }
    }

    /// Name in legends.
    pub(super) fn label(self) -> &'static str {
        match self {
            Self::Left => "left leg",
            Self::Right => "right leg (prosthetic side)",
        }
    }

    /// Its side in words.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }

    pub(super) fn stroke(self) -> Stroke {
        match self {
            Self::Left => Stroke::Solid,
            Self::Right => Stroke::Dashed,
        }
    }
}

/// Name and look of a curve.
#[derive(Debug, Clone, Copy)]
pub(super) struct Look<'a> {
    pub(super) label: &'a str,
    pub(super) colour: usize,
    pub(super) stroke: Stroke,
}

impl Look<'_> {
    /// The look of a leg where both legs of a gait are in one chart.
    pub(super) fn of(leg: Leg) -> Self {
        Self { label: leg.label(), colour: leg.colour(), stroke: leg.stroke() }
    }
}

impl<'a> Cycle<'a> {
    pub(super) fn of(gait: &'a Gait) -> Self {
        let points = points(gait);
        let end = points.last().map_or(1.0, |point| point.time_s).max(1e-9);
        let spans = domains(&points, end);
        let start = |domain: &str| points.iter().position(|point| point.domain == domain);
        // The single support of a leg begins when the other foot leaves the ground.
        let percent = |domain: &str| start(domain).map(|place| 100.0 * points[place].time_s / end);
        let (left_strike, toe_off_percent) = (start("DS2_L").unwrap_or(0), [percent("SS2_R"), percent("SS2_L")]);
        Self { points, end, spans, left_strike, toe_off_percent }
    }

    /// A line over the cycle, with a gap between domains: forces, torques and accelerations may jump there.
    pub(super) fn over(&self, y: impl FnMut(&Point<'_>) -> f64) -> Vec<(f64, f64)> {
        line(self.points.iter(), |point| 100.0 * point.time_s / self.end, y, |_| true)
    }

    /// The limit cycle of a coordinate, °, °/s, with a gap where an impact makes its velocity jump: before each double support.
    pub(super) fn limit_cycle(&self, q: usize) -> Vec<(f64, f64)> {
        let (angle, velocity) = (|p: &Point<'_>| p.q[q].to_degrees(), |p: &Point<'_>| p.qd[q].to_degrees());
        line(self.points.iter(), angle, velocity, |domain| domain.starts_with("DS"))
    }

    /// The limit cycle of a coordinate at equal shares of the stride, °, °/s.
    pub(super) fn moments(&self, q: usize) -> Vec<(f64, f64)> {
        let at = |moment: usize| {
            let time = self.end * moment as f64 / (MOMENTS - 1) as f64;
            let point = self.points.iter().find(|point| point.time_s >= time - 1e-9)?;
            Some((point.q[q].to_degrees(), point.qd[q].to_degrees()))
        };
        (0..MOMENTS).filter_map(at).collect()
    }

    /// Where in the stride the cycle of a leg begins, percent from right heel strike.
    fn strike_percent(&self, leg: Leg) -> f64 {
        match leg {
            Leg::Left => self.points.get(self.left_strike).map_or(0.0, |point| 100.0 * point.time_s / self.end),
            Leg::Right => 0.0,
        }
    }

    /// Adds the line of a leg, over the cycle from its own heel strike.
    pub(super) fn with_leg(&self, chart: Chart, leg: Leg, y: impl FnMut(&Point<'_>) -> f64) -> Chart {
        self.with_line(chart, leg, &Look::of(leg), y)
    }

    /// The same with another name and look.
    pub(super) fn with_line(&self, chart: Chart, leg: Leg, look: &Look<'_>, y: impl FnMut(&Point<'_>) -> f64) -> Chart {
        let strike = self.strike_percent(leg);
        // The stride is periodic: what comes before the strike follows its end.
        let (before, after) = match leg {
            Leg::Left => self.points.split_at(self.left_strike),
            Leg::Right => self.points.split_at(0),
        };
        let own = after.iter().map(|p| (p, 0.0)).chain(before.iter().map(|p| (p, 100.0)));
        let mut places = own.clone().map(|(point, later)| 100.0 * point.time_s / self.end - strike + later);
        let own = own.map(|(point, _)| point);
        let points = line(own, |_| places.next().unwrap_or(f64::NAN), y, |_| true);
        let mut chart = chart.with(look.label, look.colour, look.stroke, points);
        let toe_off = self.toe_off_percent[usize::from(leg == Leg::Right)];
        chart.cycles.push(LegCycle {
            colour: Some(look.colour),
            begins_percent: strike,
            toe_off_percent: toe_off.map(|percent| (percent - strike).rem_euclid(100.0)),
        });
        chart
    }

    /// With the domains of the stride, for a chart from right heel strike.
    pub(super) fn marked(&self, mut chart: Chart) -> Chart {
        chart.spans.clone_from(&self.spans);
        chart.cycles = vec![LegCycle { colour: None, begins_percent: 0.0, toe_off_percent: None }];
        chart
    }
}

fn line<'p, 'a: 'p>(
    points: impl Iterator<Item = &'p Point<'a>>,
    mut x: impl FnMut(&Point<'_>) -> f64,
    mut y: impl FnMut(&Point<'_>) -> f64,
    jumps_into: impl Fn(&str) -> bool,
) -> Vec<(f64, f64)> {
    let mut line: Vec<(f64, f64)> = Vec::with_capacity(points.size_hint().0 + 8);
    let mut domain = None;
    for point in points {
        if domain.is_some_and(|domain| domain != point.domain) && jumps_into(point.domain) {
            line.push((f64::NAN, f64::NAN));
        }
        domain = Some(point.domain);
        line.push((x(point), y(point)));
    }
    line
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

#[cfg(test)]
mod tests {
    use super::*;

    const ANGLES: [f64; 9] = [0.0; 9];
    const TORQUES: [f64; 6] = [0.0; 6];

    /// Two nodes in each domain of a stride of one second; the left heel strikes after 0.4 s.
    fn stride() -> Cycle<'static> {
        let domains = [
            ("DS2_R", 0.0),
            ("DS3_R", 0.05),
            ("SS2_R", 0.1),
            ("SS1_R", 0.3),
            ("DS2_L", 0.4),
            ("DS3_L", 0.5),
            ("SS2_L", 0.6),
            ("SS1_L", 0.9),
        ];
        let ends = domains.iter().skip(1).map(|(_, start)| *start).chain([1.0]);
        let point = |time_s, domain| Point {
            time_s,
            domain,
            q: &ANGLES,
            qd: &ANGLES,
            qdd: &ANGLES,
            u: &TORQUES,
            forces: [0.0; 8],
            activation: None,
            fibre_length: None,
        };
        let points: Vec<Point<'_>> = domains
            .iter()
            .zip(ends)
            .flat_map(|((name, start), end)| [point(*start, *name), point(end, *name)])
            .collect();
        Cycle { spans: Vec::new(), end: 1.0, left_strike: 8, toe_off_percent: [Some(10.0), Some(60.0)], points }
    }

    #[test]
    fn each_leg_begins_at_its_own_heel_strike_and_ends_after_one_stride() {
        let cycle = stride();
        let of = |leg| {
            let chart = cycle.with_leg(Chart::new("", "", ""), leg, |point| point.time_s);
            let points: Vec<_> = chart.series[0].points.iter().copied().filter(|(x, _)| x.is_finite()).collect();
            (chart.cycles[0].clone(), points)
        };
        let (right, points) = of(Leg::Right);
        assert_eq!((right.begins_percent, right.toe_off_percent), (0.0, Some(60.0)));
        assert!(points.iter().all(|(x, time)| (x - 100.0 * time).abs() < 1e-9));
        let (left, points) = of(Leg::Left);
        assert_eq!((left.begins_percent, left.toe_off_percent), (40.0, Some(70.0)));
        assert_eq!((points[0], points[points.len() - 1]), ((0.0, 0.4), (100.0, 0.4)));
        assert!(points.windows(2).all(|pair| pair[0].0 <= pair[1].0 + 1e-9), "{points:?}");
    }
}
