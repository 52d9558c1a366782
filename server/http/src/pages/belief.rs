//! What the learner believes about the search space of a study.

use super::page_chart::Drawn;
use super::study::answer_in_words;
use crate::AppState;
use crate::authorization::Authorized;
use crate::extractors::Params;
use crate::figures::belief::{
    AxisChoice, Believed, DimensionChoice, MAP_NOTES, Maps, believed, chosen, maps, marginals,
};
use crate::format::{self, percent, signed};
use crate::page_error::{Page, page};
use crate::visible::Visible;
use askama::Template;
use axum::extract::State;
use gait_learner::{Agreement, LearnerError};
use gaitwright_compute::OnPool;
use gaitwright_service::access::Read;
use gaitwright_service::error::Error;
use gaitwright_service::studies::belief::{Belief, Comparison};
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_service::studies::trial_choice::ranking_to_show;
use gaitwright_store::studies::Study;
use gaitwright_store::{StudyId, TrialId, studies};
use std::sync::Arc;

/// So many actions and answers are listed.
const LISTED: usize = 12;

#[derive(Template)]
#[template(path = "belief.html")]
struct BeliefPage {
    study: Study,
    /// Why no belief is shown; `None` if it is shown.
    absent: Option<String>,
    shown: Option<Everything>,
}

struct Everything {
    agreement: Agreement,
    marginals: Vec<Drawn>,
    maps: Maps,
    /// The maps as shown.
    charts: Vec<Drawn>,
    best: Vec<BestRow>,
    /// So many trials are not in that list.
    others: usize,
    answers: Vec<AnswerRow>,
    more_answers: usize,
}

struct BestRow {
    id: TrialId,
    number: u32,
    percent: String,
    probability: f64,
    utility: String,
    /// Whether it is the one that the study recommends.
    recommended: bool,
}

struct AnswerRow {
    text: String,
    source: &'static str,
    percent: String,
    agrees: bool,
}

/// `GET /studies/{id}/belief`.
pub(super) async fn get(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
    Params(choice): Params<AxisChoice>,
) -> Page {
    let study = studies::get(&mut *app.read().await?, id).await?;
    page(&match believed(&mut app, id).await? {
        Believed::Absent(why) => BeliefPage { study, absent: Some(why), shown: None },
        Believed::There(snapshot, belief) => {
            let beliefs = Arc::clone(&app.beliefs);
            let draw = move |pool: &OnPool| {
                // As on the page of the study: nothing before people have answered.
                let silent = snapshot.waits_for_first_answer();
                let ranking = if silent {
                    Vec::new()
                } else {
                    ranking_to_show(pool, &snapshot, &beliefs).map_err(Error::Learner)?
                };
                let recommended = ranking.first().copied();
                show(id, &snapshot, &belief, recommended, &choice)
            };
            let shown = app.compute(draw).await.map_err(Error::from)??;
            BeliefPage { study, absent: None, shown: Some(shown) }
        }
    })
}

fn show(
    id: StudyId,
    snapshot: &StudySnapshot,
    belief: &Belief,
    recommended: Option<TrialId>,
    choice: &AxisChoice,
) -> Result<Everything, Error> {
    let chosen = chosen(belief.posterior.space(), choice)?;
    let files = format!("/api/v1/studies/{id}/belief/figures");
    let maps = maps(belief, snapshot, chosen).map_err(Error::Learner)?;
    let names =
        |asked: fn(&DimensionChoice) -> bool| maps.dimensions.iter().find(|d| asked(d)).map(|d| d.name.as_str());
    let query = match (names(|d| d.x), names(|d| d.y)) {
        (Some(x), Some(y)) => format!("?x={x}&y={y}"),
        _ => String::new(),
    };
    let charts = maps.figures.iter().zip(MAP_NOTES);
    let (best, others) = best(belief, snapshot, recommended).map_err(Error::Learner)?;
    Ok(Everything {
        agreement: belief.agreement,
        marginals: marginals(belief).iter().map(|figure| Drawn::of(figure, &files, "")).collect(),
        charts: charts.map(|(figure, note)| Drawn { note, ..Drawn::of(figure, &files, &query) }).collect(),
        maps,
        best,
        others,
        answers: belief.comparisons.iter().take(LISTED).filter_map(|c| answer_row(c, snapshot)).collect(),
        more_answers: belief.comparisons.len().saturating_sub(LISTED),
    })
}

/// The trials that are most likely the best, the recommended one always among them; and how many others there are.
fn best(
    belief: &Belief,
    snapshot: &StudySnapshot,
    recommended: Option<TrialId>,
) -> Result<(Vec<BestRow>, usize), LearnerError> {
    let tried: Vec<_> =
        belief.best.iter().filter_map(|entry| Some((entry, snapshot.trial_of(entry.action)?))).collect();
    let marked = tried.iter().position(|(_, trial)| recommended == Some(trial.id));
    let row = |place: usize| {
        let (entry, trial) = tried[place];
        let prediction = belief.posterior.predict(entry.action)?;
        Ok(BestRow {
            id: trial.id,
            number: trial.number,
            percent: percent(entry.probability),
            probability: entry.probability,
            utility: format!("{} ± {:.2}", signed(prediction.mean), prediction.standard_deviation),
            recommended: marked == Some(place),
        })
    };
    let places = listed(tried.len(), marked);
    let rows = places.iter().map(|&place| row(place)).collect::<Result<Vec<_>, _>>()?;
    Ok((rows, tried.len() - places.len()))
}

/// The places of a long list that are shown: the first ones, and the one that must not be missing.
fn listed(length: usize, always: Option<usize>) -> Vec<usize> {
    (0..length.min(LISTED)).chain(always.filter(|&place| place >= LISTED)).collect()
}

fn answer_row(comparison: &Comparison, snapshot: &StudySnapshot) -> Option<AnswerRow> {
    Some(AnswerRow {
        text: answer_in_words(&comparison.given, snapshot)?,
        source: format::source(&comparison.given),
        percent: percent(comparison.probability),
        agrees: comparison.probability > 0.5,
    })
}

#[cfg(test)]
mod tests {
    use super::{LISTED, listed};

    #[test]
    fn recommended_trial_is_always_listed() {
        assert_eq!(listed(3, Some(1)), [0, 1, 2]);
        assert_eq!(listed(LISTED + 5, Some(0)).len(), LISTED);
        let long = listed(LISTED + 5, Some(LISTED + 2));
        assert_eq!((long.len(), long.last()), (LISTED + 1, Some(&(LISTED + 2))));
    }
}
