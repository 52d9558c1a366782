//! Figures as files: SVG that stands alone, PNG, and the numbers behind them as CSV.

use crate::AppState;
use crate::extract::Params;
use crate::may::May;
use crate::pages::{belief, figures};
use crate::problem::Refusal;
use crate::reached::{Id, Named, reached};
use crate::shown::Shown;
use axum::extract::{Path, State};
use axum::http::header;
use axum::response::{IntoResponse, Response};
use gaitwright_charts::Figure;
use gaitwright_compute::OnPool;
use gaitwright_service::access::Read;
use gaitwright_service::error::Error;
use gaitwright_store::{LabSessionId, ReferenceGaitId, StudyId, TrialId, reference_gaits};
use serde::Deserialize;

/// A second study, or a second trial.
#[derive(Debug, Deserialize)]
pub(super) struct Beside<T> {
    other: Option<Named<T>>,
}

/// `GET /studies/{id}/figures/{file}`: those of the page with the figures of a study.
#[utoipa::path(
    get,
    path = "/studies/{id}/figures/{file}",
    operation_id = "get_study_figure",
    tag = "figures",
    params(
        ("id" = StudyId, Path, description = "The study"),
        ("file" = String, Path, description = "Name of the figure, as its page links it, with .svg, .png or .csv"),
        ("other" = Option<StudyId>, Query, description = "A study that is drawn beside it")
    ),
    responses((status = 200, description = "The figure", content((String = "image/svg+xml"), (Vec<u8> = "image/png"), (String = "text/csv"))), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study(
    may: May<Read>,
    State(mut app): State<AppState>,
    Shown(id, _): Shown<StudyId, Read>,
    Path((_, file)): Path<(String, String)>,
    Params(Beside { other }): Params<Beside<StudyId>>,
) -> Result<Response, Refusal> {
    let other = reached(&mut *app.read().await?, may.caller.reach(), other).await?;
    let figures = figures::of_study(&mut app, id, other).await?.into_figures();
    answer(&mut app, figures, file).await
}

/// `GET /trials/{id}/figures/{file}`: those of the page of a gait; while its solve runs, how far that is. With another
/// trial beside it, the joint angles of both.
#[utoipa::path(
    get,
    path = "/trials/{id}/figures/{file}",
    operation_id = "get_trial_figure",
    tag = "figures",
    params(
        ("id" = TrialId, Path, description = "The trial"),
        ("file" = String, Path, description = "Name of the figure, as its page links it, with .svg, .png or .csv"),
        ("other" = Option<TrialId>, Query, description = "A converged trial of the same study that is drawn beside it")
    ),
    responses((status = 200, description = "The figure", content((String = "image/svg+xml"), (Vec<u8> = "image/png"), (String = "text/csv"))), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_trial(
    may: May<Read>,
    State(mut app): State<AppState>,
    Shown(id, _): Shown<TrialId, Read>,
    Path((_, file)): Path<(String, String)>,
    Params(Beside { other }): Params<Beside<TrialId>>,
) -> Result<Response, Refusal> {
    let other = reached(&mut *app.read().await?, may.caller.reach(), other).await?;
    let figures = match other {
        None => figures::of_trial(&mut app, id).await?,
        Some(other) => figures::of_pair(&mut app, id, other).await?,
    };
    answer(&mut app, figures, file).await
}

/// `GET /lab-sessions/{id}/figures/{file}`: muscle activity and limit cycles of a lab session.
#[utoipa::path(
    get,
    path = "/lab-sessions/{id}/figures/{file}",
    operation_id = "get_lab_session_figure",
    tag = "figures",
    params(
        ("id" = LabSessionId, Path, description = "The session"),
        ("file" = String, Path, description = "Name of the figure, as its page links it, with .svg, .png or .csv")
    ),
    responses((status = 200, description = "The figure", content((String = "image/svg+xml"), (Vec<u8> = "image/png"), (String = "text/csv"))), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_session(
    _: May<Read>,
    State(mut app): State<AppState>,
    Shown(id, _): Shown<LabSessionId, Read>,
    Path((_, file)): Path<(String, String)>,
) -> Result<Response, Refusal> {
    let figures = figures::of_session(&mut app, id).await?;
    answer(&mut app, figures, file).await
}

/// `GET /studies/{id}/belief/figures/{file}`: what the learner believes, as on its page.
#[utoipa::path(
    get,
    path = "/studies/{id}/belief/figures/{file}",
    operation_id = "get_belief_figure",
    tag = "figures",
    params(
        ("id" = StudyId, Path, description = "The study"),
        ("file" = String, Path, description = "Name of the figure, as its page links it, with .svg, .png or .csv"),
        ("right" = Option<String>, Query, description = "The bound of the maps that runs to the right; by default the first one"),
        ("down" = Option<String>, Query, description = "The one that runs downwards; by default the second one")
    ),
    responses((status = 200, description = "The figure", content((String = "image/svg+xml"), (Vec<u8> = "image/png"), (String = "text/csv"))), (status = 409, description = "The subject withdrew consent"), (status = 422, description = "A parameter is not acceptable")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_belief(
    _: May<Read>,
    State(mut app): State<AppState>,
    Shown(id, _): Shown<StudyId, Read>,
    Path((_, file)): Path<(String, String)>,
    Params(choice): Params<belief::Choice>,
) -> Result<Response, Refusal> {
    let figures = belief::figures(&mut app, id, choice).await?;
    answer(&mut app, figures, file).await
}

/// `GET /reference-gaits/{id}/figures/{file}`: the joint angles of a reference gait.
#[utoipa::path(
    get,
    path = "/reference-gaits/{id}/figures/{file}",
    operation_id = "get_reference_gait_figure",
    tag = "figures",
    params(
        ("id" = ReferenceGaitId, Path, description = "The reference gait"),
        ("file" = String, Path, description = "Name of the figure, as its page links it, with .svg, .png or .csv")
    ),
    responses((status = 200, description = "The figure", content((String = "image/svg+xml"), (Vec<u8> = "image/png"), (String = "text/csv")))),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_reference(
    _: May<Read>,
    State(mut app): State<AppState>,
    Id(id, _): Id<ReferenceGaitId, Read>,
    Path((_, file)): Path<(String, String)>,
) -> Result<Response, Refusal> {
    let reference = reference_gaits::get(&mut *app.read().await?, id).await?.definition;
    answer(&mut app, figures::of_reference(&reference), file).await
}

/// One of the figures in the form that the name of the file says.
async fn answer(app: &mut AppState, figures: Vec<Figure>, file: String) -> Result<Response, Refusal> {
    let missing = || Error::NotFound { what: "the figure".to_owned(), id: file.clone() };
    let (name, form) = file.rsplit_once('.').ok_or_else(missing)?;
    let figure = figures.into_iter().find(|figure| figure.name == name).ok_or_else(missing)?;
    let (kind, form) = match form {
        "svg" => ("image/svg+xml", Form::Svg),
        "png" => ("image/png", Form::Png),
        "csv" => ("text/csv; charset=utf-8", Form::Csv),
        _ => return Err(missing().into()),
    };
    let draw = move |_: &OnPool| match form {
        Form::Svg => Ok(figure.svg().into_bytes()),
        Form::Csv => Ok(figure.csv().into_bytes()),
        Form::Png => figure.png(),
    };
    let bytes = app.compute(draw).await?.map_err(|e| Error::Internal(e.to_string()))?;
    let headers = [
        (header::CONTENT_TYPE, kind.to_owned()),
        (header::CONTENT_DISPOSITION, format!("attachment; filename=\"{file}\"")),
    ];
    Ok((headers, bytes).into_response())
}

/// Forms of files.
#[derive(Debug, Clone, Copy)]
enum Form {
    Svg,
    Png,
    Csv,
}
