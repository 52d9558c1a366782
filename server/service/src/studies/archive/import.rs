//! Imports an archive into the record.

use super::super::{built_in_entries, study_name};
use super::archive_file::{ArchiveFacts, Next, Unpacker, refuse};
use super::check;
use super::signature::PublicKey;
use crate::access::Reach;
use crate::error::Error;
use gaitwright_compute::Pool;
use gaitwright_store::archived_row::{Cell, Row};
use gaitwright_store::archived_rows::{self, RowMatch, Unpacking};
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::imports::{self, NewImport};
use gaitwright_store::quarantine::Quarantine;
use gaitwright_store::{Store, StoreError, StudyId, Writer, commit, events, studies, subjects};
use serde_json::json;
use std::io::Read;
use tokio::sync::mpsc;

/// Rows that were read and not yet written: few, because a row may be large.
const ROWS_AHEAD: usize = 2;

/// An unpacked and checked archive, ready to be imported.
#[derive(Debug)]
pub struct Archive {
    quarantine: Quarantine,
    study: StudyId,
    origin: NewImport,
}

/// Unpacks and checks an archive. If `trusted` is not empty, one of its keys must have signed the archive.
///
/// # Errors
/// [`Error::Malformed`] naming the row and its fault.
pub async fn open<R: Read + Send + 'static>(from: R, trusted: &[PublicKey]) -> Result<Archive, Error> {
    let (sender, mut rows) = mpsc::channel::<(&'static str, Row)>(ROWS_AHEAD);
    #[allow(
        clippy::disallowed_methods,
        reason = "runs while rows are still arriving; the pool takes only complete data"
    )]
    let reading = tokio::task::spawn_blocking(move || -> Result<Option<ArchiveFacts>, Error> {
        let mut unpacker = Unpacker::new(from)?;
        loop {
            match unpacker.next()? {
                Next::End(whole) => return Ok(Some(whole)),
                Next::Row(table, row) => {
                    check::cells(table, &row)?;
                    if sender.blocking_send((table, row)).is_err() {
                        return Ok(None);
                    }
                }
            }
        }
    });
    let mut quarantine = Quarantine::new().await?;
    let mut number = 0_u64;
    let mut refused = None;
    while let Some((table, row)) = rows.recv().await {
        number += 1;
        let id = row.text("id").or_else(|| row.text("trial_id")).unwrap_or_default();
        let space = if id.is_empty() { "" } else { " " };
        let named = format!("row {number} (table {table}{space}{id:.36})");
        if let Err(error) = quarantine.add(table, row).await {
            refused = Some(refuse(format!("{named}: {}", error.finding())));
            break;
        }
    }
    drop(rows);
    let whole = reading.await.map_err(|e| Error::Internal(e.to_string()))?;
    if let Some(refused) = refused {
        return Err(refused);
    }
    let whole = whole?.ok_or_else(|| refuse("it is truncated"))?;
    let trusted_key = whole.signed_by.as_ref().is_some_and(|key| trusted.contains(key));
    if !trusted.is_empty() && !trusted_key {
        let how = whole.signed_by.as_ref().map_or_else(
            || "it is not signed, and only archives that are signed with a trusted key are accepted here".to_owned(),
            |key| format!("it is signed by {key}, which is not a trusted key"),
        );
        return Err(refuse(how));
    }
    quarantine.settle().await.map_err(|error| refuse(error.finding()))?;
    let checked = check::study(&mut quarantine, &Pool::default()).await?;
    let origin = NewImport {
        file_sha256: whole.file_sha256,
        signed_by: whole.signed_by.map(|key| key.to_string()),
        trusted: trusted_key,
        unchecked_rmse: checked.unchecked_rmse,
    };
    Ok(Archive { quarantine, study: checked.study, origin })
}

