//! Archives of studies, for tests that move a study to another record.

use gaitwright_service::error::Error;
use gaitwright_service::studies::archive::{self, PublicKey};
use gaitwright_store::audit::Actor;
use gaitwright_store::{Store, StudyId};
use std::io::Cursor;

/// The archive of a study, not signed.
pub async fn exported(store: &Store, study: StudyId) -> Vec<u8> {
    archive::export(store.path(), study, Vec::new(), None).await.unwrap()
}

/// Imports an archive, whoever signed it.
///
/// # Errors
/// Why it was refused.
pub async fn import(store: &Store, file: &[u8]) -> Result<StudyId, Error> {
    import_trusting(store, file, &[]).await
}

/// Imports an archive that one of these keys signed.
///
/// # Errors
/// Why it was refused.
pub async fn import_trusting(store: &Store, file: &[u8], keys: &[PublicKey]) -> Result<StudyId, Error> {
    let opened = archive::open(Cursor::new(file.to_vec()), keys).await?;
    archive::import(store, &Actor::terminal(), opened).await
}
