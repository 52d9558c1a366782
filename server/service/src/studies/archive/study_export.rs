//! Exports a study as an archive.

use super::archive_file::Packer;
use super::signature::SigningKey;
use crate::error::Error;
use gaitwright_store::archived_rows::{self, Read};
use gaitwright_store::{StoreError, StudyId, read_only};
use std::io::Write;
use std::path::Path;
use tokio::sync::mpsc;

/// Length of the queue between reading and writing. Short, because rows can be large.
const ROWS_AHEAD: usize = 2;

/// Writes a study of the record into an archive. Reads one consistent state on its own connection, while another thread
/// hashes and compresses the rows.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Conflict`] if the subject withdrew consent or a row was changed outside the program;
/// errors of the database or the writer. The partial archive then has no end line, so every import refuses it.
pub async fn export<W: Write + Send + 'static>(
    database: &Path,
    study: StudyId,
    out: W,
    key: Option<SigningKey>,
) -> Result<W, Error> {
    let pool = read_only::open(database).await?;
    let (sender, mut rows) = mpsc::channel::<Option<Read>>(ROWS_AHEAD);
    #[allow(
        clippy::disallowed_methods,
        reason = "runs while rows are still arriving; the pool takes only complete data"
    )]
    let packing = tokio::task::spawn_blocking(move || {
        let mut packer = Packer::new(out).map_err(Error::Output)?;
        while let Some(next) = rows.blocking_recv() {
            let Some(Read { table, row, sealed, seal }) = next else {
                return packer.finish(key.as_ref()).map(Some).map_err(Error::Output);
            };
            if sealed && seal.as_ref() != Some(&row.sha256()) {
                let reason =
                    format!("a row of {table} was changed outside the program. Run `gaitwright audit verify`.");
                return Err(Error::conflict(format!("The study cannot be exported: {reason}")));
            }
            packer.add(table, &row).map_err(Error::Output)?;
        }
        Ok(None)
    });
    let read = async {
        let mut reader = pool.acquire().await.map_err(StoreError::from)?;
        let (forward, read) = mpsc::channel(1);
        let reading = async {
            let done = archived_rows::read(&mut reader, study, &forward).await;
            drop(forward);
            done
        };
        let handing = async {
            // Owned by this task, so that reading ends when the writer ends.
            let mut read = read;
            while let Some(row) = read.recv().await {
                if sender.send(Some(row)).await.is_err() {
                    return;
                }
            }
        };
        let (done, ()) = tokio::join!(reading, handing);
        done?;
        // An archive gets its end line only if the whole study was read.
        let _ = sender.send(None).await;
        Ok::<_, StoreError>(())
    }
    .await;
    drop(sender);
    pool.close().await;
    let packed = packing.await.map_err(|e| Error::Internal(e.to_string()))?;
    read?;
    packed?.ok_or_else(|| Error::Internal("the end line of the archive is missing".to_owned()))
}
