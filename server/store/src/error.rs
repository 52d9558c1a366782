//! What can go wrong with the record.

use std::path::PathBuf;
use thiserror::Error;

/// Result of a store function.
pub type StoreResult<T> = Result<T, StoreError>;

/// What can go wrong with the record.
#[derive(Debug, Error)]
pub enum StoreError {
    /// The file cannot be opened or created.
    #[error(
        "cannot open the database {}: {source}; the file must be writable, and its folder too: -wal, -shm and .lock files \
         are kept beside it",
        path.display()
    )]
    Open {
        /// The file.
        path: PathBuf,
        /// What the system reports.
        source: std::io::Error,
    },
    /// The file is something else than a database.
    #[error("{} is not a gaitwright database: {reason}", path.display())]
    NotADatabase {
        /// The file.
        path: PathBuf,
        /// How that was seen.
        reason: String,
    },
    /// Another process owns the file.
    #[error("the database {} is in use by another gaitwright process; stop it first or choose another place", path.display())]
    InUse {
        /// The file.
        path: PathBuf,
    },
    /// The file can be reached by another name, under which another process may own it.
    #[error("the database {} has several names (hard links), which mixes up its log: leave it one; `gaitwright backup` copies it", path.display())]
    SeveralNames {
        /// The file.
        path: PathBuf,
    },
    /// A newer version of the program wrote the file.
    #[error(
        "the database {} has schema version {found}, this program knows up to {known}: use a newer gaitwright; nothing was changed",
        path.display()
    )]
    NewerSchema {
        /// The file.
        path: PathBuf,
        /// Its schema version.
        found: i64,
        /// The newest version this program knows.
        known: i64,
    },
    /// There is nothing where a record was.
    #[error(
        "there is no record at {}, but {} says that there was one: put a copy in place with `gaitwright restore`; to begin \
         an empty record, remove that file",
        path.display(), evidence.display()
    )]
    RecordMissing {
        /// Where the record should be.
        path: PathBuf,
        /// Its anchor or its log.
        evidence: PathBuf,
    },
    /// The file of the open record, or its log, was deleted, replaced or cut.
    #[error(
        "the record {} takes no changes: {what} while it was open; what was acknowledged before may be lost with the \
         process. Stop the service, then run `gaitwright audit verify`",
        path.display()
    )]
    RecordVanished {
        /// The database file.
        path: PathBuf,
        /// What happened to which file.
        what: String,
    },
    /// The record has lost its end, or is an earlier state of itself.
    #[error(
        "the record {} ends with row {found} of {table}, but its anchor {} has seen row {seen}: acknowledged changes are \
         missing, nothing was changed. Put the missing log or a newer copy in place; if this state is the right one, remove \
         the anchor",
        record.display(), anchor.display()
    )]
    CutOff {
        /// The database file.
        record: PathBuf,
        /// The anchor.
        anchor: PathBuf,
        /// `audit` or `seals`.
        table: &'static str,
        /// The last row there is.
        found: i64,
        /// The last row that the anchor saw.
        seen: i64,
    },
    /// The record has another past than the one its anchor saw.
    #[error(
        "row {seq} of {table} in the record {} is not the one that its anchor {} has seen: the past was rewritten, or this is \
         another record. Nothing was changed; if this record is the right one, remove the anchor",
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
        "row {key} of {table} in the record was not written by this program: it has no seal. Nothing was changed; run \
         `gaitwright audit verify` and put a copy in place with `gaitwright restore`"
    )]
    Unsealed {
        /// Its table.
        table: String,
        /// Its primary key.
        key: String,
    },
    /// The schema could not be brought up to date.
    #[error("migrating the database: {0}")]
    Migrate(#[from] sqlx::migrate::MigrateError),
    /// A row that must exist does not.
    #[error("{what} {id} does not exist")]
    Missing {
        /// What was looked for.
        what: &'static str,
        /// Its identifier.
        id: String,
    },
    /// A stored value cannot be understood: the file was damaged or edited.
    #[error("the record is damaged: {what}: {reason}")]
    Damaged {
        /// Which value.
        what: &'static str,
        /// Why.
        reason: String,
    },
    /// The system has no random numbers.
    #[error("no random numbers: {0}")]
    NoRandomNumbers(String),
    /// The subject withdrew consent.
    #[error("the subject withdrew consent: the record is kept, but nothing is added to it, shown or given out")]
    Withdrawn,
    /// The record was closed.
    #[error("the database is closed: the service is shutting down")]
    Closed,
    /// A change could not be written to the disk; it did not happen.
    #[error("database: the change could not be made durable: {0}")]
    NotDurable(String),
    /// So little space is left that nothing large is begun.
    #[error(
        "the disk is nearly full: {free_mb} MB are free, {reserve_mb} MB are kept in reserve; make room and try again"
    )]
    NearlyFull {
        /// What is free.
        free_mb: u64,
        /// What is kept.
        reserve_mb: u64,
    },
    /// Anything else the database reports.
    #[error("database: {0}")]
    Database(#[from] sqlx::Error),
}

impl StoreError {
    /// Whether the subject withdrew consent: refused here, or by a trigger.
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
            Self::NearlyFull { .. } => true,
            Self::NotDurable(reason) => says_so(reason),
            Self::Database(sqlx::Error::Database(found)) => says_so(found.message()),
            _ => false,
        }
    }

    /// Whether the record takes no changes now, for a reason of the machine.
    pub fn is_unwritable(&self) -> bool {
        let says_so = |text: &str| ["disk I/O error", "readonly database"].iter().any(|words| text.contains(words));
        match self {
            Self::NotDurable(_) | Self::Closed => true,
            Self::Database(sqlx::Error::Database(found)) => says_so(found.message()),
            _ => false,
        }
    }

    /// The same for everybody whose change was made durable together with another.
    pub(super) fn for_all(&self) -> Self {
        match self {
            Self::RecordVanished { path, what } => Self::RecordVanished { path: path.clone(), what: what.clone() },
            Self::NotDurable(reason) => Self::NotDurable(reason.clone()),
            other => Self::NotDurable(other.to_string()),
        }
    }

    /// Whether a file was named that cannot be what was meant, rather than a failure of the record itself.
    pub fn is_wrong_file(&self) -> bool {
        matches!(self, Self::Open { .. } | Self::NotADatabase { .. } | Self::NewerSchema { .. })
    }
}

/// Turns the violation of a named constraint into a specific error.
pub trait OnConstraint<T> {
    /// Replaces the error when it says that `name` was violated. For a CHECK, `name` is its name; for a
    /// UNIQUE, SQLite reports the columns (`subjects.pseudonym`).
    ///
    /// # Errors
    /// `error()` on that violation, otherwise the error as it was.
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
