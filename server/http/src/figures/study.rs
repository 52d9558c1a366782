//! The figures of a study, or of several.

use super::outcome::StudyOutcome;
use super::study_progress::{PROGRESS, progress_chart, warm_starts};
use super::study_results::{MAX_IN_A_CHART, StudyResults, have_one_reference_gait};
use crate::shared_state::AppState;
use gait_optimizer::gait::stick_figure::stick_figures;
use gait_optimizer::{Gait, ReferenceGait};
use gaitwright_charts::{Chart, Figure, band_in_words, gait_charts};
use gaitwright_compute::OnPool;
use gaitwright_service::error::Error;
use gaitwright_store::studies::Study;
use gaitwright_store::{StudyId, TrialId, gaits, reference_gaits, trials};
use std::sync::Arc;

/// A section of figures.
#[derive(Debug)]
pub(crate) struct FigureSection {
    pub(crate) id: &'static str,
    pub(crate) heading: &'static str,
    pub(crate) hint: String,
    pub(crate) figures: Vec<Figure>,
}

/// The figures of a study, or of several.
#[derive(Debug)]
pub(crate) struct StudyFigures {
    pub(crate) study: Study,
    /// The best trial of the study, and its number.
    pub(crate) best: Option<(TrialId, u32)>,
    /// Names of the studies without a gait to draw.
    pub(crate) without_gait: Vec<String>,
    pub(crate) sections: Vec<FigureSection>,
    /// The warm-start tree and the utility of the recommended gait, which the study page shows.
    on_study_page: Vec<Figure>,
}

impl StudyFigures {
    /// All of them.
    pub(crate) fn into_figures(self) -> Vec<Figure> {
        self.sections.into_iter().flat_map(|section| section.figures).chain(self.on_study_page).collect()
    }
}

/// A study with its best gait.
struct StudyWithBest {
    results: StudyResults,
    outcome: StudyOutcome,
    /// The utility of the recommended gait over the answers of people.
    utility: Option<Figure>,
    trial: Option<(TrialId, u32)>,
    gait: Option<Gait>,
}

impl StudyWithBest {
    async fn read(app: &mut AppState, id: StudyId) -> Result<Self, Error> {
        let analyses = Arc::clone(&app.analyses);
        let results = StudyResults::read(&mut *app.read().await?, id).await?;
        let draw = move |pool: &OnPool| {
            let outcome = results.outcome(pool, &analyses);
            let utility = results.utility(pool, &analyses);
            (results, outcome, utility)
        };
        let (results, outcome, utility) = app.compute(draw).await?;
        let (outcome, utility) = (outcome?, utility?);
        let mut reader = app.read().await?;
        let trial = match outcome.best {
            Some(id) => Some((id, trials::get(&mut reader, id).await?.number)),
            None => None,
        };
        let gait = match trial {
            Some((id, _)) => gaits::find(&mut reader, id).await?,
            None => None,
        };
        drop(reader);
        let gait = app.compute(move |pool| gait.map(|gait| gait.unpack(pool)).transpose()).await??;
        Ok(Self { results, outcome, utility, trial, gait })
    }

    fn name(&self) -> &str {
        &self.results.snapshot.study.plan.name
    }
}

/// The paper's figures for a study, and for others beside it.
///
/// # Errors
/// [`Error::Invalid`] for more than [`MAX_IN_A_CHART`] studies; a conflict when the subject of one of them withdrew,
/// [`Error::NotFound`]; errors of the database.
pub(crate) async fn of_study(app: &mut AppState, id: StudyId, others: &[StudyId]) -> Result<StudyFigures, Error> {
    if others.len() >= MAX_IN_A_CHART {
        let most = format!("at most {} studies", MAX_IN_A_CHART - 1);
        return Err(Error::invalid("other", others.len(), &most));
    }
    let mut shown = vec![StudyWithBest::read(app, id).await?];
    for (place, &other) in others.iter().enumerate() {
        if other != id && !others[..place].contains(&other) {
            shown.push(StudyWithBest::read(app, other).await?);
        }
    }
    let mut reader = app.read().await?;
    let reference = shown[0].results.snapshot.study.plan.reference_gait_id;
    let reference = reference_gaits::get(&mut reader, reference).await?.definition;
    drop(reader);
    let draw = move |_: &OnPool| {
        let sections = sections(&shown, &reference);
        (shown, sections)
    };
    let (shown, sections) = app.compute(draw).await?;
    let without_gait = shown.iter().filter(|best| best.gait.is_none()).map(|best| best.name().to_owned()).collect();
    let first = shown.into_iter().next().ok_or_else(|| Error::Internal("no study was read".to_owned()))?;
    let tree = warm_starts(&first.results.snapshot, first.outcome.best, usize::MAX);
    Ok(StudyFigures {
        best: first.trial,
        study: first.results.snapshot.study,
        without_gait,
        sections: sections?,
        on_study_page: tree.into_iter().chain(first.utility).collect(),
    })
}

fn sections(shown: &[StudyWithBest], reference: &ReferenceGait) -> Result<Vec<FigureSection>, Error> {
    let mut snapshots: Vec<_> = shown.iter().map(|best| (&best.results.snapshot, &best.outcome)).collect();
    let mut progress_hint = "Figure 3b of the paper, which compares a study with muscles and one without.";
    if !have_one_reference_gait(&snapshots.iter().map(|(snapshot, _)| *snapshot).collect::<Vec<_>>()) {
        snapshots.truncate(1);
        progress_hint = "The studies have different reference gaits, so their Gait RMSE values cannot be compared.";
    }
    let gaits: Vec<(&str, &Gait)> = shown.iter().filter_map(|best| Some((best.name(), best.gait.as_ref()?))).collect();
    let mut tiles = Vec::new();
    for (name, gait) in &gaits {
        tiles.push(Figure::tiles(&format!("Gait of {name}"), stick_figures(gait)?));
    }
    let charts = |group: &str, charts: Vec<Chart>| charts.into_iter().map(|c| Figure::chart(group, c)).collect();
    Ok(vec![
        FigureSection {
            id: PROGRESS,
            heading: "Gait RMSE of the best action by iteration",
            hint: progress_hint.to_owned(),
            figures: charts(PROGRESS, progress_chart(&snapshots).into_iter().collect()),
        },
        FigureSection {
            id: "angles",
            heading: "Joint angles of the best gait",
            hint: format!(
                "Figure 3c of the paper, with the reference gait. Each joint is drawn over the gait cycle of its leg. {} There is no reference for the joints of the prosthesis.",
                band_in_words(reference)
            ),
            figures: charts("angles", gait_charts::with_reference(&gaits, reference)),
        },
        FigureSection {
            id: "tiles",
            heading: "Gait tiles",
            hint: "Figure 4 of the paper: the stride of the best gait.".to_owned(),
            figures: tiles,
        },
        FigureSection {
            id: "limit-cycles",
            heading: "Limit cycles of the best gait",
            hint: "Figure 5 of the paper: angle and velocity over the stride. The pages of lab sessions show measured limit cycles."
                .to_owned(),
            figures: charts("limit-cycles", gait_charts::limit_cycles(&gaits)),
        },
    ])
}
