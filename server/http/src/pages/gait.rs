//! The page of a trial and its gait.

use super::certificate::{self, CertificateJob};
use super::explanation::{FeasibleRelaxation, NoGait};
use super::gait_overlay::{GaitOverlay, OverlayForm};
use super::gait_summary::GaitSummary;
use super::joint_peaks::JointPeaks;
use super::local_optima::{self as shown_local_optima, ShownLocalOptimum};
use super::page_chart::{PageChart, shared_legend};
use super::reached_bounds::{self, BoundUse};
use super::safety_review::{ReportFields, ReviewFields};
use super::sensitivities::SensitivityTable;
use super::simulated_walks::{SimulatedWalksSection, SimulationFields};
use crate::AppState;
use crate::accessible::{Named, all_accessible};
use crate::authorization::Authorized;
use crate::extractors::Params;
use crate::format::{self, words};
use crate::page_error::{PageError, page};
use crate::refused_fields::{RefusedFields, TypedForm};
use crate::visible::Visible;
use askama::Template;
use axum::extract::State;
use axum::response::{IntoResponse, Response};
use gait_optimizer::gait::stick_figure::stick_figures;
use gait_optimizer::{Gait, IterationRecord, ReferenceGait};
use gaitwright_charts::{Figure, GaitWalker, Ghost, gait_charts};
use gaitwright_compute::OnPool;
use gaitwright_service::access::{Answer, Caller, Read, RequiredRight, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::execution::{self, Simulation};
use gaitwright_service::studies::explanation::{self, ExplanationState};
use gaitwright_service::studies::local_optima;
use gaitwright_service::studies::relaxed_trial::NoRelaxedTrial;
use gaitwright_service::studies::reported_gait::ReportedGait;
use gaitwright_service::studies::safety_reports::SafetyReports;
use gaitwright_service::studies::sensitivities;
use gaitwright_store::studies::{Study, WarmStartFrom};
use gaitwright_store::trials::Trial;
use gaitwright_store::{StudyId, TrialId, certificates, events, gaits, reference_gaits, studies, trials};
use serde::Deserialize;

#[derive(Template)]
#[template(path = "gait.html")]
struct GaitPage {
    study: Study,
    state: String,
    rmse: String,
    cost: String,
    /// Mean strides of the simulated walks on which the result depends.
    strides: Option<String>,
    seconds: String,
    violation: String,
    values: Vec<(&'static str, String)>,
    from: Option<(TrialId, u32)>,
    /// Name of the reference gait.
    reference: String,
    has_gait: bool,
    /// Spatiotemporal parameters and distances from reference gaits, for a converged gait.
    summary: Option<GaitSummary>,
    may_run: bool,
    certificate: Option<certificate::InWords>,
    /// The job that makes the certificate.
    certification: CertificateJob,
    /// Simulated walks, for a converged gait.
    walks: Option<SimulatedWalksSection>,
    /// Whether the page offers the sensitivities of a converged gait, which take a second.
    offers_sensitivities: bool,
    /// The sensitivities, or why there are none.
    sensitivities: Option<Result<SensitivityTable, String>>,
    groups: Vec<ChartSection>,
    /// The gaits that can be overlaid on this one; `None` if it has no gait to show.
    overlay: Option<GaitOverlay>,
    solve: Option<PageChart>,
    /// The stride as a row of pictures.
    tiles: Option<PageChart>,
    /// The walker, which a script moves.
    walker: Option<PageChart>,
    /// Largest torques and powers of each joint.
    peaks: Vec<JointPeaks>,
    /// Each bound with the value that the gait reaches.
    bounds: Vec<BoundUse>,
    /// The gaits of the local optima, if there are several.
    local_optima: Vec<ShownLocalOptimum>,
    /// The study, if a study like it can start from another of these gaits.
    root_study: Option<StudyId>,
    /// Why the trial has no gait.
    no_gait: Option<NoGait>,
    phases: [(&'static str, &'static str); 4],
    /// Safety reports in force.
    unsafe_by: Vec<ReportedGait>,
    /// Why the gait must not be used for walking, if the report is about another trial with the same motion.
    unsafe_elsewhere: Option<String>,
    /// Safety reports after which staff cleared the gait.
    cleared: Vec<ReportedGait>,
    /// The name of a user who may review the reports.
    reviewer: Option<String>,
    trial: Trial,
    forms: GaitForms,
    refused: RefusedFields,
}

/// The forms of the page as typed, to show a refused one again.
#[derive(Default)]
pub(super) struct GaitForms {
    /// The refused form: `simulation`, `report` or `review`.
    pub(super) open: &'static str,
    pub(super) refused: RefusedFields,
    pub(super) overlay: OverlayForm,
    pub(super) simulation: Option<SimulationFields>,
    pub(super) report: ReportFields,
    pub(super) review: ReviewFields,
}

impl GaitPage {
    /// Whether the page shows a result that a job is computing.
    fn follows_a_job(&self) -> bool {
        self.certification.is_pending() || self.walks.as_ref().is_some_and(SimulatedWalksSection::is_pending)
    }

    fn is_refused(&self, form: &str) -> bool {
        self.forms.open == form
    }

    /// The attributes of a field of this form. Two forms have a field `author`.
    fn invalid(&self, form: &str, field: &str) -> &'static str {
        if self.is_refused(form) { self.refused.invalid(field) } else { "" }
    }

    /// The name in the form of a review: as typed, or that of the user.
    fn review_author<'a>(&'a self, reviewer: &'a str) -> &'a str {
        if self.is_refused("review") { &self.forms.review.author } else { reviewer }
    }

    /// The safety reports in force of the page, for a review; `None` without one.
    fn reports(&self) -> Option<String> {
        let shown: Vec<String> = self.unsafe_by.iter().map(|report| report.id().to_string()).collect();
        (!shown.is_empty()).then(|| shown.join(","))
    }
}

/// The optional parts of the page.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct GaitQuery {
    #[serde(default)]
    sensitivities: bool,
    /// The gaits to overlay on this one.
    #[serde(default)]
    other: Vec<Named<TrialId>>,
}

