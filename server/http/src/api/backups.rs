//! REST: backups of the record.

use crate::AppState;
use crate::idempotent::Idempotent;
use crate::problem::Refusal;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::Administer;
use gaitwright_service::error::Error;
use gaitwright_store::audit::Actor;
use gaitwright_store::{Writer, audit, backup, commit};
use serde::Serialize;
use serde_json::json;
use utoipa::ToSchema;

/// Backup of the record.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Copy {
    /// File name, in the folder of the database.
    pub(crate) file: String,
    /// Size in bytes.
    bytes: u64,
}

impl Copy {
    /// Writes a backup next to the database, and checks it.
    async fn make(app: &AppState) -> Result<Self, Refusal> {
        let (file, bytes) = backup::beside_record(app.store()).await?;
        Ok(Self { file: file.file_name().unwrap_or_default().to_string_lossy().into_owned(), bytes })
    }

    /// Records the backup in the audit trail.
    async fn record(&self, writer: &mut Writer, actor: &Actor) -> Result<(), Refusal> {
        let detail = json!({ "bytes": self.bytes });
        audit::append(writer, actor, "record.backup", &format!("file {}", self.file), &detail).await?;
        Ok(())
    }

    /// Makes a backup for a page.
    pub(crate) async fn for_page(app: AppState, actor: Actor) -> Result<Self, Refusal> {
        to_its_end(async move {
            let copy = Self::make(&app).await?;
            let recorded = async {
                let mut writer = app.write().await?;
                copy.record(&mut writer, &actor).await?;
                Ok(commit(writer).await?)
            };
            let recorded = recorded.await;
            copy.unless_refused(&app, recorded).map(|()| copy)
        })
        .await
    }

    /// Deletes the backup if it could not be recorded.
    fn unless_refused<T>(&self, app: &AppState, recorded: Result<T, Refusal>) -> Result<T, Refusal> {
        if recorded.is_err()
            && let Err(error) = std::fs::remove_file(app.store().path().with_file_name(&self.file))
        {
            tracing::warn!(file = self.file, %error, "cannot delete a backup that was not recorded");
        }
        recorded
    }
}

/// Runs work to its end, even if the client goes away or the request times out.
async fn to_its_end<T: Send + 'static>(
    work: impl Future<Output = Result<T, Refusal>> + Send + 'static,
) -> Result<T, Refusal> {
    tokio::spawn(work).await.map_err(|error| Error::Internal(error.to_string()))?
}

/// Back up the record
///
/// Writes a backup next to the database and checks it.
#[utoipa::path(
    post,
    path = "/backups",
    operation_id = "create_backup",
    tag = "operation",
    responses((status = 200, description = "Checked backup", body = Copy)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn create(State(app): State<AppState>, request: Idempotent<Administer>) -> Result<Response, Refusal> {
    to_its_end(async move {
        if let Some(before) = request.answered_before(&app).await? {
            return Ok(before);
        }
        let copy = Copy::make(&app).await?;
        let recorded = async {
            let mut writer = match request.begin(&app).await? {
                Ok(writer) => writer,
                Err(before) => return Ok(before),
            };
            copy.record(&mut writer, &request.actor).await?;
            request.done(&app, writer, &copy).await
        };
        let recorded = recorded.await;
        copy.unless_refused(&app, recorded)
    })
    .await
}
