//! A gait among several in one chart.

use super::drawn_gait::{drawn, stroke};
use super::leg_cycle::{Cycle, Leg, Look};
use crate::Chart;
use crate::gait_series::Point;
use gait_optimizer::Gait;

/// A gait as it is drawn, with its name in legends.
pub(super) struct NamedGait<'a>(&'a str, Gait);

/// A gait with the colour and the dash that tell it apart.
pub(super) struct OverlaidGait<'a> {
    name: &'a str,
    place: usize,
    cycle: Cycle<'a>,
    pub(super) mass_kg: f64,
}

/// The gaits as they are drawn. Each comes with its name.
pub(super) fn named<'a>(gaits: &[(&'a str, &Gait)]) -> Vec<NamedGait<'a>> {
    gaits.iter().map(|(name, gait)| NamedGait(name, drawn(gait))).collect()
}

/// The gaits of one chart.
pub(super) fn overlaid<'a>(gaits: &'a [NamedGait<'a>]) -> Vec<OverlaidGait<'a>> {
    let overlaid = |(place, NamedGait(name, gait)): (usize, &'a NamedGait<'a>)| OverlaidGait {
        name,
        place,
        cycle: Cycle::of(gait),
        mass_kg: gait.subject.body_mass_kg,
    };
    gaits.iter().enumerate().map(overlaid).collect()
}

impl OverlaidGait<'_> {
    /// Adds the line of a leg, over the cycle from its own heel strike.
    pub(super) fn with_line(&self, chart: Chart, leg: Leg, y: impl FnMut(&Point<'_>) -> f64) -> Chart {
        let look = Look { label: self.name, colour: self.place, stroke: stroke(self.place) };
        self.cycle.with_line(chart, leg, &look, y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gait_charts::{of_several, with_reference};
    use crate::{Drawing, Stroke};
    use gait_optimizer::{Device, DomainTrajectory, GaitSettings, ReferenceGait, Subject, TunedBounds};
    use std::collections::BTreeSet;

    const DOMAINS: [&str; 8] = ["DS2_R", "DS3_R", "SS2_R", "SS1_R", "DS2_L", "DS3_L", "SS2_L", "SS1_L"];

    /// A stride in which every angle is `angle`, every torque 70 N m and every velocity 2 rad/s.
    fn gait(angle: f64) -> Gait {
        let domain = |(place, name): (usize, &&str)| DomainTrajectory {
            name: (*name).to_owned(),
            duration_s: 0.1,
            time_s: [0.0, 0.05, 0.1].map(|time| 0.1 * place as f64 + time).to_vec(),
            q: vec![[angle; 9]; 3],
            qd: vec![[2.0; 9]; 3],
            qdd: vec![[0.0; 9]; 3],
            u: vec![[70.0; 6]; 3],
            contact_rows: Vec::new(),
            contact_forces: vec![Vec::new(); 3],
            muscles: None,
            outputs: Vec::new(),
            bezier: Vec::new(),
            phase_start_m: 0.0,
            phase_end_m: 0.1,
            impulse: None,
        };
        Gait {
            format_version: 1,
            subject: Subject { height_m: 1.75, body_mass_kg: 70.0 },
            device: Device::ampro3().unwrap(),
            muscles: false,
            bounds: TunedBounds::default(),
            settings: GaitSettings::default(),
            speed_m_s: 1.0,
            stride_length_m: 0.8,
            right_step_length_m: 0.4,
            stride_time_s: 0.8,
            hip_velocity_m_s: [1.0; 4],
            domains: DOMAINS.iter().enumerate().map(domain).collect(),
        }
    }

    fn charts(groups: &[crate::gait_charts::Group]) -> Vec<&Chart> {
        let figures = groups.iter().flat_map(|group| &group.figures);
        figures
            .filter_map(|figure| match &figure.drawing {
                Drawing::Chart(chart) => Some(chart),
                _ => None,
            })
            .collect()
    }

    #[test]
    fn four_gaits_differ_by_colour_and_dash_in_every_chart_of_a_joint() {
        let gaits = [0.1, 0.2, 0.3, 0.4].map(gait);
        let names = ["trial 1", "trial 2", "trial 3", "trial 4"];
        let named: Vec<(&str, &Gait)> = names.into_iter().zip(&gaits).collect();
        let groups = of_several(&named, &ReferenceGait::builtin().unwrap());
        let ids: Vec<(&str, usize)> = groups.iter().map(|group| (group.id, group.figures.len())).collect();
        assert_eq!(ids, [("angles", 7), ("torques", 6), ("powers", 6)]);
        for chart in charts(&groups) {
            let of_gaits: Vec<_> = chart.series.iter().filter(|series| series.label != "reference").collect();
            assert_eq!(
                of_gaits.iter().map(|series| series.label.as_str()).collect::<Vec<_>>(),
                names,
                "{}",
                chart.title
            );
            let colours: BTreeSet<usize> = chart.series.iter().map(|series| series.colour).collect();
            let dashes: BTreeSet<String> = chart.series.iter().map(|series| format!("{:?}", series.stroke)).collect();
            assert_eq!((colours.len(), dashes.len()), (chart.series.len(), chart.series.len()), "{}", chart.title);
            // The cursor of the page finds the cycle of each gait by its colour.
            let cycles: Vec<_> = chart.cycles.iter().filter_map(|cycle| cycle.colour).collect();
            assert_eq!(cycles, of_gaits.iter().map(|series| series.colour).collect::<Vec<_>>());
        }
        let reference = |chart: &&&Chart| chart.series.iter().any(|series| series.stroke == Stroke::Dotted);
        assert_eq!(
            charts(&groups).iter().filter(reference).count(),
            5,
            "the reference has no joints of the prosthesis"
        );
    }

    #[test]
    fn torques_and_powers_are_normalised_to_the_mass_of_each_gait() {
        let light = gait(0.1);
        let mut heavy = light.clone();
        heavy.subject.body_mass_kg = 140.0;
        let groups = of_several(&[("light", &light), ("heavy", &heavy)], &ReferenceGait::builtin().unwrap());
        for (group, expected) in [(1, [-1.0, -0.5]), (2, [2.0, 1.0])] {
            for chart in charts(&groups[group..=group]) {
                let values: Vec<f64> = chart.series.iter().map(|series| series.points[0].1).collect();
                assert_eq!(values, expected, "{} {}", groups[group].id, chart.title);
            }
        }
    }

    #[test]
    fn file_of_a_chart_has_the_lines_of_every_gait() {
        let gaits = [0.1, 0.2].map(gait);
        let named = [("trial 1", &gaits[0]), ("trial 2", &gaits[1])];
        let groups = of_several(&named, &ReferenceGait::builtin().unwrap());
        let hip = &groups[0].figures[0];
        assert_eq!(hip.name, "angles-left-hip");
        let csv = hip.csv();
        for (name, angle) in [("trial 1", 0.1_f64), ("trial 2", 0.2)] {
            let values = csv.lines().filter_map(|line| line.strip_prefix(&format!("{name},")));
            let degrees: Vec<f64> = values.map(|rest| rest.split(',').next_back().unwrap().parse().unwrap()).collect();
            assert!(
                degrees.len() > 8 && degrees.iter().all(|value| (value - angle.to_degrees()).abs() < 1e-9),
                "{csv}"
            );
        }
        let compared = with_reference(&named, &ReferenceGait::builtin().unwrap());
        let drawn = |charts: Vec<&Chart>| charts.into_iter().map(Chart::svg).collect::<Vec<_>>();
        assert!(drawn(compared.iter().collect()) == drawn(charts(&groups[..1])), "a comparison shows the same charts");
    }
}
