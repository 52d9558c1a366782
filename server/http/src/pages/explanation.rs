//! The explanation of a trial without a gait, on its page, the button that requests it, and the buttons that make a trial or
//! a study with relaxed bounds.

use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::bound_units::{self, ANGLES};
use crate::extractors::Form;
use crate::format;
use crate::page_error::PageError;
use axum::extract::State;
use axum::response::Redirect;
use gait_optimizer::Violation;
use gait_optimizer::explanation::{Explanation, quantity, status_in_words};
use gaitwright_service::access::Run;
use gaitwright_service::error::Error;
use gaitwright_service::studies::explanation::{self, Elapsed, ExplanationEffort, ExplanationState};
use gaitwright_service::studies::relaxed_trial::{self, NoRelaxedTrial, RelaxedBounds, RelaxedTrial};
use gaitwright_service::studies::snapshot::{MAX_TRIES, has_changed};
use gaitwright_store::studies::Study;
use gaitwright_store::trials::Trial;
use gaitwright_store::{Connection, TrialId, commit};
use serde::Deserialize;
use std::sync::Arc;

/// Why a trial has no gait.
pub(super) struct NoGait {
    /// Meaning of the end of the solve.
    pub(super) outcome: &'static str,
    /// The explanation, or its progress.
    pub(super) state: ExplanationState,
    /// How long the explanation has been running.
    pub(super) elapsed: Option<Elapsed>,
    /// The relaxations that give a gait.
    pub(super) relaxations: Vec<FeasibleRelaxation>,
    /// The last event of the study so far; the page loads the explanation when a later one announces it.
    pub(super) last_event: i64,
}

impl NoGait {
    /// `None` if the trial has a gait or was not solved by the service.
    pub(super) fn new(
        trial: &Trial,
        state: ExplanationState,
        relaxations: Vec<FeasibleRelaxation>,
        effort: &ExplanationEffort,
        last_event: i64,
    ) -> Option<Self> {
        let elapsed = if let ExplanationEffort::Running(elapsed) = effort { Some(*elapsed) } else { None };
        Some(Self { outcome: trial.status.and_then(status_in_words)?, state, elapsed, relaxations, last_event })
    }

    /// The progress of a running explanation, as a sentence.
    pub(super) fn progress(elapsed: &Elapsed) -> String {
        let time = |seconds: u64| format::duration(seconds as f64);
        let usual = match elapsed.usual_seconds {
            None => "This is the first explanation since the service started; most take a few minutes.".to_owned(),
            Some(usual) if usual > elapsed.seconds => format!("About {} left.", time(usual - elapsed.seconds)),
            Some(usual) => format!("Earlier explanations took about {}; this one is taking longer.", time(usual)),
        };
        format!("Running for {}. {usual}", time(elapsed.seconds))
    }

    pub(super) fn is_pending(&self) -> bool {
        matches!(self.state, ExplanationState::BeingMade | ExplanationState::Waiting)
    }

    /// Whether the page waits for an explanation: one that is being stopped still keeps what it has found.
    pub(super) fn may_appear(&self) -> bool {
        self.is_pending() || self.state == ExplanationState::NotAsked
    }

    pub(super) fn may_be_asked(&self) -> bool {
        match &self.state {
            ExplanationState::Waiting | ExplanationState::NotAsked => true,
            ExplanationState::Made(made) => made.explanation.stopped_early,
            ExplanationState::BeingMade | ExplanationState::Refused(_) => false,
        }
    }

    pub(super) fn amount(violation: &Violation) -> String {
        format::number(ANGLES.shown(violation.amount, &violation.unit))
    }
}

/// A relaxation that gives a gait.
pub(super) struct FeasibleRelaxation {
    /// `a7 = 20° (hip angle)`.
    pub(super) label: String,
    /// The bounds and their values as a parameter of the form for a new study: `a5=0.03,a7=20`.
    pub(super) relax: String,
    /// The trial that the study can try.
    pub(super) trial: Result<RelaxedTrialOffer, NoRelaxedTrial>,
}

/// A trial that tries a relaxation in the same study.
pub(super) struct RelaxedTrialOffer {
    /// The bounds with their values in the search space: `a7 = 35°`.
    pub(super) bounds: String,
    /// Whether these values are looser than those of the relaxation.
    pub(super) is_looser: bool,
    /// Whether the relaxed trial adds one trial to the study.
    pub(super) extends: bool,
}