/// Writes the study of an archive and its origin into a record. If a study here has its name, a number is added.
///
/// # Errors
/// [`Error::Conflict`] if the record has the study already, or contradicts it. Nothing is changed then.
pub async fn import(store: &Store, actor: &Actor, archive: Archive) -> Result<StudyId, Error> {
    let Archive { mut quarantine, study, origin } = archive;
    let mut writer = store.write().await?;
    match studies::get(&mut writer, study).await {
        Ok(_) => return Err(Error::conflict(format!("Study {study} is already in this record."))),
        Err(StoreError::Missing { .. }) => {}
        Err(other) => return Err(other.into()),
    }
    copy(&mut quarantine, study, &mut writer, origin.trusted).await?;
    let present = studies::get(&mut writer, study).await?;
    imports::insert(&mut writer, study, actor, &origin).await?;
    let payload = json!({ "state": present.state, "reason": "imported" });
    events::append(&mut writer, study, "study_changed", &payload).await?;
    let detail = json!({
        "name": present.plan.name,
        "file_sha256": origin.file_sha256,
        "signed_by": origin.signed_by,
        "trusted": origin.trusted,
        "unchecked_rmse": origin.unchecked_rmse,
    });
    audit::append(&mut writer, actor, "study.import", &format!("study {study}"), &detail).await?;
    commit(writer).await?;
    Ok(study)
}

/// Copies every row into a transaction.
async fn copy(quarantine: &mut Quarantine, study: StudyId, writer: &mut Writer, trusted: bool) -> Result<(), Error> {
    let cloned_from = quarantine.cloned_from().map(str::to_owned);
    let (sender, mut rows) = mpsc::channel::<archived_rows::Read>(ROWS_AHEAD);
    let reading = async {
        let done = archived_rows::read(quarantine.db(), study, &sender).await;
        drop(sender);
        done
    };
    let writing = async move {
        let mut unpacking = Unpacking::default();
        while let Some(archived_rows::Read { table, mut row, .. }) = rows.recv().await {
            if table == "studies" {
                row.set("cloned_from", cloned_from.clone().map_or(Cell::Null, Cell::Text));
                let name = row.text("name").unwrap_or_default().to_owned();
                row.set("name", Cell::Text(study_name::free(writer, Reach::Every, &name).await?));
            }
            if table == "imports" && !trusted {
                // No signature vouches for the earlier signatures that the archive lists.
                row.set("signed_by", Cell::Null);
                row.set("trusted", Cell::Integer(0));
            }
            if matches!(table, "subjects" | "devices" | "reference_gaits")
                && !is_new(writer, table, &row, &mut unpacking).await?
            {
                continue;
            }
            unpacking.adapt_and_write(writer, table, row).await.map_err(does_not_fit)?;
        }
        Ok::<_, Error>(())
    };
    let (read, written) = tokio::join!(reading, writing);
    written?;
    Ok(read?)
}

fn does_not_fit(reason: impl std::fmt::Display) -> Error {
    Error::conflict(format!("The archive contradicts this record, so nothing was changed: {reason}."))
}

/// Whether a subject, device or reference gait must be written. An identical row may exist already. A different row
/// with the same identifier or name is a contradiction that a person must resolve. Built-in subjects have another
/// identifier in each record, and nothing of a person, so they are the same.
async fn is_new(writer: &mut Writer, table: &str, row: &Row, unpacking: &mut Unpacking) -> Result<bool, Error> {
    let id = row.text("id").unwrap_or_default().to_owned();
    let what = match table {
        "subjects" => "subject",
        "devices" => "device",
        _ => "reference gait",
    };
    match archived_rows::known(writer, table, row).await? {
        RowMatch::New => Ok(true),
        RowMatch::Same(here) => {
            unpacking.same.insert(id, here);
            Ok(false)
        }
        RowMatch::Differs(columns) => {
            let differing: Vec<String> = columns.iter().map(|column| format!("{column} differs")).collect();
            Err(does_not_fit(format!("{what} {id} exists here with different content ({})", differing.join(", "))))
        }
        RowMatch::NameTaken(name) => {
            if table == "subjects"
                && is_built_in(row)
                && let Some(here) = subjects::by_pseudonym(writer, &name).await?
            {
                unpacking.same.insert(id, here.id.to_string());
                return Ok(false);
            }
            Err(does_not_fit(format!(
                "another {what} here has the name {name:?}. Import the archive into a record without it"
            )))
        }
    }
}

/// Whether the row of a subject is that of a built-in one.
fn is_built_in(row: &Row) -> bool {
    let number = |column| row.real(column).unwrap_or(f64::NAN);
    let body = gait_optimizer::Subject { height_m: number("height_m"), body_mass_kg: number("body_mass_kg") };
    let [pseudonym, notes] = ["pseudonym", "notes"].map(|column| row.text(column).unwrap_or_default());
    built_in_entries::is_built_in(pseudonym, body, notes)
}
