//! REST: ask and tell, for lab scripts that evaluate trials.

use crate::AppState;
use crate::accessible::Id;
use crate::idempotent::{IdempotentWith, StoredBody};
use crate::problem_details::Refusal;
use crate::resources::trials::Trial;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::Run;
use gaitwright_service::error::Error;
use gaitwright_service::studies::lab_script::{self, AskRequest, SuggestedTrial, TellRequest};
use gaitwright_service::studies::snapshot::{MAX_TRIES, has_changed};
use gaitwright_store::{StudyId, TrialId};
use serde::Deserialize;
use std::sync::Arc;

/// Ask for a trial to evaluate
///
/// Returns the same trial until its result is reported.
#[utoipa::path(
    post,
    path = "/studies/{id}/ask",
    operation_id = "ask_for_trial",
    tag = "scripts",
    params(("id" = StudyId, Path, description = "Identifier of a study with `evaluation` = `script`")),
    request_body(content = AskRequest, description = "Optional: the name of the script"),
    responses((status = 200, description = "Trial that the script was already asked to evaluate", body = Trial), (status = 201, description = "New trial to evaluate", body = Trial)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn ask(
    State(mut app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    IdempotentWith(request, ask): IdempotentWith<Run, AskRequest>,
) -> Result<Response, Refusal> {
    let script = ask.script.as_deref().unwrap_or(&request.caller.name).trim();
    for _ in 0..MAX_TRIES {
        let analyses = Arc::clone(&app.analyses);
        let suggestion = lab_script::suggest(app.store_mut(), id, script, &analyses).await;
        let mut writer = match request.begin(&app).await? {
            Ok(writer) => writer,
            Err(before) => return repeat_ask(&app, before).await,
        };
        let suggestion = suggestion?;
        if let Some(trial) = lab_script::assign(&mut writer, &request.caller, script, &suggestion).await? {
            let location = format!("/api/v1/trials/{}", trial.id);
            let trial = Trial::from(trial);
            return match suggestion {
                SuggestedTrial::New(..) => request.created(&app, writer, location, &trial).await,
                SuggestedTrial::Same(_) => request.done(&app, writer, &trial).await,
            };
        }
    }
    Err(has_changed().into())
}

/// Gives out a trial again, unless its bounds were reported as unsafe in the meantime.
async fn repeat_ask(app: &AppState, before: Response) -> Result<Response, Refusal> {
    #[derive(Deserialize)]
    struct GivenOut {
        id: TrialId,
    }
    let StoredBody(body) = before.extensions().get().ok_or_else(|| Error::Internal("nothing was stored".to_owned()))?;
    let GivenOut { id } = serde_json::from_str(body).map_err(|e| Error::Internal(e.to_string()))?;
    lab_script::not_reported(&mut *app.read().await?, id).await?;
    Ok(before)
}

/// Tell the service the result of a trial
///
/// `not_converged` is also a result. If the script fails, cancel the trial instead.
#[utoipa::path(
    post,
    path = "/trials/{id}/tell",
    operation_id = "tell_result",
    tag = "scripts",
    params(("id" = TrialId, Path, description = "Identifier of the trial")),
    request_body = TellRequest,
    responses((status = 200, description = "Trial with its result", body = Trial)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn tell(
    State(mut app): State<AppState>,
    Id(id, _): Id<TrialId, Run>,
    IdempotentWith(request, tell): IdempotentWith<Run, TellRequest>,
) -> Result<Response, Refusal> {
    for _ in 0..MAX_TRIES {
        let checked = lab_script::check_result(app.store_mut(), id, &tell).await;
        let mut writer = match request.begin(&app).await? {
            Ok(writer) => writer,
            Err(before) => return Ok(before),
        };
        if let Some(trial) = lab_script::record(&mut writer, &request.caller, id, &checked?).await? {
            return request.done(&app, writer, &Trial::from(trial)).await;
        }
    }
    Err(has_changed().into())
}
