//! The database file that a command of the command line reads: that it exists, and that its reading is logged.

use super::output::tell;
use gaitwright_service::error::Error;
use gaitwright_store::access_log::{Access, AccessKind};
use gaitwright_store::access_spool;
use gaitwright_store::audit::Actor;
use std::path::Path;

/// Notes for the access log that data of subjects leaves the record. Prints a warning if nothing can be written next to
/// the record, as on a read-only medium.
pub(super) fn note_export(database: &Path, command: &str, object: &str, named: Vec<String>) {
    let access = Access {
        kind: AccessKind::Export,
        actor: Actor::terminal().as_str().to_owned(),
        address: String::new(),
        method: String::new(),
        route: format!("gaitwright {command}"),
        object: object.to_owned(),
        status: 0,
        named,
    };
    if let Err(error) = access_spool::note(database, &access) {
        tell(&format!("gaitwright: cannot record this {command} in the access log: {error}"));
    }
}

pub(super) fn exists(path: &Path) -> Result<(), Error> {
    if path.exists() { Ok(()) } else { Err(Error::Malformed(format!("There is no file {}.", path.display()))) }
}
