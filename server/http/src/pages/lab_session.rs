//! The page of a lab session with its walks and measurements.

use super::emg_form::{EmgFields, EmgStep};
use super::joint_angle_form::{JointAngleFields, JointAngleStep};
use super::measurement_forms::{FilterFields, Forms};
use super::page_chart::{PageChart, shared_legend};
use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::extractors::Form;
use crate::figures::lab_charts;
use crate::figures::lab_session::measured_cycles;
use crate::format::{self, words};
use crate::page_error::{PageError, PageResult, page};
use crate::refused_fields::{FieldLabels, RefusedFields, TypedForm, refused_once};
use crate::visible::Visible;
use askama::Template;
use axum::extract::State;
use axum::response::{IntoResponse, Redirect, Response};
use gait_optimizer::emg::{CycleActivity, CycleStart, EmgSettings};
use gaitwright_charts::Figure;
use gaitwright_compute::OnPool;
use gaitwright_service::access::{Administer, Caller, Read, RequiredRight, Run};
use gaitwright_service::error::Error;
use gaitwright_service::studies::lab::{
    self, LabSessionState, LabSessionView, MeasurementFormat, ProcessedEmg, WalkActivity, WalkCondition, WalkView,
};
use gaitwright_store::measurement_files::{self, MeasurementFile, MeasurementKind};
use gaitwright_store::studies::Study;
use gaitwright_store::{LabSessionId, TrialId, commit, lab_sessions, studies, trials};
use serde::Deserialize;

#[derive(Template)]
#[template(path = "lab_session.html")]
struct SessionPage {
    study: Study,
    name_in_lab: String,
    state: String,
    gaits: [NumberedTrial; 2],
    walks: Vec<WalkRow>,
    may_run: bool,
    may_unblind: bool,
    /// Recorded walks, for which files can be uploaded.
    recorded: Vec<UploadWalk>,
    recordings: Vec<MeasurementFile>,
    /// Measured joint angles over the cycle of each leg, and their legend.
    joint_angles: Vec<PageChart>,
    angle_legend: Vec<(String, String)>,
    has_emg: bool,
    forms: Forms,
    filters: FilterFields,
    measured: Option<MeasuredActivity>,
    limit_cycles: Vec<PageChart>,
    refused: RefusedFields,
    /// The answer of the subject, in words.
    answer_in_words: &'static str,
    session: LabSessionView,
}

impl SessionPage {
    /// Whether something was measured, which the page then shows before walks, files and forms.
    fn has_results(&self) -> bool {
        self.measured.is_some() || !self.joint_angles.is_empty() || !self.limit_cycles.is_empty()
    }

    /// Whether the user can upload files of walks.
    fn accepts_files(&self) -> bool {
        self.may_run && self.session.closed.is_none() && !self.recorded.is_empty()
    }
}

/// A recorded walk, and which kinds of files it has.
struct UploadWalk {
    number: u8,
    has_emg: bool,
    has_joint_angles: bool,
}

impl UploadWalk {
    fn all(session: &LabSessionView, files: &[MeasurementFile]) -> Vec<Self> {
        let recorded = session.walks.iter().filter(|walk| walk.recorded.is_some());
        let of_walk = |walk: &WalkView| {
            let has = |kind| files.iter().any(|file| file.walk == walk.number && file.kind == kind);
            let (has_emg, has_joint_angles) = (has(MeasurementKind::Emg), has(MeasurementKind::JointAngles));
            Self { number: walk.number, has_emg, has_joint_angles }
        };
        recorded.map(of_walk).collect()
    }
}

/// The results of the EMG recordings.
struct MeasuredActivity {
    how: String,
    walks: Vec<String>,
    /// The walks that are compared with the walk without the device.
    compared: Vec<String>,
    /// Muscle, its EMG RMSE in the walks that are compared, its average activity in each walk.
    rows: Vec<(String, Vec<String>, Vec<String>)>,
    /// Walk, measured muscle, muscle of the model, RMS difference, correlation.
    model: Vec<[String; 5]>,
    /// Why a comparison is uncertain, with the walk.
    warnings: Vec<String>,
    charts: Vec<PageChart>,
    /// The legend that the charts share.
    legend: Vec<(String, String)>,
}

