//! What the commands print: data to stdout, words to stderr. A reader that goes away early (`| head`) is no fault.

use gaitwright_service::error::Error;
use std::io::{ErrorKind, Write};

/// A line of data on stdout.
///
/// # Errors
/// When stdout cannot be written though somebody reads it, as on a full disk.
pub(super) fn data(line: &str) -> Result<(), Error> {
    let mut stdout = std::io::stdout().lock();
    match writeln!(stdout, "{line}").and_then(|()| stdout.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::Output(e)),
        _ => Ok(()),
    }
}

/// A line for people on stderr; lost when nobody listens.
pub(super) fn tell(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}
