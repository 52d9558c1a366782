//! The command line as a process.

use std::path::Path;
use std::process::{Command, Output, Stdio};

/// The command line in a folder, with these arguments; `binary` is `env!("CARGO_BIN_EXE_gaitwright-cli")`.
pub fn command(binary: &str, folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(binary);
    command.current_dir(folder).args(arguments).stdin(Stdio::null());
    for setting in ["DATABASE", "LISTEN", "WORKERS", "HOST_NAMES"] {
        command.env_remove(format!("GAITWRIGHT_{setting}"));
    }
    command
}

/// Runs it to its end.
pub fn run(binary: &str, folder: &Path, arguments: &[&str]) -> Output {
    command(binary, folder, arguments).output().unwrap()
}

/// Names of the files of a folder, sorted.
pub fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}
