//! The figures of a study, of a gait, of a lab session: for their pages and as files.

use super::page_chart::Drawn;
use super::side_by_side::Side;
use super::{lab_charts, study};
use crate::AppState;
use crate::accessible::{Named, accessible};
use crate::authorization::Authorized;
use crate::extract::Params;
use crate::page_error::{Page, page};
use crate::visible::Visible;
use askama::Template;
use axum::extract::State;
use gait_optimizer::walking::stick_figure::stick_figures;
use gait_optimizer::{Gait, ReferenceGait};
use gaitwright_charts::gait_charts;
use gaitwright_charts::{Chart, Figure, band_in_words};
use gaitwright_compute::OnPool;
use gaitwright_service::access::Read;
use gaitwright_service::error::Error;
use gaitwright_service::studies::answer;
use gaitwright_service::studies::lab::{self, LabSessionView, LimitCycles};
use gaitwright_store::studies::{Chosen, Study};
use gaitwright_store::{LabSessionId, Store, StudyId, TrialId, gaits, lab_sessions, reference_gaits, studies, trials};
use serde::Deserialize;
use std::sync::Arc;

/// How many of the newest studies the form offers for comparison.
const OFFERED: u32 = 200;

/// A section of figures.
#[derive(Debug)]
pub(crate) struct Section {
    id: &'static str,
    heading: &'static str,
    hint: String,
    figures: Vec<Figure>,
}

/// The figures of a study, or of two.
#[derive(Debug)]
pub(crate) struct StudyFigures {
    study: Study,
    /// The best trial of the study, and its number.
    best: Option<(TrialId, u32)>,
    /// Names of the studies without a gait to draw.
    without_gait: Vec<String>,
    sections: Vec<Section>,
    /// The warm-start tree, which the study page shows.
    tree: Option<Figure>,
}

impl StudyFigures {
    /// All of them.
    pub(crate) fn into_figures(self) -> Vec<Figure> {
        self.sections.into_iter().flat_map(|section| section.figures).chain(self.tree).collect()
    }
}

/// A study with its best gait.
struct Best {
    side: Side,
    figures: study::Figures,
    trial: Option<(TrialId, u32)>,
    gait: Option<Gait>,
}

impl Best {
    async fn read(app: &mut AppState, id: StudyId) -> Result<Self, Error> {
        let beliefs = Arc::clone(&app.beliefs);
        let side = Side::read(&mut *app.read().await?, id).await?;
        let draw = move |pool: &OnPool| {
            let figures = side.figures(pool, &beliefs);
            (side, figures)
        };
        let (side, figures) = app.compute(draw).await?;
        let figures = figures?;
        let mut reader = app.read().await?;
        let trial = match figures.best {
            Some(id) => Some((id, trials::get(&mut reader, id).await?.number)),
            None => None,
        };
        let gait = match trial {
            Some((id, _)) => gaits::find(&mut reader, id).await?,
            None => None,
        };
        drop(reader);
        let gait = app.compute(move |pool| gait.map(|gait| gait.unpack(pool)).transpose()).await??;
        Ok(Self { side, figures, trial, gait })
    }

    fn name(&self) -> &str {
        &self.side.snapshot.study.plan.name
    }
}

/// The paper's figures for a study, and optionally for a second one.
///
/// # Errors
/// A conflict when the subject of one of them withdrew, [`Error::NotFound`]; errors of the database.
pub(crate) async fn of_study(app: &mut AppState, id: StudyId, other: Option<StudyId>) -> Result<StudyFigures, Error> {
    let mut shown = vec![Best::read(app, id).await?];
    if let Some(other) = other.filter(|other| *other != id) {
        shown.push(Best::read(app, other).await?);
    }
    let mut reader = app.read().await?;
    let reference = shown[0].side.snapshot.study.plan.reference_gait_id;
    let reference = reference_gaits::get(&mut reader, reference).await?.definition;
    drop(reader);
    let draw = move |_: &OnPool| {
        let sections = sections(&shown, &reference);
        (shown, sections)
    };
    let (shown, sections) = app.compute(draw).await?;
    let without_gait = shown.iter().filter(|best| best.gait.is_none()).map(|best| best.name().to_owned()).collect();
    let first = shown.into_iter().next().ok_or_else(|| Error::Internal("no study was read".to_owned()))?;
    let tree = study::warm_starts(&first.side.snapshot, first.figures.best);
    Ok(StudyFigures { best: first.trial, study: first.side.snapshot.study, without_gait, sections: sections?, tree })
}

