//! REST: exports a study as an archive, and lists its imports.

use crate::AppState;
use crate::accessible::Id;
use crate::attachment::attachment;
use crate::authorization::Authorized;
use crate::openapi_binary::Binary;
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::resources::imports::Import;
use crate::visible::Visible;
use axum::Json;
use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::response::Response;
use futures_util::{StreamExt, stream};
use gaitwright_service::access::{Administer, Read};
use gaitwright_service::error::Error;
use gaitwright_service::studies::archive;
use gaitwright_store::{StudyId, audit, commit, consents, imports, studies};
use serde_json::json;
use std::io::Write;
use tokio::sync::mpsc::{self, Sender};
use tokio_stream::wrappers::ReceiverStream;

/// Size of the chunks of a response.
const CHUNK_BYTES: usize = 1 << 16;

/// Download a study as an archive
///
/// The archive has every row of the study except concealed allocations, as `gaitwright export` writes it.
#[utoipa::path(
    get,
    path = "/studies/{id}/archive",
    operation_id = "get_study_archive",
    tag = "studies",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    responses((status = 200, description = "Unsigned archive for `gaitwright import`", body = Binary, content_type = "application/octet-stream"), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn of_study(
    authorized: Authorized<Administer>,
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Administer>,
) -> Result<Response, Refusal> {
    // The export is recorded before the first byte is sent.
    let mut writer = app.write().await?;
    let study = studies::get(&mut writer, id).await?;
    consents::may_be_shown(&mut writer, id).await?;
    let detail = json!({ "name": study.plan.name });
    audit::append(&mut writer, &authorized.caller.actor, "study.export", &format!("study {id}"), &detail).await?;
    commit(writer).await?;

    let (sender, mut chunks) = mpsc::channel(4);
    let database = app.store().path().to_owned();
    let out = Chunks { sender, buffer: Vec::with_capacity(CHUNK_BYTES) };
    let export = tokio::spawn(async move { archive::export(&database, id, out, None).await.map(drop) });
    let Some(first) = chunks.recv().await else {
        export.await.map_err(|e| Error::Internal(e.to_string()))??;
        return Err(Error::Internal("the archive is empty".to_owned()).into());
    };
    // If the export fails, the connection is aborted, so that the client notices the incomplete archive.
    let failure = stream::once(export).filter_map(async |done| match done {
        Ok(Ok(())) => None,
        Ok(Err(error)) => Some(Err(std::io::Error::other(error.to_string()))),
        Err(error) => Some(Err(std::io::Error::other(error))),
    });
    let whole = stream::iter([Ok(first)]).chain(ReceiverStream::new(chunks).map(Ok)).chain(failure);
    Ok(attachment("application/octet-stream", &format!("study-{}.gait", id.short()), Body::from_stream(whole)))
}

/// A writer that sends chunks. Data that is not flushed is dropped.
struct Chunks {
    sender: Sender<Bytes>,
    buffer: Vec<u8>,
}

impl Chunks {
    fn send(&mut self) -> std::io::Result<()> {
        let chunk = std::mem::replace(&mut self.buffer, Vec::with_capacity(CHUNK_BYTES));
        self.sender.blocking_send(chunk.into()).map_err(|_| std::io::ErrorKind::BrokenPipe.into())
    }
}

impl Write for Chunks {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.buffer.extend_from_slice(bytes);
        if self.buffer.len() >= CHUNK_BYTES {
            self.send()?;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        if self.buffer.is_empty() { Ok(()) } else { self.send() }
    }
}

/// List the imports of a study
///
/// One entry for each time the study was imported into a record, oldest first. Empty if the study was created in this
/// record.
#[utoipa::path(
    get,
    path = "/studies/{id}/imports",
    operation_id = "list_study_imports",
    tag = "studies",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    responses((status = 200, description = "Imports, ending with the one into this record", body = Page<Import>), (status = 409, description = "The subject withdrew consent")),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn imports_of_study(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Visible(id, _): Visible<StudyId, Read>,
    paging: Paging<i64>,
) -> Result<Json<Page<Import>>, Refusal> {
    let mut reader = app.read().await?;
    studies::get(&mut reader, id).await?;
    Ok(Json(paging.cut(imports::of_study(&mut reader, id).await?, |import| import.seq)?.map(Import::from)))
}