impl FeasibleRelaxation {
    /// The relaxations of an explanation.
    pub(super) async fn all(
        db: &mut Connection,
        study: &Study,
        trial: &Trial,
        explanation: &Explanation,
    ) -> Result<Vec<Self>, Error> {
        let mut relaxations = Vec::new();
        for relaxation in relaxed_trial::relaxations(explanation) {
            let possible = relaxed_trial::of(db, study, trial, &relaxation).await?;
            relaxations.push(Self::of(&relaxation, possible));
        }
        Ok(relaxations)
    }

    fn of(relaxation: &RelaxedBounds, possible: Result<RelaxedTrial, NoRelaxedTrial>) -> Self {
        let label = |(bound, value): &(String, f64)| quantity(bound, *value, ANGLES);
        let relax = |(bound, value): &(String, f64)| format!("{bound}={value}");
        let offer = |trial: RelaxedTrial| RelaxedTrialOffer {
            bounds: trial
                .bounds
                .iter()
                .map(|(bound, value)| with_unit(bound, *value))
                .collect::<Vec<_>>()
                .join(" and "),
            is_looser: trial.bounds != *relaxation,
            extends: trial.extends,
        };
        Self {
            label: relaxation.iter().map(label).collect::<Vec<_>>().join(" and "),
            relax: relaxation.iter().map(relax).collect::<Vec<_>>().join(","),
            trial: possible.map(offer),
        }
    }
}

/// `a7 = 35°`.
fn with_unit(bound: &str, value: f64) -> String {
    format!("{bound} = {}", bound_units::in_unit(bound, value))
}

/// Which relaxation of the explanation to try, counted from 0.
#[derive(Debug, Deserialize)]
pub(super) struct ChosenRelaxation {
    relaxation: usize,
}

/// `POST /trials/{id}/relaxed-trial`.
pub(super) async fn try_relaxed(
    authorized: Authorized<Run>,
    State(mut app): State<AppState>,
    Id(id, _): Id<TrialId, Run>,
    Form(form): Form<ChosenRelaxation>,
) -> Result<Redirect, PageError> {
    for _ in 0..MAX_TRIES {
        let analyses = Arc::clone(&app.analyses);
        let chosen = relaxed_trial::choose(app.store_mut(), id, form.relaxation, &analyses).await?;
        let mut writer = app.write().await?;
        if let Some(trial) = relaxed_trial::queue(&mut writer, &authorized.caller.actor, &chosen).await? {
            commit(writer).await?;
            app.scheduler.changed();
            return Ok(Redirect::to(&format!("/trials/{trial}")));
        }
    }
    Err(has_changed().into())
}

/// `POST /trials/{id}/explain`.
pub(super) async fn post(
    authorized: Authorized<Run>,
    State(app): State<AppState>,
    Id(id, _): Id<TrialId, Run>,
) -> Result<Redirect, PageError> {
    let mut writer = app.write().await?;
    explanation::ask(&mut writer, &authorized.caller.actor, id, app.scheduler.explaining(id)).await?;
    commit(writer).await?;
    app.scheduler.explain_again(id);
    app.scheduler.changed();
    Ok(Redirect::to(&format!("/trials/{id}#explanation")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_says_how_much_is_left_once_a_duration_is_known() {
        let progress = |seconds, usual_seconds| NoGait::progress(&Elapsed { seconds, usual_seconds });
        assert!(progress(20, None).starts_with("Running for 20 s. This is the first explanation"));
        assert_eq!(progress(20, Some(80)), "Running for 20 s. About 60 s left.");
        assert_eq!(
            progress(90, Some(80)),
            "Running for 2 min. Earlier explanations took about 80 s; this one is taking longer."
        );
    }

    #[test]
    fn relaxation_names_each_bound_with_its_unit() {
        let bounds = vec![("a5".to_owned(), 0.03), ("a7".to_owned(), 20.0)];
        let relaxation = FeasibleRelaxation::of(&bounds, Err(NoRelaxedTrial::NotTuned("a7".to_owned())));
        assert_eq!(relaxation.label, "a5 = 0.03 m (swing-foot clearance) and a7 = 20° (hip angle)");
        assert_eq!(relaxation.relax, "a5=0.03,a7=20");
    }
}
