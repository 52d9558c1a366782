//! What the learner believes about the search space of a study.

use super::format::{self, meaning, percent, signed};
use super::page_chart::Drawn;
use super::study::answer_in_words;
use crate::AppState;
use crate::authorization::Authorized;
use crate::extract::Params;
use crate::page_error::{Page, page};
use crate::visible::Visible;
use askama::Template;
use axum::extract::State;
use gait_learner::{Agreement, Dimension, LearnerError, Marginal, SearchSpace};
use gaitwright_charts::{Cell, Chart, Figure, HeatMap, Stroke};
use gaitwright_compute::OnPool;
use gaitwright_service::access::Read;
use gaitwright_service::error::Error;
use gaitwright_service::studies::belief::{Belief, Comparison, MOST_ANSWERS};
use gaitwright_service::studies::choice::{MANY, ranking_to_show};
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::studies::Study;
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_store::{StudyId, TrialId, studies, trials};
use serde::Deserialize;
use std::sync::Arc;

/// So many actions and answers are listed.
const LISTED: usize = 12;

/// Which two bounds the maps show.
#[derive(Debug, Default, Deserialize)]
pub(crate) struct Choice {
    x: Option<String>,
    y: Option<String>,
}

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

/// Two bounds, the others held.
struct Maps {
    dimensions: Vec<DimensionChoice>,
    held: Option<(TrialId, u32)>,
    figures: Vec<Figure>,
}

