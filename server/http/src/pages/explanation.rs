//! The explanation of a trial without a gait, on its page, the button that requests it, and the buttons that create a study
//! with relaxed bounds.

use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::format;
use crate::page_error::PageError;
use axum::extract::State;
use axum::response::Redirect;
use gait_optimizer::Violation;
use gait_optimizer::explanation::{Explanation, status_in_words};
use gaitwright_service::access::Run;
use gaitwright_service::studies::explanation::{self, Elapsed, ExplanationEffort, ExplanationState};
use gaitwright_store::trials::Trial;
use gaitwright_store::{TrialId, commit};

/// Why a trial has no gait.
pub(super) struct NoGait {
    /// What the end of the solve means.
    pub(super) outcome: &'static str,
    /// The explanation, or its progress.
    pub(super) state: ExplanationState,
    /// How long the explanation has been running.
    pub(super) elapsed: Option<Elapsed>,
    /// The last event of the study so far; the page loads the explanation when a later one announces it.
    pub(super) last_event: i64,
}

impl NoGait {
    /// `None` if the trial has a gait or was not solved by the service.
    pub(super) fn new(
        trial: &Trial,
        state: ExplanationState,
        effort: &ExplanationEffort,
        last_event: i64,
    ) -> Option<Self> {
        let elapsed = if let ExplanationEffort::Running(elapsed) = effort { Some(*elapsed) } else { None };
        Some(Self { outcome: trial.status.and_then(status_in_words)?, state, elapsed, last_event })
    }

    /// The progress of a running explanation, as a sentence.
    pub(super) fn progress(elapsed: &Elapsed) -> String {
        let time = |seconds: u64| format::duration(seconds as f64);
        let usual = match elapsed.usual_seconds {
            None => "This is the first explanation since the service started; most take a few minutes.".to_owned(),
            Some(usual) if usual > elapsed.seconds => format!("About {} left.", time(usual - elapsed.seconds)),
            Some(usual) => format!("Earlier explanations took about {}; this one takes longer.", time(usual)),
        };
        format!("Running for {}. {usual}", time(elapsed.seconds))
    }

    /// The relaxations that give a gait.
    pub(super) fn ways_out(explanation: &Explanation) -> Vec<WayOut> {
        let alone = explanation.relaxations.iter().filter_map(|one| Some(vec![(one.bound.as_str(), one.to?)]));
        let together = explanation
            .together
            .iter()
            .filter_map(|joint| joint.bounds.iter().map(|one| Some((one.bound.as_str(), one.to?))).collect());
        alone.chain(together).map(|bounds: Vec<_>| WayOut::of(&bounds)).collect()
    }

    pub(super) fn is_coming(&self) -> bool {
        matches!(self.state, ExplanationState::BeingMade | ExplanationState::Waiting)
    }

    pub(super) fn may_be_asked(&self) -> bool {
        matches!(self.state, ExplanationState::Waiting | ExplanationState::NotAsked)
    }

    pub(super) fn amount(violation: &Violation) -> String {
        format::number(violation.amount)
    }
}

/// A relaxation that gives a gait.
pub(super) struct WayOut {
    /// `a7 = 20 ° (hip angle)`.
    pub(super) label: String,
    /// The bounds and their values as a parameter of the form for a new study: `a5=0.03,a7=20`.
    pub(super) relax: String,
}

impl WayOut {
    fn of(bounds: &[(&str, f64)]) -> Self {
        let label = |(bound, value): &(&str, f64)| {
            let meaning = format::meaning(bound);
            let unit = meaning.rsplit_once(", ").map_or(String::new(), |(_, unit)| format!(" {unit}"));
            format!("{bound} = {value}{unit} ({})", format::limited(bound))
        };
        let relax = |(bound, value): &(&str, f64)| format!("{bound}={value}");
        Self {
            label: bounds.iter().map(label).collect::<Vec<_>>().join(" and "),
            relax: bounds.iter().map(relax).collect::<Vec<_>>().join(","),
        }
    }
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
            "Running for 2 min. Earlier explanations took about 80 s; this one takes longer."
        );
    }

    #[test]
    fn way_out_names_each_bound_with_its_unit() {
        let way = WayOut::of(&[("a5", 0.03), ("a7", 20.0)]);
        assert_eq!(way.label, "a5 = 0.03 m (swing-foot clearance) and a7 = 20 ° (hip angle)");
        assert_eq!(way.relax, "a5=0.03,a7=20");
    }
}
