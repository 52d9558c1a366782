//! The buttons that cancel jobs.

use crate::AppState;
use crate::authorization::Authorized;
use crate::page_error::PageError;
use crate::visible::Visible;
use axum::extract::State;
use axum::response::Redirect;
use gaitwright_service::access::Run;
use gaitwright_service::job::JobId;
use gaitwright_service::studies::job_cancellation;
use gaitwright_store::commit;

/// `POST /jobs/{id}/cancel`.
pub(super) async fn cancel(
    authorized: Authorized<Run>,
    State(app): State<AppState>,
    Visible(id, _): Visible<JobId, Run>,
) -> Result<Redirect, PageError> {
    let mut writer = app.write().await?;
    job_cancellation::cancel(&mut writer, &authorized.caller, app.runners(), id).await?;
    commit(writer).await?;
    job_cancellation::stop(app.runners(), id).await;
    Ok(Redirect::to(&page_of(id)))
}

/// The page that shows what became of a job.
fn page_of(id: JobId) -> String {
    match id {
        JobId::Backup(_) => "/system".to_owned(),
        JobId::Certificate(trial) => format!("/trials/{trial}#certificate"),
        JobId::ExecutionReport(trial) => format!("/trials/{trial}#simulated-walks"),
        JobId::Explanation(trial) => format!("/trials/{trial}#explanation"),
        JobId::Solve(trial) => format!("/trials/{trial}"),
    }
}
