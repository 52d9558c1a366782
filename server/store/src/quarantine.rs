//! Where an archive is unpacked to be looked at: a record of its own, in a temporary file that has no name and is gone
//! with the connection. Every constraint, trigger and reference of the schema holds there, and no other study is there to
//! refer to.

use super::archive::Unpacking;
use super::row::{Cell, Row};
use super::{Connection, StoreResult, migrations};
use sqlx::sqlite::{SqliteConnectOptions, SqliteSynchronous};
use sqlx::{ConnectOptions, SqliteConnection};

/// Rows that a read hands over before they are asked for: few, because a row may be large.
pub(super) const ROWS_AHEAD: usize = 2;

/// A record with nothing in it but one study.
#[derive(Debug)]
pub struct Quarantine {
    db: SqliteConnection,
    unpacking: Unpacking,
    /// The study whose set-up it was made from, which an archive does not hold.
    forked_from: Option<String>,
}

impl Quarantine {
    /// An empty one.
    ///
    /// # Errors
    /// What the database reports.
    pub async fn new() -> StoreResult<Self> {
        let options = SqliteConnectOptions::new()
            // SQLite's name for a temporary file.
            .filename("")
            .foreign_keys(true)
            .synchronous(SqliteSynchronous::Off)
            .row_buffer_size(ROWS_AHEAD);
        let mut db = options.connect().await?;
        migrations::fresh(&mut db).await?;
        sqlx::query("begin").execute(&mut db).await?;
        Ok(Self { db, unpacking: Unpacking::default(), forked_from: None })
    }

    /// Adds a row.
    ///
    /// # Errors
    /// A violated constraint, trigger or reference, or what the database reports.
    pub async fn add(&mut self, table: &'static str, mut row: Row) -> StoreResult<()> {
        if table == "studies" {
            self.forked_from = row.text("forked_from").map(str::to_owned);
            row.set("forked_from", Cell::Null);
        }
        self.unpacking.write(&mut self.db, table, row).await?;
        Ok(())
    }

    /// Ends writing: what follows reads.
    ///
    /// # Errors
    /// A reference that points at nothing, or what the database reports.
    pub async fn settle(&mut self) -> StoreResult<()> {
        sqlx::query("commit").execute(&mut self.db).await?;
        Ok(())
    }

    /// The study whose set-up the one in it was made from.
    pub fn forked_from(&self) -> Option<&str> {
        self.forked_from.as_deref()
    }

    /// A connection to read what is in it.
    pub fn db(&mut self) -> &mut Connection {
        &mut self.db
    }
}