/// `GET /trials/{id}`.
pub(super) async fn get(
    authorized: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<TrialId, Read>,
    Params(shown): Params<GaitQuery>,
) -> Result<Response, PageError> {
    let other = all_accessible(&mut *app.read().await?, authorized.caller.reach(), shown.other).await?;
    let forms = GaitForms { overlay: OverlayForm { other }, ..GaitForms::default() };
    Box::pin(show(&mut app, authorized.caller, id, shown.sensitivities, forms)).await
}

/// Shows the page again with a refused form.
pub(super) async fn refuse(
    app: &mut AppState,
    caller: Caller,
    id: TrialId,
    forms: GaitForms,
) -> Result<Response, PageError> {
    Box::pin(show(app, caller, id, false, forms)).await
}

async fn show(
    app: &mut AppState,
    caller: Caller,
    id: TrialId,
    with_sensitivities: bool,
    mut forms: GaitForms,
) -> Result<Response, PageError> {
    let mut reader = app.read().await?;
    let trial = trials::get(&mut reader, id).await?;
    let study = studies::get(&mut reader, trial.study_id).await?;
    let reference = reference_gaits::get(&mut reader, study.plan.reference_gait_id).await?.definition;
    let from = match trial.warm_started_from {
        Some(from) => Some((from, trials::get(&mut reader, from).await?.number)),
        None => None,
    };
    let gait = match gaits::find(&mut reader, id).await? {
        Some(gait) => Some((gait, gaits::iterations(&mut reader, id).await?)),
        None => None,
    };
    let reports = SafetyReports::read(&mut reader, study.id).await?;
    let elsewhere = reports.unsafe_motions.about(&trial).and_then(|report| report.other_trial(&trial));
    let unsafe_elsewhere =
        elsewhere.map(|other| format!("The same gait was reported as unsafe in {other}. Do not walk with it."));
    let SafetyReports { in_force: mut unsafe_by, mut cleared, .. } = reports;
    for reports in [&mut unsafe_by, &mut cleared] {
        reports.retain(|report| report.trial == id);
    }
    let certificate = certificates::find(&mut reader, id).await?.map(certificate::InWords::new);
    let with_gait = trial.state.has_gait();
    let walks = if with_gait {
        let report = execution::newest(&mut reader, id).await?;
        Some(SimulatedWalksSection::new(app.scheduler.simulating(id), report, forms.simulation.take()))
    } else {
        None
    };
    let solution =
        if with_gait && with_sensitivities { Some(sensitivities::solution(&mut reader, &trial).await) } else { None };
    let last_event = events::last(&mut reader, study.id).await?;
    let effort = app.scheduler.explaining(id);
    let explained = explanation::state(&mut reader, &trial, effort.clone()).await?;
    let ways = match &explained {
        ExplanationState::Made(made) => FeasibleRelaxation::all(&mut reader, &study, &trial, &made.explanation).await?,
        _ => Vec::new(),
    };
    let local_optima = local_optima::of_trial(&mut reader, id).await?;
    let overlay = match gait {
        Some(_) if with_gait => Some(GaitOverlay::read(&mut reader, &trial, &forms.overlay).await?),
        _ => None,
    };
    let status = overlay.as_ref().map(|overlay| &overlay.refused).filter(|refused| !refused.is_empty());
    let status = status.unwrap_or(&forms.refused).status();
    let may_run = caller.may(Run::NEEDED);
    let reviews = caller.may(Answer::NEEDED);
    // Without sign-in the name is unknown.
    let reviewer = reviews.then(|| caller.user.map_or_else(String::new, |_| caller.name));
    drop(reader);
    let root_study = is_root(&study, &trial).then_some(study.id);
    let has_gait = gait.is_some();
    let reference_name = reference.name.clone();
    let tried = trial.clone();
    let drawn = move |pool: &OnPool| {
        let gait = gait.map(|(gait, iterations)| Ok::<_, Error>((gait.unpack(pool)?, iterations.unpack(pool)?)));
        let (gait, iterations) = gait.transpose()?.unzip();
        // Charts show what they can of a malformed gait; values of it would be false.
        let well_formed = gait.as_ref().filter(|gait| with_gait && gait.validate().is_ok());
        let summary = well_formed.map(|gait| GaitSummary::new(gait, &reference)).transpose()?;
        let sensitivities = solution.map(|solution| SensitivityTable::new(solution, pool));
        let local_optima = local_optima::unpacked(pool, local_optima)?;
        let local_optima = shown_local_optima::shown(tried.id, &local_optima, &reference)?;
        let mut drawn = draw(&tried, gait.as_ref(), &reference, &iterations.unwrap_or_default())?;
        if let Some(overlay) = &overlay {
            drawn.overlay(overlay.draw(pool, &reference)?, &files_of(&tried), &overlay.query);
        }
        Ok::<_, Error>((drawn, summary, sensitivities, local_optima, overlay))
    };
    let (drawn, summary, sensitivities, local_optima, overlay) = app.compute(drawn).await.map_err(Error::from)??;
    let shown = page(&GaitPage {
        state: words(trial.state.as_str()),
        rmse: format::decimal(trial.gait_rmse_rad),
        cost: format::decimal(trial.cost_of_transport),
        strides: trial.mean_strides.map(|strides| format!("{strides:.2}")),
        seconds: format::seconds(trial.seconds_total),
        violation: format::optional_number(trial.max_violation),
        values: values(&trial),
        bounds: drawn.bounds,
        local_optima,
        root_study: root_study.filter(|_| may_run),
        no_gait: NoGait::new(&trial, explained, ways, &effort, last_event),
        from,
        reference: reference_name,
        has_gait,
        summary,
        may_run,
        certificate,
        certification: CertificateJob::of(app.scheduler.certifying(id)),
        walks,
        offers_sensitivities: with_gait && sensitivities.is_none(),
        sensitivities,
        groups: drawn.groups,
        solve: drawn.solve,
        tiles: drawn.tiles,
        walker: drawn.walker,
        peaks: drawn.peaks,
        phases: gait_charts::PHASES,
        unsafe_by,
        unsafe_elsewhere,
        cleared,
        reviewer,
        trial,
        study,
        refused: std::mem::take(&mut forms.refused),
        overlay,
        forms,
    })?;
    Ok((status, shown).into_response())
}