struct DimensionChoice {
    name: String,
    meaning: &'static str,
    x: bool,
    y: bool,
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
    Params(choice): Params<Choice>,
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

/// Every figure of the page; empty if the page shows no belief.
///
/// # Errors
/// [`Error::Invalid`] for a bound that is not tuned, [`Error::NotFound`], or errors of the database and the learner.
pub(crate) async fn figures(app: &mut AppState, id: StudyId, choice: Choice) -> Result<Vec<Figure>, Error> {
    let Believed::There(snapshot, belief) = believed(app, id).await? else { return Ok(Vec::new()) };
    let draw = move |_: &OnPool| {
        let chosen = chosen(belief.posterior.space(), &choice)?;
        let mut figures = marginals(&belief);
        figures.extend(maps(&belief, &snapshot, chosen).map_err(Error::Learner)?.figures);
        Ok(figures)
    };
    app.compute(draw).await?
}

/// What the learner believes of a study, or why the page does not show it.
enum Believed {
    Absent(String),
    There(Box<StudySnapshot>, Arc<Belief>),
}

async fn believed(app: &mut AppState, id: StudyId) -> Result<Believed, Error> {
    let too_many = |what: String| {
        Ok(Believed::Absent(format!(
            "This page is not available for studies with {what} or more, because the computation would take too long."
        )))
    };
    let mut reader = app.read().await?;
    let study = studies::get(&mut reader, id).await?;
    if trials::counts(&mut reader, id).await?.total as usize >= MANY {
        return too_many(format!("{MANY} trials"));
    }
    let snapshot = StudySnapshot::read(&mut reader, study).await?;
    drop(reader);
    let answers = snapshot.log().feedback.len();
    if answers == 0 {
        let why = "No results yet. The page appears with the first result.";
        return Ok(Believed::Absent(why.to_owned()));
    }
    if answers > MOST_ANSWERS {
        return too_many(format!("{MOST_ANSWERS} answers"));
    }
    let beliefs = app.beliefs.clone();
    let think =
        move |pool: &OnPool| beliefs.of(pool, &snapshot).map(|belief| Believed::There(Box::new(snapshot), belief));
    app.compute(think).await?.map_err(Error::Learner)
}

fn show(
    id: StudyId,
    snapshot: &StudySnapshot,
    belief: &Belief,
    recommended: Option<TrialId>,
    choice: &Choice,
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

/// The two dimensions of the maps: the requested ones, by default the first two; `None` if there is only one dimension.
fn chosen(space: &SearchSpace, choice: &Choice) -> Result<Option<(usize, usize)>, Error> {
    let names: Vec<&str> = space.dimensions().iter().map(|d| d.name.as_str()).collect();
    if names.len() < 2 {
        return Ok(None);
    }
    let place = |field: &str, asked: &Option<String>, default: usize| match asked {
        None => Ok(default),
        Some(name) => {
            let found = names.iter().position(|known| known == name);
            found.ok_or_else(|| Error::invalid(field, name.as_str(), &format!("one of {}", names.join(", "))))
        }
    };
    let (x, y) = (place("x", &choice.x, 0)?, place("y", &choice.y, 1)?);
    if x == y {
        return Err(Error::invalid("y", names[y], &format!("a bound other than {}", names[x])));
    }
    Ok(Some((x, y)))
}

/// All on one scale: what matters is which bound matters.
fn marginals(belief: &Belief) -> Vec<Figure> {
    let ends =
        |m: &Marginal| [m.average.mean - m.average.standard_deviation, m.average.mean + m.average.standard_deviation];
    let all = || belief.marginals.iter().flatten().flat_map(ends);
    let range = (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
    let draw = |(dimension, levels): (&Dimension, &Vec<Marginal>)| {
        let line = levels.iter().map(|m| (m.value, m.average.mean)).collect();
        let band = levels.iter().map(|m| (m.value, ends(m)[0], ends(m)[1])).collect();
        let label = format!("{}: {}", dimension.name, meaning(&dimension.name));
        let mut chart = Chart::new(&label, &label, "utility").with_band("one standard deviation", 0, band).with(
            "mean",
            0,
            Stroke::Marked,
            line,
        );
        chart.y_range = Some(range);
        chart.x_ticks.clone_from(&dimension.values);
        Figure::chart("utility", chart)
    };
    belief.posterior.space().dimensions().iter().zip(&belief.marginals).map(draw).collect()
}

fn maps(belief: &Belief, snapshot: &StudySnapshot, chosen: Option<(usize, usize)>) -> Result<Maps, LearnerError> {
    let space = belief.posterior.space();
    let dimensions = space.dimensions().iter().enumerate();
    let dimensions = dimensions
        .map(|(place, dimension)| DimensionChoice {
            name: dimension.name.clone(),
            meaning: meaning(&dimension.name),
            x: chosen.is_some_and(|(x, _)| x == place),
            y: chosen.is_some_and(|(_, y)| y == place),
        })
        .collect();
    let (Some((right, down)), Some(best)) = (chosen, belief.posterior.best()) else {
        return Ok(Maps { dimensions, held: None, figures: Vec::new() });
    };
    let held = snapshot.trial_of(best).map(|trial| (trial.id, trial.number));
    let slice = belief.posterior.slice(down, right, best)?;
    let at = |row: usize, column: usize| {
        let mut levels = space.levels(best);
        (levels[down], levels[right]) = (row, column);
        space.index_of_levels(&levels)
    };
    let mut utility = Vec::new();
    let mut converging = Vec::new();
    for (row, predictions) in slice.predictions.iter().enumerate() {
        let (mut utilities, mut chances) = (Vec::new(), Vec::new());
        for (column, prediction) in predictions.iter().enumerate() {
            let action = at(row, column)?;
            let framed = action == best;
            utilities.push(Cell {
                value: prediction.mean,
                text: signed(prediction.mean),
                below: format!("± {:.2}", prediction.standard_deviation),
                framed,
            });
            let chance = belief.posterior.probability_of_converging(action)?;
            let below = tried(snapshot, space, [(down, row), (right, column)]);
            chances.push(Cell { value: chance, text: percent(chance), below, framed });
        }
        utility.push(utilities);
        converging.push(chances);
    }
    let means = || utility.iter().flatten().map(|cell| cell.value);
    let range = (means().fold(f64::INFINITY, f64::min), means().fold(f64::NEG_INFINITY, f64::max));
    let axis = |place: usize| {
        let dimension = &space.dimensions()[place];
        (format!("{}: {}", dimension.name, meaning(&dimension.name)), dimension.values.clone())
    };
    let draw = |title: &str, cells, range| {
        let group = format!("{} {}", space.dimensions()[right].name, space.dimensions()[down].name);
        Figure::map(&group, HeatMap { title: title.to_owned(), columns: axis(right), rows: axis(down), cells, range })
    };
    let figures = vec![draw("Utility", utility, range), draw("Probability of converging", converging, (0.0, 1.0))];
    Ok(Maps { dimensions, held, figures })
}

/// The text below each map.
const MAP_NOTES: [&str; 2] = [
    "Mean ± standard deviation. The frame marks the best action.",
    "The small numbers count the trials with these two values: yes, converged; no, not converged.",
];

/// How many trials with these levels converged and how many did not.
fn tried(snapshot: &StudySnapshot, space: &SearchSpace, levels: [(usize, usize); 2]) -> String {
    let here = |trial: &&Trial| {
        let own = space.levels(trial.action_index);
        levels.iter().all(|(dimension, level)| own[*dimension] == *level)
    };
    let count = |state| snapshot.trials.iter().filter(here).filter(|trial| trial.state == state).count();
    match (count(TrialState::Converged), count(TrialState::NotConverged)) {
        (0, 0) => String::new(),
        (converged, not) => format!("{converged} yes, {not} no"),
    }
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
