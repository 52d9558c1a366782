//! The errors of the record.

use std::path::PathBuf;
use thiserror::Error;

/// The result of a store function.
pub type StoreResult<T> = Result<T, StoreError>;

/// An error of the record.
#[derive(Debug, Error)]
pub enum StoreError {
    /// The file cannot be opened or created.
    #[error(
        "Cannot open or write {}: {source}. The file and its folder must be writable; the folder of a database also holds its \
         -wal, -shm and .lock files.",
        path.display()
    )]
    Open {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// The path does not end with the name of a file.
    #[error("The path of the database must name a file, but is \"{}\".", path.display())]
    NoFileName {
        /// The path.
        path: PathBuf,
    },
    /// The file is not a database of this program.
    #[error("{} is not a Gaitwright database: {reason}.", path.display())]
    NotADatabase {
        /// The file.
        path: PathBuf,
        /// How this was detected.
        reason: String,
    },
    /// Another process owns the file.
    #[error("The database {} is in use by another Gaitwright process. Stop that process or choose another file.", path.display())]
    InUse {
        /// The file.
        path: PathBuf,
    },
    /// The file has hard links: another process may own it under another name.
    #[error(
        "The database {} has other hard links, which could lead to a mismatched write-ahead log. Remove the \
         other links; to copy the database, use `gaitwright backup`.",
        path.display()
    )]
    SeveralNames {
        /// The file.
        path: PathBuf,
    },
    /// A newer version of the program wrote the file.
    #[error(
        "The database {} has schema version {found}, but this program supports versions up to {known}. Nothing was changed. Use \
         a newer version of Gaitwright.",
        path.display()
    )]
    NewerSchema {
        /// The file.
        path: PathBuf,
        /// Its schema version.
        found: i64,
        /// The newest version that this program supports.
        known: i64,
    },
    /// A development version, with another migration of this number, wrote the file.
    #[error(
        "The database {} is from a development version of Gaitwright: its migration {version} differs from that of this version, \
         so its tables cannot be read. Nothing was changed. Open it with the version that wrote it, or start an empty record \
         in another file.",
        path.display()
    )]
    DevelopmentSchema {
        /// The file.
        path: PathBuf,
        /// The first migration that differs.
        version: i64,
    },
    /// The database file is missing, but its anchor or log is there.
    #[error(
        "There is no record at {}, but {} shows that there was one. Restore a backup with `gaitwright restore`. To start an empty \
         record, remove that file.",
        path.display(), evidence.display()
    )]
    RecordMissing {
        /// The expected path of the database.
        path: PathBuf,
        /// The anchor or the log.
        evidence: PathBuf,
    },
    /// The database file or its log was deleted, replaced or truncated while the record was open.
    #[error(
        "The record {} accepts no changes. While it was open, {what}. Changes that were already acknowledged may be lost \
         when the process ends. Stop the service, then run `gaitwright audit verify`.",
        path.display()
    )]
    RecordVanished {
        /// The database file.
        path: PathBuf,
        /// Which file was changed, and how.
        what: String,
    },
    /// The newest rows are missing: the record was truncated, or is an older copy.
    #[error(
        "The record {} ends with row {found} of {table}, but its anchor {} lists row {seen}, so acknowledged changes are missing. \
         Nothing was changed. Put the missing log or a newer copy in place. If this record \
         is the right one, restore a copy of it (`gaitwright restore COPY`); to verify it without a second anchor, give an empty name (`--anchor ''`).",
        record.display(), anchor.display()
    )]
    CutOff {
        /// The database file.
        record: PathBuf,
        /// The anchor.
        anchor: PathBuf,
        /// `audit` or `seals`.
        table: &'static str,
        /// The last row of the table.
        found: i64,
        /// The last row that the anchor lists.
        seen: i64,
    },
    /// A row differs from the one that the anchor lists.
    #[error(
        "Row {seq} of {table} in the record {} differs from the one that its anchor {} lists: its history was rewritten, or this \
         is another record. Nothing was changed. If this record is the right one, restore a copy of it (`gaitwright restore COPY`); \
         to verify it without a second anchor, give an empty name (`--anchor ''`).",
        record.display(), anchor.display()
    )]
    Rewritten {
        /// The database file.
        record: PathBuf,
        /// The anchor.
        anchor: PathBuf,
        /// `audit` or `seals`.
        table: &'static str,
        /// The row.
        seq: i64,
    },
    /// A row was not written by this program.
    #[error(
        "Row {key} of {table} has no seal, so this program did not write it. Nothing was changed. Run `gaitwright audit verify`, \
         then restore a backup with `gaitwright restore`."
    )]
    Unsealed {
        /// The table.
        table: String,
        /// The primary key of the row.
        key: String,
    },
    /// A second anchor is another file.
    #[error("The anchor {} is {what}; it must be a new file, or an anchor of this record.", path.display())]
    WrongAnchor {
        /// The path of the anchor.
        path: PathBuf,
        /// Which file it is.
        what: &'static str,
    },
    /// The folder of a second anchor does not exist.
    #[error(
        "There is no folder {} for the anchor {}. Create the folder, or choose another file.",
        folder.display(), anchor.display()
    )]
    NoAnchorFolder {
        /// The folder.
        folder: PathBuf,
        /// The path of the anchor.
        anchor: PathBuf,
    },
    /// A folder has the scheduled backups of another record.
    #[error(
        "The backup folder {} belongs to the record {record}; each record must have a folder of its own. If this record \
         used to be at that path, delete {}.",
        folder.display(), claim.display()
    )]
    FolderOfOther {
        /// The folder.
        folder: PathBuf,
        /// The path of the other record.
        record: String,
        /// The file that names the other record.
        claim: PathBuf,
    },
    /// A record or a backup is damaged, so it was not copied.
    #[error(
        "{} failed verification, so it was not copied and nothing was changed. {reason} Use a record or a backup that \
         `gaitwright audit verify` finds intact.",
        path.display()
    )]
    Unverified {
        /// The record or the backup.
        path: PathBuf,
        /// The finding.
        reason: String,
    },
    /// A restore was killed before it was complete.
    #[error(
        "A restore of {} was interrupted. Start the service or run `gaitwright restore` again; either finishes or undoes the \
         restore.",
        path.display()
    )]
    RestoreInterrupted {
        /// The record.
        path: PathBuf,
    },
    /// The disk of a copy is full.
    #[error("There is no space left on the disk for {}, so the copy was not written. Free some space there or choose another folder.", path.display())]
    CopyFull {
        /// The copy.
        path: PathBuf,
    },
    /// A migration failed.
    #[error("Cannot migrate the database: {0}.")]
    Migrate(#[from] sqlx::migrate::MigrateError),
    /// A row that must exist does not.
    #[error("There is no {what} {id}.")]
    Missing {
        /// The kind of row.
        what: &'static str,
        /// Its identifier.
        id: String,
    },
    /// A stored value cannot be read: the file was damaged or edited.
    #[error("The record is damaged ({what}): {reason}.")]
    Damaged {
        /// The damaged value.
        what: &'static str,
        /// The kind of damage.
        reason: String,
    },
    /// The operating system cannot provide random numbers.
    #[error("The operating system cannot provide random numbers: {0}.")]
    NoRandomNumbers(String),
    /// The subject withdrew consent.
    #[error("The subject withdrew consent. The record is kept, but nothing can be added, shown or exported.")]
    Withdrawn,
    /// The record was closed.
    #[error("The database is closed because the service is shutting down.")]
    Closed,
    /// A change could not be written to the disk, and was rolled back.
    #[error("The change could not be written to the disk: {}.", .0.trim_end_matches('.'))]
    NotDurable(String),
    /// The free space has shrunk to the reserve, so nothing large is started.
    #[error(
        "The disk is nearly full: {free_mb} MB is free, and {reserve_mb} MB is kept in reserve. Free some space and try again."
    )]
    NearlyFull {
        /// Free space, MB.
        free_mb: u64,
        /// Reserve, MB.
        reserve_mb: u64,
    },
    /// A stored text is none of the known values of its column.
    #[error(
        "The record is damaged ({what}): unknown value {text:?}. Run `gaitwright audit verify`, then restore a backup with \
         `gaitwright restore`."
    )]
    UnknownValue {
        /// Name of the value.
        what: &'static str,
        /// The text.
        text: String,
    },
    /// Any other error of the database.
    #[error("The database failed: {0}.")]
    Database(#[from] sqlx::Error),
}