fn sections(shown: &[Best], reference: &ReferenceGait) -> Result<Vec<Section>, Error> {
    let snapshots: Vec<_> = shown.iter().map(|best| (&best.side.snapshot, &best.figures)).collect();
    let gaits: Vec<(&str, &Gait)> = shown.iter().filter_map(|best| Some((best.name(), best.gait.as_ref()?))).collect();
    let mut tiles = Vec::new();
    for (name, gait) in &gaits {
        tiles.push(Figure::tiles(&format!("Gait of {name}"), stick_figures(gait)?));
    }
    let charts = |group: &str, charts: Vec<Chart>| charts.into_iter().map(|c| Figure::chart(group, c)).collect();
    Ok(vec![
        Section {
            id: study::COURSE,
            heading: "Gait RMSE of the best action by iteration",
            hint: "Figure 3b of the paper, which compares a study with muscles and one without.".to_owned(),
            figures: charts(study::COURSE, study::course(&snapshots).into_iter().collect()),
        },
        Section {
            id: "angles",
            heading: "Joint angles of the best gait",
            hint: format!("Figure 3c of the paper, with the reference gait. {}", band_in_words(reference)),
            figures: charts("angles", gait_charts::with_reference(&gaits, reference)),
        },
        Section {
            id: "tiles",
            heading: "Gait tiles",
            hint: "Figure 4 of the paper: the stride of the best gait.".to_owned(),
            figures: tiles,
        },
        Section {
            id: "orbits",
            heading: "Limit cycles of the best gait",
            hint: "Figure 5 of the paper: angle and velocity over the stride. The pages of lab sessions show measured limit cycles."
                .to_owned(),
            figures: charts("orbits", gait_charts::orbits(&gaits)),
        },
    ])
}

/// Every figure of the page of a gait; while its solve runs, the solver progress.
///
/// # Errors
/// [`Error::NotFound`]; errors of the database.
pub(crate) async fn of_trial(app: &mut AppState, id: TrialId) -> Result<Vec<Figure>, Error> {
    if let Some(running) = app.scheduler.board().track(id) {
        return Ok(gait_charts::solve(&running.records).into_iter().collect());
    }
    let mut reader = app.read().await?;
    let study = trials::get(&mut reader, id).await?.study_id;
    let reference = studies::get(&mut reader, study).await?.plan.reference_gait_id;
    let reference = reference_gaits::get(&mut reader, reference).await?.definition;
    let Some(gait) = gaits::find(&mut reader, id).await? else { return Ok(Vec::new()) };
    let iterations = gaits::iterations(&mut reader, id).await?;
    drop(reader);
    let draw = move |pool: &OnPool| {
        let (gait, iterations) = (gait.unpack(pool)?, iterations.unpack(pool)?);
        let mut figures = vec![gait_charts::tiles(stick_figures(&gait)?)];
        for group in gait_charts::of_gait(&gait, &reference)? {
            figures.extend(group.figures);
        }
        figures.extend(gait_charts::solve(&iterations));
        Ok(figures)
    };
    app.compute(draw).await?
}

/// The joint angles of two gaits of a study, as on the page that compares them.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Invalid`] for a trial of another study; errors of the database.
pub(crate) async fn of_pair(app: &mut AppState, a: TrialId, b: TrialId) -> Result<Vec<Figure>, Error> {
    let mut reader = app.read().await?;
    let trial = trials::get(&mut reader, a).await?;
    let other = answer::comparable(&mut reader, trial.study_id, "other", b).await?;
    let reference = studies::get(&mut reader, trial.study_id).await?.plan.reference_gait_id;
    let reference = reference_gaits::get(&mut reader, reference).await?.definition;
    let (Some(gait_a), Some(gait_b)) = (gaits::find(&mut reader, a).await?, gaits::find(&mut reader, b).await?) else {
        return Ok(Vec::new());
    };
    drop(reader);
    let draw = move |pool: &OnPool| {
        let (gait_a, gait_b) = (gait_a.unpack(pool)?, gait_b.unpack(pool)?);
        Ok(pair((trial.number, &gait_a), (other.number, &gait_b), &reference))
    };
    app.compute(draw).await?
}