/// Whether every solve of the study starts from the gait of this trial.
fn is_root(study: &Study, trial: &Trial) -> bool {
    study.plan.warm_start_from == WarmStartFrom::Root && trial.number == 1
}

/// A section of charts.
struct ChartSection {
    id: &'static str,
    heading: &'static str,
    hint: String,
    /// Whether the charts are shown only on request.
    is_folded: bool,
    /// The legend of all charts; empty if each has its own.
    legend: Vec<(String, String)>,
    charts: Vec<PageChart>,
}

impl ChartSection {
    /// The charts of a group, whose files are in a folder, with a query.
    fn new(group: gait_charts::Group, files: &str, query: &str) -> Self {
        let mut charts: Vec<PageChart> = group.figures.iter().map(|f| PageChart::of(f, files, query)).collect();
        let gait_charts::Group { id, heading, hint, is_folded, .. } = group;
        Self { id, heading, hint, is_folded, legend: shared_legend(&mut charts), charts }
    }
}

/// The folder of the figures of a trial.
fn files_of(trial: &Trial) -> String {
    format!("/api/v1/trials/{}/figures", trial.id)
}

/// Charts that are computed from the gait on the thread pool.
struct GaitCharts {
    groups: Vec<ChartSection>,
    solve: Option<PageChart>,
    tiles: Option<PageChart>,
    walker: Option<PageChart>,
    peaks: Vec<JointPeaks>,
    bounds: Vec<BoundUse>,
}

