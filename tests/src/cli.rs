//! The command line as a process.

use std::path::Path;
use std::process::{Command, Output, Stdio};

/// The command line in a folder, with these arguments; `binary` is `env!("CARGO_BIN_EXE_gaitwright-cli")`.
pub fn command(binary: &str, folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(binary);
    command.current_dir(folder).args(arguments).stdin(Stdio::null());
    for (name, _) in std::env::vars().filter(|(name, _)| name.starts_with("GAITWRIGHT_")) {
        command.env_remove(name);
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