impl MeasuredActivity {
    fn of(session: &LabSessionView, emg: &ProcessedEmg, mut charts: Vec<PageChart>) -> Self {
        let legend = shared_legend(&mut charts);
        let EmgSettings { band_low_hz, band_high_hz, envelope_hz, order } = emg.result.settings;
        let strides = |walk: &WalkActivity| {
            let strides = match walk.channels.first().map_or(0, |channel| channel.strides) {
                1 => "1 stride".to_owned(),
                many => format!("{many} strides"),
            };
            format!("{strides} ({})", lab_charts::walk_name(session, walk.walk))
        };
        let counts: Vec<String> = emg.result.walks.iter().map(strides).collect();
        let walks = || emg.result.walks.iter();
        let name = |walk: &WalkActivity| lab_charts::walk_name(session, walk.walk);
        let compared: Vec<_> = walks().filter_map(|walk| Some((walk, walk.emg_rmse.as_ref()?))).collect();
        let channels = emg.result.walks.first().map_or(&[][..], |walk| &walk.channels);
        let row = |(place, channel): (usize, &CycleActivity)| {
            let rmse = compared.iter().map(|(_, rmse)| format::decimal(rmse.parts.get(place).copied()));
            let averages = walks().map(|walk| format::decimal(walk.averages.get(place).copied()));
            (lab_charts::muscle_name(&channel.channel).to_owned(), rmse.collect(), averages.collect())
        };
        let mut rows: Vec<(String, Vec<String>, Vec<String>)> = channels.iter().enumerate().map(row).collect();
        let totals = compared.iter().map(|(_, rmse)| format::decimal(Some(rmse.total))).collect();
        rows.push(("sum of all muscles".to_owned(), totals, walks().map(|_| String::new()).collect()));
        let model = emg.model.iter().flat_map(|walk| {
            walk.muscles.iter().map(|muscle| {
                [
                    lab_charts::walk_name(session, walk.walk),
                    lab_charts::muscle_name(&muscle.channel).to_owned(),
                    muscle.muscle.clone(),
                    format::decimal(Some(muscle.rms_difference)),
                    muscle.correlation.map_or_else(|| "–".to_owned(), format::signed),
                ]
            })
        });
        Self {
            how: format!(
                "Band-pass {band_low_hz} to {band_high_hz} Hz, rectified, low-pass {envelope_hz} Hz, order {order}, all \
                 zero-phase. Means of {}. Values are relative to the muscle's peak without the device. {}",
                counts.join(", "),
                left_strikes(session, &emg.result.walks),
            ),
            compared: compared.iter().map(|(walk, _)| name(walk)).collect(),
            warnings: compared
                .iter()
                .flat_map(|(walk, rmse)| rmse.warnings.iter().map(|warning| format!("{}: {warning}", name(walk))))
                .collect(),
            walks: walks().map(name).collect(),
            rows,
            model: model.collect(),
            charts,
            legend,
        }
    }
}

/// A sentence about the heel strikes from which the cycles of the left leg begin.
fn left_strikes(session: &LabSessionView, walks: &[WalkActivity]) -> String {
    let begins_so = |walk: &&WalkActivity, start| walk.channels.iter().any(|channel| channel.begins_at == start);
    let are_from_right =
        |walk: &&WalkActivity| walk.channels.iter().all(|c| c.begins_at == CycleStart::RightHeelStrike);
    if walks.iter().all(|walk| are_from_right(&walk)) {
        return "Every cycle begins at right heel strike.".to_owned();
    }
    let assumed: Vec<String> = walks
        .iter()
        .filter(|walk| begins_so(walk, CycleStart::AssumedLeftHeelStrike))
        .map(|walk| lab_charts::walk_name(session, walk.walk))
        .collect();
    let begin = "Each cycle begins at the heel strike of its leg.";
    if assumed.is_empty() {
        return begin.to_owned();
    }
    format!(
        "{begin} Left heel strikes were not recorded ({}); they are taken to be half a stride after the right ones.",
        assumed.join(", ")
    )
}

/// A trial and its number.
struct NumberedTrial {
    id: TrialId,
    number: u32,
}

struct WalkRow {
    walk: WalkView,
    /// The condition, as far as it is not blinded.
    condition: &'static str,
}

/// `GET /lab-sessions/{id}`.
pub(super) async fn get(
    authorized: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<LabSessionId, Read>,
) -> PageResult {
    show(&mut app, id, &authorized.caller, Forms::default(), RefusedFields::default()).await
}

/// The charts of a session.
struct Drawings {
    emg: Vec<PageChart>,
    joint_angles: Vec<PageChart>,
    limit_cycles: Vec<PageChart>,
}

