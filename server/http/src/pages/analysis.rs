//! The page *Analysis*: the utility of the gaits and bounds of a study, beside their Gait RMSE.

use super::certainty::certainty;
use super::page_chart::{PageChart, shared_legend};
use super::study::answer_in_words;
use crate::AppState;
use crate::authorization::Authorized;
use crate::bound_units;
use crate::extractors::Params;
use crate::figures::analysis::{AnalysisState, analysis_of, marginals, recommended};
use crate::figures::cost_and_rmse;
use crate::figures::maps_over_two_bounds::{AxisChoice, DimensionChoice, MAP_NOTES, Maps, chosen, maps};
use crate::figures::trials_by_bound::{DRAWN, by_bound, parallel};
use crate::format::{self, decimal, percent};
use crate::page_error::{PageResult, page};
use crate::visible::Visible;
use askama::Template;
use axum::extract::State;
use gait_learner::{Agreement, MainEffect, Prediction};
use gaitwright_compute::OnPool;
use gaitwright_service::access::Read;
use gaitwright_service::error::Error;
use gaitwright_service::studies::analysis::{Analysis, SurprisingAnswer};
use gaitwright_service::studies::gait_utilities::{GaitUtility, is_distinguishable};
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::feedback::FeedbackContent;
use gaitwright_store::studies::{AnswerSource, Study};
use gaitwright_store::{StudyId, TrialId, studies};
use std::cmp::Ordering;

/// So many gaits and answers are listed.
const MAX_LISTED: usize = 24;
/// So many trials of one gait are named.
const NAMED: usize = 6;

#[derive(Template)]
#[template(path = "analysis.html")]
struct AnalysisPage {
    study: Study,
    /// Why no analysis is shown; `None` if it is shown.
    absent: Option<String>,
    shown: Option<ShownAnalysis>,
}

struct ShownAnalysis {
    agreement: Agreement,
    /// How sure the recommendation is; `None` without one.
    certainty: Option<String>,
    /// Whether a gait is recommended.
    recommends: bool,
    gaits: Vec<GaitRow>,
    /// So many gaits are not in that list.
    more_gaits: usize,
    /// Cost of transport against Gait RMSE.
    cost: Option<PageChart>,
    main_effects: Vec<MainEffectRow>,
    marginals: Vec<PageChart>,
    legend: Vec<(String, String)>,
    maps: Maps,
    /// The maps as shown.
    charts: Vec<PageChart>,
    /// The trials by the two bounds of the maps.
    by_bound: Vec<PageChart>,
    parallel: Option<PageChart>,
    /// Whether some trials are not drawn.
    newest_only: bool,
    surprising_answers: Vec<SurprisingAnswerRow>,
    more_surprising_answers: usize,
}

/// A gait, which one or several trials have.
struct GaitRow {
    trials: Vec<(TrialId, u32)>,
    /// So many trials are not named.
    more_trials: usize,
    rmse: String,
    utility: String,
    /// Whether the recommended gait is better; `None` for the recommended gait.
    worse: Option<String>,
}

/// The main effect of a bound.
struct MainEffectRow {
    name: String,
    limited: String,
    bar: EffectBar,
    effect: String,
    best: String,
    worst: String,
    is_distinguishable: bool,
}

/// A main effect as a bar with its standard deviation, in the units of the drawing.
struct EffectBar {
    zero: f64,
    mean: f64,
    low: f64,
    high: f64,
}

impl EffectBar {
    /// Width of the drawing; the template has the same.
    const WIDTH: f64 = 120.0;

    fn width(&self) -> f64 {
        (self.mean - self.zero).max(0.0)
    }
}

struct SurprisingAnswerRow {
    text: String,
    source: &'static str,
    percent: String,
}

/// `GET /studies/{id}/analysis`.
pub(super) async fn get(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
    Params(choice): Params<AxisChoice>,
) -> PageResult {
    let study = studies::get(&mut *app.read().await?, id).await?;
    page(&match analysis_of(&mut app, id).await? {
        AnalysisState::Absent(why) => AnalysisPage { study, absent: Some(why), shown: None },
        AnalysisState::There(snapshot, analysis) => {
            let draw = move |_: &OnPool| show(id, &snapshot, &analysis, &choice);
            let shown = app.compute(draw).await.map_err(Error::from)??;
            AnalysisPage { study, absent: None, shown: Some(shown) }
        }
    })
}

