//! REST: local optima that the cold start of a trial reached.

use crate::AppState;
use crate::authorization::Authorized;
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::resources::local_optima::LocalOptimum;
use crate::visible::Visible;
use axum::Json;
use axum::extract::State;
use gaitwright_service::access::Read;
use gaitwright_service::studies::local_optima;
use gaitwright_store::TrialId;

/// List local optima of a trial
///
/// The gaits to which the initial guesses of the cold start of the trial led; one of them is the result of the trial. Sorted
/// by number. Each is a candidate for the root gait of a study: `solve_options.local_optimum_choice` can name its number.
/// Empty after a warm start, without a gait, and in imported studies.
#[utoipa::path(
    get,
    path = "/trials/{id}/local-optima",
    operation_id = "list_local_optima",
    tag = "trials",
    params(("id" = TrialId, Path, description = "Identifier of the trial")),
    responses((status = 200, description = "Local optima", body = Page<LocalOptimum>), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_trial(
    _: Authorized<Read>,
    State(mut app): State<AppState>,
    Visible(id, _): Visible<TrialId, Read>,
    paging: Paging<u32>,
) -> Result<Json<Page<LocalOptimum>>, Refusal> {
    let found = local_optima::of_trial(&mut *app.read().await?, id).await?;
    let found = app.compute(move |pool| local_optima::unpacked(pool, found)).await??;
    Ok(Json(paging.cut(found, |one| one.number)?.map(LocalOptimum::from)))
}