pub(super) async fn show(
    app: &mut AppState,
    id: LabSessionId,
    caller: &Caller,
    mut forms: Forms,
    refused: RefusedFields,
) -> PageResult {
    let emg = lab::emg(app.store_mut(), id).await?;
    let cycles = measured_cycles(app.store_mut(), id).await?;
    let mut reader = app.read().await?;
    let session = LabSessionView::from(&lab_sessions::get(&mut reader, id).await?);
    let study = studies::get(&mut reader, session.study_id).await?;
    let one = trials::get(&mut reader, session.trial_a).await?.number;
    let two = trials::get(&mut reader, session.trial_b).await?.number;
    let recordings = measurement_files::of_session(&mut reader, id).await?;
    drop(reader);
    let draw = move |_: &OnPool| {
        let files = format!("/api/v1/lab-sessions/{id}/figures");
        let drawn = |figures: &[Figure]| figures.iter().map(|figure| PageChart::of(figure, &files, "")).collect();
        let of_emg = emg.as_ref().map_or_else(Vec::new, |emg| drawn(&lab_charts::emg(&session, emg)));
        let drawings = Drawings {
            emg: of_emg,
            joint_angles: drawn(&lab_charts::joint_angles(&session, &cycles)),
            limit_cycles: drawn(&lab_charts::limit_cycles(&session, &cycles)),
        };
        (session, emg, drawings)
    };
    let (session, emg, mut drawings) = app.compute(draw).await.map_err(Error::from)?;
    let recorded = UploadWalk::all(&session, &recordings);
    // The form offers the next walk without a file: the newest file of a walk replaces earlier ones.
    let next = |has: fn(&UploadWalk) -> bool| recorded.iter().find(|walk| !has(walk)).map_or(0, |walk| walk.number);
    if forms.open != "emg" {
        forms.emg.walk = next(|walk| walk.has_emg);
    }
    if forms.open != "joint_angles" {
        forms.joint_angles.walk = next(|walk| walk.has_joint_angles);
    }
    page(&SessionPage {
        study,
        name_in_lab: lab::name_in_lab(session.id),
        state: words(session.state.as_str()),
        gaits: [NumberedTrial { id: session.trial_a, number: one }, NumberedTrial { id: session.trial_b, number: two }],
        walks: session
            .walks
            .iter()
            .map(|walk| WalkRow { walk: walk.clone(), condition: in_words(walk.condition) })
            .collect(),
        may_run: caller.may(Run::NEEDED),
        may_unblind: caller.may(Administer::NEEDED),
        recorded,
        has_emg: recordings.iter().any(|recording| recording.kind == MeasurementKind::Emg),
        recordings,
        filters: forms
            .filters
            .take()
            .unwrap_or_else(|| emg.as_ref().map(|emg| emg.result.settings).unwrap_or_default().into()),
        forms,
        measured: emg.as_ref().map(|emg| MeasuredActivity::of(&session, emg, drawings.emg)),
        angle_legend: shared_legend(&mut drawings.joint_angles),
        joint_angles: drawings.joint_angles,
        limit_cycles: drawings.limit_cycles,
        refused,
        answer_in_words: session.answer.as_ref().map_or("", |answer| format::walks_in_words(answer.answer)),
        session,
    })
}

fn in_words(condition: Option<WalkCondition>) -> &'static str {
    match condition {
        None => "one of the two gaits (blinded)",
        Some(WalkCondition::Normal) => "without the device",
        Some(WalkCondition::GaitA) => "gait A",
        Some(WalkCondition::GaitB) => "gait B",
    }
}

/// The form with a note or a reason.
#[derive(Debug, Deserialize)]
pub(super) struct Note {
    #[serde(default)]
    note: String,
}

/// The label of the note with which a session is closed.
const CLOSING: FieldLabels = &[("note", "Note")];
/// The label of the reason for unblinding.
const UNBLINDING: FieldLabels = &[("reason", "Reason")];

/// `POST /lab-sessions/{id}/close`.
pub(super) async fn close(
    authorized: Authorized<Run>,
    State(mut app): State<AppState>,
    Id(id, _): Id<LabSessionId, Run>,
    Form(Note { note }): Form<Note>,
) -> Result<Response, PageError> {
    let done = async {
        let mut writer = app.write().await?;
        lab::close(&mut writer, &authorized.caller.actor, id, &note).await?;
        Ok(commit(writer).await?)
    };
    let refused = refused_once(done.await, CLOSING)?;
    answer(&mut app, id, &authorized.caller, refused, Forms::default()).await
}

/// `POST /lab-sessions/{id}/unblind`.
pub(super) async fn unblind(
    authorized: Authorized<Administer>,
    State(mut app): State<AppState>,
    Id(id, _): Id<LabSessionId, Administer>,
    Form(Note { note }): Form<Note>,
) -> Result<Response, PageError> {
    let done = async {
        let mut writer = app.write().await?;
        lab::unblind(&mut writer, &authorized.caller.actor, id, &note).await?;
        Ok(commit(writer).await?)
    };
    let refused = refused_once(done.await, UNBLINDING)?;
    // The learner may have a new preference.
    app.scheduler.changed();
    answer(&mut app, id, &authorized.caller, refused, Forms::default()).await
}

/// Shows the session again after a change, with the reasons if it was refused.
pub(super) async fn answer(
    app: &mut AppState,
    id: LabSessionId,
    caller: &Caller,
    refused: RefusedFields,
    forms: Forms,
) -> Result<Response, PageError> {
    if refused.is_empty() {
        return Ok(Redirect::to(&format!("/lab-sessions/{id}")).into_response());
    }
    Ok((refused.status(), show(app, id, caller, forms, refused).await?).into_response())
}
