//! Output of the commands: data to stdout, messages to stderr. A closed pipe (`| head`) is not an error.

use gaitwright_service::error::Error;
use std::io::{ErrorKind, Write};

/// Prints a line of data to stdout.
///
/// # Errors
/// When stdout cannot be written, as on a full disk. A closed pipe is not an error.
pub(super) fn data(line: &str) -> Result<(), Error> {
    let mut stdout = std::io::stdout().lock();
    match writeln!(stdout, "{line}").and_then(|()| stdout.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::Output(e)),
        _ => Ok(()),
    }
}

/// Prints a message to stderr, and ignores failures.
pub(super) fn tell(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}
