//! Tests that cannot run here say so.

use std::io::Write;

/// Says on stderr, past the capture of the test harness, that the present test was not run, and why.
pub fn skipped(reason: &str) {
    let test = std::thread::current().name().unwrap_or("a test").to_owned();
    // Nobody reads it when stderr is closed.
    let _ = writeln!(std::io::stderr(), "{test}: skipped: {reason}");
}
