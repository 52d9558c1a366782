//! The quarantine: a temporary record into which an archive is unpacked and checked. It has the constraints, triggers
//! and foreign keys of the real schema, and contains no other study.

use super::archived_row::{Cell, Row};
use super::archived_rows::Unpacking;
use super::{Connection, StoreResult, schema_versions};
use sqlx::sqlite::{SqliteConnectOptions, SqliteSynchronous};
use sqlx::{ConnectOptions, SqliteConnection};

/// Length of the queue of rows that are read ahead. Short, because rows can be large.
pub(super) const ROWS_AHEAD: usize = 2;

/// A temporary record with one study.
#[derive(Debug)]
pub struct Quarantine {
    db: SqliteConnection,
    unpacking: Unpacking,
    /// The parent of a clone, which an archive does not contain.
    cloned_from: Option<String>,
}

impl Quarantine {
    /// Creates an empty quarantine.
    ///
    /// # Errors
    /// Errors of the database.
    pub async fn new() -> StoreResult<Self> {
        let options = SqliteConnectOptions::new()
            // The empty name denotes a temporary file.
            .filename("")
            .foreign_keys(true)
            .synchronous(SqliteSynchronous::Off)
            .row_buffer_size(ROWS_AHEAD);
        let mut db = options.connect().await?;
        schema_versions::fresh(&mut db).await?;
        sqlx::query("begin").execute(&mut db).await?;
        Ok(Self { db, unpacking: Unpacking::default(), cloned_from: None })
    }

    /// Adds a row.
    ///
    /// # Errors
    /// A violated constraint, trigger or reference; errors of the database.
    pub async fn add(&mut self, table: &'static str, mut row: Row) -> StoreResult<()> {
        if table == "studies" {
            self.cloned_from = row.text("cloned_from").map(str::to_owned);
            row.set("cloned_from", Cell::Null);
        }
        self.unpacking.write(&mut self.db, table, row).await?;
        Ok(())
    }

    /// Ends writing, and checks foreign keys.
    ///
    /// # Errors
    /// A reference to a missing row; errors of the database.
    pub async fn settle(&mut self) -> StoreResult<()> {
        sqlx::query("commit").execute(&mut self.db).await?;
        Ok(())
    }

    /// The parent of the study, if it is a clone.
    pub fn cloned_from(&self) -> Option<&str> {
        self.cloned_from.as_deref()
    }

    /// A connection for reading.
    pub fn db(&mut self) -> &mut Connection {
        &mut self.db
    }
}
