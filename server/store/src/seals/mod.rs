//! Seals: a chained hash of each row, which detects rows that another program changed, added or deleted. Rows that
//! change often, such as leases, have a replaceable checksum instead, so that the chain does not grow with them.
//!
//! Temporary triggers of the writing connection note which rows a change writes, and the rows are sealed before the
//! commit. So no code can forget a seal, and writes of other programs get none. The triggers also keep the old row of
//! an update or a deletion: it must match its seal, so that the program never seals what another program wrote.

mod row_hash;
mod sealing;
mod tables;
mod triggers;
mod verification;

pub(super) use sealing::{adopt, seal, touched};
pub use tables::{CHECKED, NOT_SEALED, Sealed, TABLES};
pub(super) use tables::{newest_of, present};
pub(super) use triggers::{end_watch, watch, watch_migrations};
pub use verification::{SealCheck, verify};

use super::json_columns;

/// Separator between the columns of a key.
const JOINT: char = '/';

/// The hash of a seal and the previous one.
fn chained(previous: &str, table: &str, key: &str, sha256: &str) -> String {
    // Only the key can contain a line break, so it comes last.
    json_columns::sha256(format!("{previous}\n{sha256}\n{table}\n{key}").as_bytes())
}
