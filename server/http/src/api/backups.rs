//! REST: backups of the record.

use super::jobs::Job;
use crate::AppState;
use crate::accessible::Id;
use crate::idempotent::Idempotent;
use crate::problem_details::Refusal;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::Administer;
use gaitwright_service::backups::{self, Backup};
use gaitwright_service::error::Error;
use gaitwright_service::job::JobId;
use gaitwright_service::studies::job_status;
use gaitwright_store::BackupId;

/// Request a backup
///
/// Writes a backup next to the database and verifies it. The backup is completed even if the caller disconnects.
#[utoipa::path(
    post,
    path = "/backups",
    operation_id = "request_backup",
    tag = "operation",
    responses((status = 202, description = "Job that makes the backup, which takes seconds to minutes", body = Job)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn create(State(app): State<AppState>, request: Idempotent<Administer>) -> Result<Response, Refusal> {
    // A separate task, so that a request whose caller disconnects cannot end between its commit and the backup.
    let accepted = tokio::spawn(async move {
        let mut writer = match request.begin(&app).await? {
            Ok(writer) => writer,
            Err(before) => return Ok(before),
        };
        let requested = app.backups.request(app.store(), &mut writer, &request.actor).await?;
        let id = JobId::Backup(requested.id);
        let job = Job::from(job_status::find(&mut writer, app.runners(), id).await?);
        let answer = request.accepted(&app, writer, Job::address(id), &job).await?;
        requested.begin(app.store().clone(), request.actor);
        Ok(answer)
    });
    accepted.await.map_err(|error| Error::Internal(error.to_string()))?
}

/// Get a backup
///
/// File name, size and time of the backup, without its contents.
#[utoipa::path(
    get,
    path = "/backups/{id}",
    operation_id = "get_backup",
    tag = "operation",
    params(("id" = BackupId, Path, description = "Identifier of the backup")),
    responses((status = 200, description = "Complete, verified backup", body = Backup)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn get(
    State(app): State<AppState>,
    Id(id, _): Id<BackupId, Administer>,
) -> Result<Json<Backup>, Refusal> {
    Ok(Json(backups::get(&mut *app.read().await?, id).await?))
}
