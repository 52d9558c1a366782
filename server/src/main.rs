//! The gaitwright binary.

use std::process::ExitCode;

fn main() -> ExitCode {
    gaitwright::cli::run()
}
