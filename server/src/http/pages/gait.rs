//! A trial and its gait.

use super::certificate;
use super::error::{Page, page};
use super::format::{self, Bound, words};
use super::gait_charts::{self, Drawn};
use crate::access::{Permission, Read, Run};
use crate::error::Error;
use crate::http::AppState;
use crate::http::may::May;
use crate::http::shown::Shown;
use crate::store::studies::Study;
use crate::store::trials::Trial;
use crate::store::{StoreError, TrialId, certificates, gaits, reference_gaits, studies, trials};
use askama::Template;
use axum::extract::State;

#[derive(Template)]
#[template(path = "gait.html")]
struct GaitPage {
    study: Study,
    state: String,
    rmse: String,
    cost: String,
    seconds: String,
    violation: String,
    figures: Vec<(&'static str, String)>,
    bounds: Vec<Bound>,
    from: Option<(TrialId, u32)>,
    /// Name of the reference gait.
    reference: String,
    has_gait: bool,
    may_run: bool,
    certificate: Option<certificate::InWords>,
    charts: Vec<Drawn>,
    phases: [(&'static str, &'static str); 4],
    trial: Trial,
}

/// `GET /trials/{id}`.
pub(super) async fn get(may: May<Read>, State(app): State<AppState>, Shown(id): Shown<TrialId>) -> Page {
    let mut reader = app.read().await?;
    let trial = trials::get(&mut reader, id).await?;
    let study = studies::get(&mut reader, trial.study_id).await?;
    let reference = reference_gaits::get(&mut reader, study.plan.reference_gait_id).await?.definition;
    let from = match trial.warm_started_from {
        Some(from) => Some((from, trials::get(&mut reader, from).await?.number)),
        None => None,
    };
    let gait = match gaits::get(&mut reader, id).await {
        Ok(gait) => Some(gait),
        Err(StoreError::Missing { .. }) => None,
        Err(error) => return Err(error.into()),
    };
    let iterations = if gait.is_some() { gaits::iterations(&mut reader, id).await? } else { Vec::new() };
    let certificate = certificates::find(&mut reader, id).await?.map(certificate::InWords::new);
    drop(reader);
    let has_gait = gait.is_some();
    let reference_name = reference.name.clone();
    let charts = tokio::task::spawn_blocking(move || {
        let mut charts = gait.map(|gait| gait_charts::of_gait(&gait, &reference)).unwrap_or_default();
        charts.extend(gait_charts::of_iterations(&iterations));
        charts
    })
    .await
    .map_err(|e| Error::Internal(e.to_string()))?;
    page(&GaitPage {
        study,
        state: words(trial.state.as_str()),
        rmse: format::figure(trial.gait_rmse_rad),
        cost: format::figure(trial.cost_of_transport),
        seconds: format::seconds(trial.seconds_total),
        violation: format::tiny(trial.max_violation),
        figures: figures(&trial),
        bounds: format::bounds(&trial.action),
        from,
        reference: reference_name,
        has_gait,
        may_run: may.caller.may(Run::NEEDED),
        certificate,
        charts,
        phases: gait_charts::PHASES,
        trial,
    })
}

fn figures(trial: &Trial) -> Vec<(&'static str, String)> {
    let Some(r) = &trial.report else { return Vec::new() };
    let parts = ["torso", "left hip", "left knee", "left ankle", "right hip"];
    let parts: Vec<String> =
        parts.iter().zip(r.gait_rmse_parts_rad).map(|(name, value)| format!("{name} {value:.4}")).collect();
    vec![
        ("Gait RMSE by coordinate, rad", parts.join(", ")),
        ("Walking speed, m/s", format!("{:.3}", r.speed_m_s)),
        ("Stride length, m", format!("{:.3}", r.stride_length_m)),
        ("Stride time, s", format!("{:.3}", r.durations_s.iter().sum::<f64>())),
        ("Hip velocities, m/s", r.vhip_m_s.map(|v| format!("{v:.3}")).join(", ")),
        ("Problem", format!("{} variables, {} equalities, {} inequalities", r.variables, r.equalities, r.inequalities)),
    ]
}