impl StoreError {
    /// A stored text that is none of the known values of its column.
    pub(super) fn unknown_value(what: &'static str, text: &str) -> Self {
        Self::UnknownValue { what, text: text.to_owned() }
    }

    /// The finding, for data that are not those of the record: without the advice for a damaged record.
    pub fn finding(&self) -> String {
        match self {
            Self::Damaged { what, reason } => format!("{what}: {reason}"),
            Self::UnknownValue { what, text } => format!("{what}: unknown value {text:?}"),
            Self::Unsealed { table, key } => {
                format!("row {key} of {table} has no seal, so this program did not write it")
            }
            Self::Database(error) => format!("the database refused it: {error}"),
            other => other.to_string().trim_end_matches('.').to_owned(),
        }
    }

    /// Whether the change was refused, here or by a trigger, because the subject withdrew consent.
    pub fn is_withdrawal(&self) -> bool {
        match self {
            Self::Withdrawn => true,
            Self::Database(sqlx::Error::Database(found)) => found.message() == "the subject withdrew consent",
            _ => false,
        }
    }

    /// Whether the disk has no room for a change.
    pub fn is_full(&self) -> bool {
        let says_so = |text: &str| text.contains("database or disk is full");
        match self {
            Self::NearlyFull { .. } | Self::CopyFull { .. } => true,
            Self::NotDurable(reason) => says_so(reason),
            Self::Database(sqlx::Error::Database(found)) => says_so(found.message()),
            _ => false,
        }
    }