impl GaitCharts {
    /// Shows these groups in place of those of the gait alone.
    fn overlay(&mut self, groups: Vec<gait_charts::Group>, files: &str, query: &str) {
        for group in groups {
            if let Some(shown) = self.groups.iter_mut().find(|shown| shown.id == group.id) {
                *shown = ChartSection::new(group, files, query);
            }
        }
    }
}

fn draw(
    trial: &Trial,
    gait: Option<&Gait>,
    reference: &ReferenceGait,
    iterations: &[IterationRecord],
) -> Result<GaitCharts, Error> {
    let files = files_of(trial);
    let drawn = |figure: &Figure| PageChart::of(figure, &files, "");
    let groups = gait.map(|gait| gait_charts::of_gait(gait, reference)).transpose()?.unwrap_or_default();
    let walker = |gait: &Gait| {
        let figure = GaitWalker::new(gait)?.with_ghost(Ghost::of_reference(gait, reference)?);
        let svg = figure.svg("A person walking one stride");
        Ok::<_, Error>(PageChart { svg, ..drawn(&gait_charts::animation(figure)) })
    };
    let unchanged = trial.report.as_ref().map_or(&[][..], |report| &report.unchanged_bounds);
    let tiles = gait.map(stick_figures).transpose()?.map(gait_charts::tiles);
    Ok(GaitCharts {
        groups: groups.into_iter().map(|group| ChartSection::new(group, &files, "")).collect(),
        solve: gait_charts::solve(iterations).as_ref().map(drawn),
        tiles: tiles.as_ref().map(drawn),
        walker: gait.map(walker).transpose()?,
        peaks: gait.map(JointPeaks::of).unwrap_or_default(),
        bounds: reached_bounds::of(&trial.action, gait, unchanged)?,
    })
}

fn values(trial: &Trial) -> Vec<(&'static str, String)> {
    let Some(r) = &trial.report else { return Vec::new() };
    vec![
        ("Hip velocity in the four intervals between impacts, m/s", r.vhip_m_s.map(|v| format!("{v:.3}")).join(", ")),
        (
            "Problem size",
            format!("{} variables, {} equalities, {} inequalities", r.variables, r.equalities, r.inequalities),
        ),
    ]
}
