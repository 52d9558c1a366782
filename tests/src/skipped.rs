//! Messages of skipped tests.

use std::io::Write;

/// Reports on stderr, past the capture of the test harness, that the current test was skipped, and why.
pub fn skipped(reason: &str) {
    let test = std::thread::current().name().unwrap_or("a test").to_owned();
    // A closed stderr has no reader, so the error is ignored.
    let _ = writeln!(std::io::stderr(), "{test}: skipped: {reason}");
}
