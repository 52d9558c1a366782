//! Messages of skipped tests, as `tests/src/skipped.rs` writes them for the tests of the whole system.

use std::fs::OpenOptions;
use std::io::Write;

/// Whether the long tests are off. Then reports on stderr, past the capture of the test harness, and in the file that
/// `GAITWRIGHT_SKIPPED` names, that the current test skips `what`.
pub(crate) fn long_tests_are_skipped(what: &str) -> bool {
    if std::env::var_os("GAITWRIGHT_LONG_TESTS").is_some() {
        return false;
    }
    let test = std::thread::current().name().unwrap_or("a test").to_owned();
    let line = format!("{test}: skipped{what}: set GAITWRIGHT_LONG_TESTS=1\n");
    // A closed stderr has no reader, so the error is ignored.
    let _ = std::io::stderr().write_all(line.as_bytes());
    if let Some(file) = std::env::var_os("GAITWRIGHT_SKIPPED") {
        OpenOptions::new().create(true).append(true).open(file).unwrap().write_all(line.as_bytes()).unwrap();
    }
    true
}