/// The joint angles of two gaits, named by their trials, over the reference gait.
pub(super) fn pair((a, gait_a): (u32, &Gait), (b, gait_b): (u32, &Gait), reference: &ReferenceGait) -> Vec<Figure> {
    let (a, b) = (format!("gait A, trial {a}"), format!("gait B, trial {b}"));
    let charts = gait_charts::with_reference(&[(&a, gait_a), (&b, gait_b)], reference);
    charts.into_iter().map(|chart| Figure::chart("pair", chart)).collect()
}

/// Every figure of a reference gait.
pub(crate) fn of_reference(reference: &ReferenceGait) -> Vec<Figure> {
    let charts = gait_charts::of_reference(reference).into_iter();
    charts.map(|chart| Figure::chart("reference", chart)).collect()
}

/// Every figure of a lab session.
///
/// # Errors
/// [`Error::NotFound`]; errors of the database.
pub(crate) async fn of_session(app: &mut AppState, id: LabSessionId) -> Result<Vec<Figure>, Error> {
    let (emg, cycles) = (lab::emg(app.store_mut(), id).await?, measured_cycles(app.store_mut(), id).await?);
    let mut reader = app.read().await?;
    let session = LabSessionView::from(&lab_sessions::get(&mut reader, id).await?);
    drop(reader);
    let draw = move |_: &OnPool| {
        let mut figures = emg.map_or_else(Vec::new, |emg| lab_charts::emg(&session, &emg));
        figures.extend(lab_charts::limit_cycles(&session, &cycles));
        figures
    };
    Ok(app.compute(draw).await?)
}

/// The limit cycles of each walk, with the orbit of its gait after unblinding.
pub(super) async fn measured_cycles(
    store: &mut Store,
    id: LabSessionId,
) -> Result<Vec<(LimitCycles, Option<Gait>)>, Error> {
    let mut found = Vec::new();
    for cycles in lab::limit_cycles(store, id).await? {
        let gait = lab::known_gait(&mut *store.read().await?, id, cycles.walk).await?;
        let gait = store.compute(move |pool| gait.map(|gait| gait.unpack(pool)).transpose()).await??;
        found.push((cycles, gait));
    }
    Ok(found)
}

#[derive(Template)]
#[template(path = "study_figures.html")]
struct FiguresPage {
    study: Study,
    best: Option<(TrialId, u32)>,
    without_gait: Vec<String>,
    other: Option<StudyId>,
    offered: Vec<Study>,
    sessions: Vec<(LabSessionId, u32)>,
    sections: Vec<(Section, Vec<Drawn>)>,
}

impl FiguresPage {
    fn is(chosen: Option<&StudyId>, study: &Study) -> bool {
        chosen == Some(&study.id)
    }
}

/// The second study.
#[derive(Debug, Deserialize)]
pub(super) struct ComparedWith {
    /// The form sends an empty value if no study is chosen.
    other: Option<String>,
}

/// `GET /studies/{id}/figures`.
pub(super) async fn get(
    authorized: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
    Params(compared): Params<ComparedWith>,
) -> Page {
    let other = match compared.other.as_deref() {
        None | Some("") => None,
        Some(text) => {
            Some(text.parse::<Named<StudyId>>().map_err(|_| Error::invalid("other", text, "a study from the list"))?)
        }
    };
    let reach = authorized.caller.reach();
    let other = accessible(&mut *app.read().await?, reach, other).await?;
    let StudyFigures { study, best, without_gait, sections, .. } = of_study(&mut app, id, other).await?;
    let mut reader = app.read().await?;
    let mut offered = studies::page(&mut reader, reach, Chosen::newest(OFFERED)).await?;
    offered.retain(|offered| offered.id != id);
    let sessions = lab_sessions::of_study(&mut reader, id).await?;
    drop(reader);
    let query = other.map_or_else(String::new, |other| format!("?other={other}"));
    let files = format!("/api/v1/studies/{id}/figures");
    let drawn = |section: Section| {
        let drawn = section.figures.iter().map(|figure| Drawn::of(figure, &files, &query)).collect();
        (section, drawn)
    };
    page(&FiguresPage {
        study,
        best,
        without_gait,
        other,
        offered,
        sessions: sessions.iter().map(|session| (session.id, session.number)).collect(),
        sections: sections.into_iter().map(drawn).collect(),
    })
}
