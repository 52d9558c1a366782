//! REST: downloads of figures as SVG, PNG and CSV.

use crate::AppState;
use crate::accessible::{Id, Named, all_accessible};
use crate::attachment::attachment;
use crate::authorization::Authorized;
use crate::extractors::Params;
use crate::figures::{analysis, lab_session, maps_over_two_bounds, reference_figures, study, trial};
use crate::openapi_binary::Binary;
use crate::problem_details::Refusal;
use crate::visible::Visible;
use axum::extract::{Path, State};
use axum::response::Response;
use gaitwright_charts::Figure;
use gaitwright_compute::OnPool;
use gaitwright_service::access::Read;
use gaitwright_service::error::Error;
use gaitwright_store::{LabSessionId, ReferenceGaitId, StudyId, TrialId, reference_gaits};
use serde::Deserialize;

/// Other studies for comparison.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ComparedStudy {
    #[serde(default)]
    other: Vec<Named<StudyId>>,
}

/// Gaits in a figure of a trial.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ShownGait {
    #[serde(default)]
    other: Vec<Named<TrialId>>,
    local_optimum: Option<u32>,
}

/// Download a figure of a study
///
/// Progress, answers, and curves of the recommended gait; with `other`, of all these studies.
///
/// Names: `course-gait-rmse-of-the-best-action-by-iteration`; `angles-` and one of `left-hip`, `right-hip`, `left-knee`,
/// `right-knee-prosthesis`, `left-ankle`, `right-ankle-prosthesis` and `torso-lean`; `limit-cycles-` and one of
/// `torso-lean`, `left-hip`, `left-knee`, `left-ankle`, `right-hip`, `right-knee` and `right-ankle`; `gait-of-` and the name
/// of a study; `warm-starts-of-` and the name of the study; `utility-of-the-recommended-gait`. Names of studies are in lower
/// case, and one hyphen replaces each run of characters other than the letters a to z and digits. A figure without data does
/// not exist.
#[utoipa::path(
    get,
    path = "/studies/{id}/figures/{file}",
    operation_id = "get_study_figure",
    tag = "figures",
    params(
        ("id" = StudyId, Path, description = "Identifier of the study"),
        ("file" = String, Path, description = "Name of the figure, as listed in the OpenAPI description of the operation, with .svg, .png or .csv"),
        ("other" = Option<String>, Query, description = "1 to 5 comma-separated identifiers of studies for comparison")
    ),
    responses((status = 200, description = "Figure", content((String = "image/svg+xml"), (Binary = "image/png"), (String = "text/csv"))), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study(
    authorized: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
    Path((_, file)): Path<(String, String)>,
    Params(ComparedStudy { other }): Params<ComparedStudy>,
) -> Result<Response, Refusal> {
    let others = all_accessible(&mut *app.read().await?, authorized.caller.reach(), other).await?;
    let figures = study::of_study(&mut app, id, &others).await?.into_figures();
    response(&mut app, figures, file).await
}

/// Download a figure of a trial
///
/// While the solve is running, shows its progress. With other trials, shows the joint angles, torques and powers of all of
/// them, a figure for each joint of each leg. With a local optimum, shows the gait of that one.
///
/// Names: `the-stride` and `walking`; `angles-` and `limit-cycles-`, each with `hip`, `knee`, `ankle` or `torso-lean`;
/// `torques-`, `powers-` and `accelerations-`, each with `hip`, `knee` or `ankle`; `forces-vertical` and `forces-forward`;
/// `phase-hip-velocity` and `phase-phase`; with muscles, `muscles-`, `muscle-forces-` and `fibres-`, each with `hamstrings`,
/// `gluteus`, `hip-flexors`, `vasti`, `gastrocnemius`, `soleus` or `tibialis-anterior`;
/// `solve-violation-dual-infeasibility-barrier-parameter-and-objective`, the only one while the solve is running. With
/// `other`, only `angles-`, `torques-` and `powers-`, each with `left-hip`, `right-hip`, `left-knee`,
/// `right-knee-prosthesis`, `left-ankle` or `right-ankle-prosthesis`; and `angles-torso-lean`. With `local_optimum`, only
/// `the-stride` and `walking`.
#[utoipa::path(
    get,
    path = "/trials/{id}/figures/{file}",
    operation_id = "get_trial_figure",
    tag = "figures",
    params(
        ("id" = TrialId, Path, description = "Identifier of the trial"),
        ("file" = String, Path, description = "Name of the figure, as listed in the OpenAPI description of the operation, with .svg, .png or .csv"),
        ("other" = Option<String>, Query, description = "1 to 3 comma-separated identifiers of converged trials of the same study with different gaits, which are overlaid on that of this trial"),
        ("local_optimum" = Option<u32>, Query, description = "Number of another local optimum of the trial. Without `other`")
    ),
    responses((status = 200, description = "Figure", content((String = "image/svg+xml"), (Binary = "image/png"), (String = "text/csv"))), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_trial(
    authorized: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<TrialId, Read>,
    Path((_, file)): Path<(String, String)>,
    Params(ShownGait { other, local_optimum }): Params<ShownGait>,
) -> Result<Response, Refusal> {
    let others = all_accessible(&mut *app.read().await?, authorized.caller.reach(), other).await?;
    let figures = match (&others[..], local_optimum) {
        ([], None) => trial::of_trial(&mut app, id).await?,
        ([], Some(number)) => trial::of_local_optimum(&mut app, id, number).await?,
        (others, None) => trial::of_several(&mut app, id, others).await?,
        (_, Some(number)) => return Err(Error::invalid("local_optimum", number, "absent beside other").into()),
    };
    response(&mut app, figures, file).await
}

/// Download a figure of a lab session
///
/// Muscle activity, joint angles and limit cycles.
///
/// Names: `emg-` and one of `left-rectus-femoris`, `left-tibialis-anterior`, `left-biceps-femoris`, `left-gastrocnemius`,
/// `right-rectus-femoris` and `right-biceps-femoris`; `angle-` and a joint; `limit-cycle-`, a joint, a hyphen, and
/// `without-the-device`, `gait-a` or `gait-b`, or `walk-` and the number of the walk as long as its condition is blinded.
/// Joints are `torso-lean`, `left-hip`, `left-knee`, `left-ankle`, `right-hip`, `right-knee` and `right-ankle`.
#[utoipa::path(
    get,
    path = "/lab-sessions/{id}/figures/{file}",
    operation_id = "get_lab_session_figure",
    tag = "figures",
    params(
        ("id" = LabSessionId, Path, description = "Identifier of the lab session"),
        ("file" = String, Path, description = "Name of the figure, as listed in the OpenAPI description of the operation, with .svg, .png or .csv")
    ),
    responses((status = 200, description = "Figure", content((String = "image/svg+xml"), (Binary = "image/png"), (String = "text/csv"))), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_session(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<LabSessionId, Read>,
    Path((_, file)): Path<(String, String)>,
) -> Result<Response, Refusal> {
    let figures = lab_session::of_session(&mut app, id).await?;
    response(&mut app, figures, file).await
}

/// Download a figure of the posterior
///
/// Effects of the bounds, maps over two bounds, and the trials over the bounds.
///
/// Names: `utility-a1-coordinate-velocity-s`, `utility-a2-coordinate-acceleration-s`, `utility-a3-minimum-hip-velocity-m-s`,
/// `utility-a4-maximum-hip-velocity-m-s`, `utility-a5-swing-foot-clearance-m`, `utility-a6-torso-lean`,
/// `utility-a7-hip-angle` and `utility-a8-ankle-angle`, for tuned bounds; `trials-by-` and a tuned bound; `x-y-utility` and
/// `x-y-probability-of-converging`, with the two bounds in place of `x` and `y`; `cost-of-transport-and-gait-rmse`;
/// `bounds-and-result-of-each-trial`.
#[utoipa::path(
    get,
    path = "/studies/{id}/analysis/figures/{file}",
    operation_id = "get_analysis_figure",
    tag = "figures",
    params(
        ("id" = StudyId, Path, description = "Identifier of the study"),
        ("file" = String, Path, description = "Name of the figure, as listed in the OpenAPI description of the operation, with .svg, .png or .csv"),
        ("x" = Option<String>, Query, description = "Bound on the horizontal axis of a map. The most important one by default"),
        ("y" = Option<String>, Query, description = "Bound on the vertical axis of a map. The second most important one by default")
    ),
    responses((status = 200, description = "Figure", content((String = "image/svg+xml"), (Binary = "image/png"), (String = "text/csv"))), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_analysis(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
    Path((_, file)): Path<(String, String)>,
    Params(choice): Params<maps_over_two_bounds::AxisChoice>,
) -> Result<Response, Refusal> {
    let figures = analysis::figures(&mut app, id, choice).await?;
    response(&mut app, figures, file).await
}

/// Download a figure of a reference gait
///
/// Joint angles over the cycle of each leg.
///
/// Names: `reference-hip`, `reference-knee`, `reference-ankle` and `reference-torso-lean`.
#[utoipa::path(
    get,
    path = "/reference-gaits/{id}/figures/{file}",
    operation_id = "get_reference_gait_figure",
    tag = "figures",
    params(
        ("id" = ReferenceGaitId, Path, description = "Identifier of the reference gait"),
        ("file" = String, Path, description = "Name of the figure, as listed in the OpenAPI description of the operation, with .svg, .png or .csv")
    ),
    responses((status = 200, description = "Figure", content((String = "image/svg+xml"), (Binary = "image/png"), (String = "text/csv")))),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_reference(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Id(id, _): Id<ReferenceGaitId, Read>,
    Path((_, file)): Path<(String, String)>,
) -> Result<Response, Refusal> {
    let reference = reference_gaits::get(&mut *app.read().await?, id).await?.definition;
    response(&mut app, reference_figures::of_reference(&reference), file).await
}

/// Responds with a figure in the format of the file name.
async fn response(app: &mut AppState, figures: Vec<Figure>, file: String) -> Result<Response, Refusal> {
    let missing = || Error::NotFound { what: "figure".to_owned(), id: file.clone() };
    let (name, format) = file.rsplit_once('.').ok_or_else(missing)?;
    let figure = figures.into_iter().find(|figure| figure.name == name).ok_or_else(missing)?;
    let (kind, format) = match format {
        "svg" => ("image/svg+xml", FigureFormat::Svg),
        #[cfg(feature = "png")]
        "png" => ("image/png", FigureFormat::Png),
        "csv" => ("text/csv; charset=utf-8", FigureFormat::Csv),
        _ => return Err(missing().into()),
    };
    let draw = move |_: &OnPool| -> Result<Vec<u8>, Error> {
        match format {
            FigureFormat::Svg => Ok(figure.svg().into_bytes()),
            FigureFormat::Csv => Ok(figure.csv().into_bytes()),
            #[cfg(feature = "png")]
            FigureFormat::Png => figure.png().map_err(|e| Error::Internal(e.to_string())),
        }
    };
    let bytes = app.compute(draw).await??;
    Ok(attachment(kind, &file, bytes))
}

/// File format.
#[derive(Debug, Clone, Copy)]
enum FigureFormat {
    Svg,
    #[cfg(feature = "png")]
    Png,
    Csv,
}