    /// Whether the machine currently prevents changes of the record.
    pub fn is_unwritable(&self) -> bool {
        let says_so = |text: &str| ["disk I/O error", "readonly database"].iter().any(|words| text.contains(words));
        match self {
            Self::NotDurable(_) | Self::Closed => true,
            Self::Database(sqlx::Error::Database(found)) => says_so(found.message()),
            _ => false,
        }
    }

    /// The same error for every change of one group commit.
    pub(super) fn for_all(&self) -> Self {
        match self {
            Self::RecordVanished { path, what } => Self::RecordVanished { path: path.clone(), what: what.clone() },
            Self::NotDurable(reason) => Self::NotDurable(reason.clone()),
            other => Self::NotDurable(other.to_string()),
        }
    }

    /// Whether the caller named a file that is not a usable record.
    pub fn is_wrong_file(&self) -> bool {
        matches!(
            self,
            Self::Open { .. }
                | Self::NoFileName { .. }
                | Self::NotADatabase { .. }
                | Self::NewerSchema { .. }
                | Self::DevelopmentSchema { .. }
                | Self::NoAnchorFolder { .. }
        )
    }
}

/// Turns the violation of a named constraint into a specific error.
pub trait OnConstraint<T> {
    /// Replaces the error if it reports a violation of `name`. A CHECK is reported by its name, a UNIQUE by its columns
    /// (`subjects.pseudonym`).
    ///
    /// # Errors
    /// `error()` for that violation, otherwise the original error.
    fn on_constraint<E: From<StoreError>>(self, name: &str, error: impl FnOnce() -> E) -> Result<T, E>;
}

impl<T> OnConstraint<T> for StoreResult<T> {
    fn on_constraint<E: From<StoreError>>(self, name: &str, error: impl FnOnce() -> E) -> Result<T, E> {
        self.map_err(|e| match &e {
            StoreError::Database(sqlx::Error::Database(d)) if d.message().contains(name) => error(),
            _ => e.into(),
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::studies::StudyState;

    #[test]
    fn error_about_an_unknown_stored_value_quotes_it_and_names_the_commands() {
        let error = "sleeping".parse::<StudyState>().unwrap_err().to_string();
        assert_eq!(
            error,
            "The record is damaged (study state): unknown value \"sleeping\". Run `gaitwright audit verify`, then restore a \
             backup with `gaitwright restore`."
        );
    }
}
