//! The command line as a process.

use gait_optimizer::TunedBounds;
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

/// The row of a table of actions for bounds such as `a5=0.013`.
pub fn action(bounds: &str) -> String {
    TunedBounds::parse(bounds).unwrap().to_array().map(|value| value.to_string()).join(",")
}

/// A table of actions for `sweep`: the header and one row for each.
pub fn actions(rows: &[&str]) -> String {
    let header = TunedBounds::NAMES.join(",");
    std::iter::once(header).chain(rows.iter().map(|bounds| action(bounds))).map(|line| line + "\n").collect()
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