fn show(
    id: StudyId,
    snapshot: &StudySnapshot,
    analysis: &Analysis,
    choice: &AxisChoice,
) -> Result<ShownAnalysis, Error> {
    let pair = chosen(analysis, choice)?;
    let files = format!("/api/v1/studies/{id}/analysis/figures");
    let maps = maps(analysis, snapshot, pair).map_err(Error::Learner)?;
    let names =
        |asked: fn(&DimensionChoice) -> bool| maps.dimensions.iter().find(|d| asked(d)).map(|d| d.name.as_str());
    let query = match (names(|d| d.x), names(|d| d.y)) {
        (Some(x), Some(y)) => format!("?x={x}&y={y}"),
        _ => String::new(),
    };
    let drawn = |figure: &_| PageChart::of(figure, &files, "");
    let dimensions = pair.map_or_else(|| vec![0], |(x, y)| vec![x, y]);
    let by_bound = dimensions.into_iter().map(|dimension| by_bound(snapshot, analysis, dimension));
    let by_bound: Vec<_> = by_bound.collect::<Result<Vec<_>, _>>().map_err(Error::Learner)?;
    let charts = maps.figures.iter().zip(MAP_NOTES);
    let charts = charts.map(|(figure, note)| PageChart { note, ..PageChart::of(figure, &files, &query) }).collect();
    let parallel = parallel(snapshot, analysis).map_err(Error::Learner)?;
    let mut marginals: Vec<PageChart> = marginals(analysis).iter().map(drawn).collect();
    let results = snapshot.trials.iter().filter(|trial| trial.state.is_result()).count();
    // As on the page of the study: no recommendation before people have answered.
    let recommends = !snapshot.waits_for_first_answer();
    Ok(ShownAnalysis {
        agreement: analysis.agreement,
        certainty: certainty(snapshot, analysis),
        recommends,
        gaits: analysis.gaits.iter().take(MAX_LISTED).map(|gait| gait_row(gait, analysis, snapshot)).collect(),
        more_gaits: analysis.gaits.len().saturating_sub(MAX_LISTED),
        cost: cost_and_rmse(snapshot, recommended(snapshot, analysis)).as_ref().map(drawn),
        main_effects: main_effects(analysis),
        legend: shared_legend(&mut marginals),
        marginals,
        charts,
        maps,
        by_bound: by_bound.iter().flatten().map(drawn).collect(),
        parallel: parallel.as_ref().map(drawn),
        newest_only: results > DRAWN,
        surprising_answers: analysis
            .surprising_answers
            .iter()
            .take(MAX_LISTED)
            .filter_map(|s| surprising_answer_row(s, snapshot))
            .collect(),
        more_surprising_answers: analysis.surprising_answers.len().saturating_sub(MAX_LISTED),
    })
}

fn gait_row(gait: &GaitUtility, analysis: &Analysis, snapshot: &StudySnapshot) -> GaitRow {
    let trials = gait.trials.iter().filter_map(|id| snapshot.trial(*id));
    GaitRow {
        rmse: decimal(trials.clone().next().and_then(|trial| trial.gait_rmse_rad)),
        trials: trials.take(NAMED).map(|trial| (trial.id, trial.number)).collect(),
        more_trials: gait.trials.len().saturating_sub(NAMED),
        utility: format::utility(&gait.utility),
        worse: gait
            .behind
            .map(|behind| worse(gait, analysis, snapshot).map_or_else(|| worse_by_utility(&behind), str::to_owned)),
    }
}

/// Whether Gait RMSE rates a gait worse than the recommended one. `None` unless Gait RMSE answers all comparisons.
fn worse(gait: &GaitUtility, analysis: &Analysis, snapshot: &StudySnapshot) -> Option<&'static str> {
    if snapshot.study.plan.answer_source != AnswerSource::GaitRmse {
        return None;
    }
    let rmse = |gait: &GaitUtility| snapshot.trial(*gait.trials.first()?)?.gait_rmse_rad;
    let (own, recommended) = (rmse(gait)?, rmse(analysis.gaits.first()?)?);
    Some(match own.total_cmp(&recommended) {
        Ordering::Greater => "yes, by Gait RMSE",
        Ordering::Equal => "equal Gait RMSE",
        Ordering::Less => "no, by Gait RMSE",
    })
}

fn worse_by_utility(behind: &Prediction) -> String {
    let percent = percent(behind.probability_above_zero());
    if is_distinguishable(behind) {
        format!("yes ({percent} sure)")
    } else {
        format!("too few comparisons to tell ({percent} sure)")
    }
}

/// The bounds with several values, the one that matters most first.
fn main_effects(analysis: &Analysis) -> Vec<MainEffectRow> {
    let dimensions = analysis.posterior.space().dimensions();
    let ranked = MainEffect::ranked(&analysis.main_effects);
    let ends = |side: f64| {
        let end = move |place: &usize| {
            let difference = &analysis.main_effects[*place].difference;
            difference.mean + side * difference.standard_deviation
        };
        ranked.iter().map(end)
    };
    let (low, high) = (ends(-1.0).fold(0.0, f64::min), ends(1.0).fold(0.0, f64::max));
    let at = |value: f64| EffectBar::WIDTH * (value - low) / (high - low).max(f64::MIN_POSITIVE);
    let row = |place: usize| {
        let effect = &analysis.main_effects[place];
        let name = &dimensions[place].name;
        MainEffectRow {
            limited: bound_units::meaning(name),
            name: name.clone(),
            bar: EffectBar {
                zero: at(0.0),
                mean: at(effect.difference.mean),
                low: at(effect.difference.mean - effect.difference.standard_deviation),
                high: at(effect.difference.mean + effect.difference.standard_deviation),
            },
            effect: format!("{:.2} ± {:.2}", effect.difference.mean, effect.difference.standard_deviation),
            best: bound_units::number(name, effect.best),
            worst: bound_units::number(name, effect.worst),
            is_distinguishable: is_distinguishable(&effect.difference),
        }
    };
    ranked.into_iter().filter(|place| dimensions[*place].values.len() > 1).map(row).collect()
}

fn surprising_answer_row(surprising: &SurprisingAnswer, snapshot: &StudySnapshot) -> Option<SurprisingAnswerRow> {
    let text = match surprising.answer.content {
        FeedbackContent::Suggestion { over, .. } => {
            format!("the suggested bounds are better than those of trial {}", snapshot.trial(over)?.number)
        }
        _ => answer_in_words(&surprising.answer, snapshot)?,
    };
    let percent = surprising.probability.map_or_else(|| "–".to_owned(), percent);
    Some(SurprisingAnswerRow { text, source: format::source(&surprising.answer), percent })
}
