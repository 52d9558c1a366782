//! Messages of skipped tests.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Variable that names the list of skipped tests. Whoever sets it prints the list.
pub const FILE: &str = "GAITWRIGHT_SKIPPED";

/// Reports on stderr, past the capture of the test harness, and in [`list`] that the current test was skipped, and why.
///
/// # Panics
/// If the list cannot be written.
pub fn skipped(reason: &str) {
    let test = std::thread::current().name().unwrap_or("a test").to_owned();
    let line = format!("{}{test}: skipped: {reason}\n", program());
    // A closed stderr has no reader, so the error is ignored.
    let _ = std::io::stderr().write_all(line.as_bytes());
    let list = list();
    // One write for each line, because test programs may run at the same time.
    let written = fs::create_dir_all(list.parent().unwrap_or(Path::new("/")))
        .and_then(|()| OpenOptions::new().create(true).append(true).open(&list))
        .and_then(|mut file| file.write_all(line.as_bytes()));
    written.unwrap_or_else(|error| panic!("{}: {error}", list.display()));
}

/// The file to which skipped tests add their lines: the one that `GAITWRIGHT_SKIPPED` names, or one in the folder
/// `target/tmp` for each run of `cargo test`.
///
/// # Panics
/// If the test program is in no target folder.
#[must_use]
pub fn list() -> PathBuf {
    if let Some(file) = std::env::var_os(FILE) {
        return file.into();
    }
    // The programs of one run have the same parent, Cargo.
    let program = std::env::current_exe().expect("the path of the test program");
    let target = program.ancestors().nth(3).expect("a test program is in target/<profile>/deps");
    target.join("tmp").join(format!("skipped-tests-{}", std::os::unix::process::parent_id()))
}

/// [`skipped`], unless the environment variable `required` is set: then the current test fails.
///
/// # Panics
/// If the variable is set, and as [`skipped`].
pub fn skipped_unless_required(required: &str, reason: &str) {
    assert!(std::env::var_os(required).is_none(), "{reason}, and {required} is set");
    skipped(reason);
}

/// The name of the test program, without the hash that Cargo adds to it: `serve::`.
fn program() -> String {
    let path = std::env::current_exe().unwrap_or_default();
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = name.rsplit_once('-').map_or(&*name, |(name, _)| name);
    if name.is_empty() { String::new() } else { format!("{name}::") }
}

#[cfg(test)]
mod tests {
    use super::program;

    #[test]
    fn test_program_is_named_without_the_hash() {
        assert_eq!(program(), "gaitwright_tests::");
    }
}
