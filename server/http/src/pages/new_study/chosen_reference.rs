//! The chosen reference gait in the form for a new study: its chart, and whether another one is nearer to the subject.

use super::super::page_chart::PageChart;
use askama::Template;
use gaitwright_charts::{Chart, Stroke};
use gaitwright_service::error::Error;
use gaitwright_service::studies::nearest_reference::{self, ReferenceGaitMatch};
use gaitwright_store::reference_gaits::ReferenceGaitRow;
use gaitwright_store::studies::StudyPlan;
use gaitwright_store::{Connection, ReferenceGaitId};

/// The angles of a reference gait, by column.
const ANGLES: [&str; 5] = ["torso lean", "left hip", "left knee", "left ankle", "right hip"];

#[derive(Template)]
#[template(path = "chosen_reference.html")]
struct ChosenReference {
    nearest: String,
    /// Whether the distance of at least one reference gait is known.
    measured: bool,
    chart: PageChart,
}

/// Every reference gait with its distance from the subject of a study, and the chosen one.
pub(super) struct ReferenceChoice {
    matches: Vec<ReferenceGaitMatch>,
    chosen: ReferenceGaitId,
}

impl ReferenceChoice {
    pub(super) async fn read(db: &mut Connection, plan: &StudyPlan) -> Result<Self, Error> {
        let matches = nearest_reference::matches(db, &plan.body).await?;
        Ok(Self { matches, chosen: plan.reference_gait_id })
    }

    /// As a part of the page.
    pub(super) fn shown(&self) -> Result<String, Error> {
        let chosen = self.matches.iter().find(|found| found.reference_gait.id == self.chosen);
        let Some(chosen) = chosen else { return Ok(String::new()) };
        let chart = PageChart::new(&chart(&chosen.reference_gait));
        let measured = self.matches.iter().any(|found| found.distance.is_some());
        let part = ChosenReference { nearest: nearest(&self.matches, chosen), measured, chart };
        part.render().map_err(|e| Error::Internal(e.to_string()))
    }
}

/// A sentence about the nearest reference gait, from matches in the order of distance.
fn nearest(matches: &[ReferenceGaitMatch], chosen: &ReferenceGaitMatch) -> String {
    let known = matches.iter().filter(|found| found.distance.is_some()).count();
    let away = |found: &ReferenceGaitMatch| {
        found
            .distance
            .map_or(String::new(), |distance| format!(" (distance {distance:.2}, where 1 is 10 cm of height or 15 kg)"))
    };
    match matches.first() {
        _ if known == 0 => {
            let why = "The nearest reference gait is unknown, because none states both height and body mass.";
            format!("{why} The chosen reference gait is {}.", chosen.reference_gait.name)
        }
        Some(first) if first.reference_gait.id == chosen.reference_gait.id => {
            let name = &first.reference_gait.name;
            format!("{name}: nearest to the subject in height and body mass{}.", away(first))
        }
        Some(first) => {
            let chosen = chosen.distance.map_or_else(
                || "The distance of the chosen reference gait is unknown.".to_owned(),
                |distance| format!("The distance of the chosen reference gait is {distance:.2}."),
            );
            format!(
                "{}{} is the nearest to the subject in height and body mass. {chosen}",
                first.reference_gait.name,
                away(first)
            )
        }
        None => String::new(),
    }
}

/// All joint angles over one stride.
fn chart(reference: &ReferenceGaitRow) -> Chart {
    let chart = Chart::new("Reference gait", "gait cycle from right heel strike, %", "angle, °");
    ANGLES.iter().enumerate().fold(chart, |chart, (column, name)| {
        let rows = reference.definition.angles_rad.iter().enumerate();
        let line = rows.map(|(row, angles)| (row as f64, angles[column].to_degrees())).collect();
        chart.with(name, column, Stroke::APART[column % Stroke::APART.len()], line)
    })
}
