//! The command line. Data goes to stdout, progress and logs to stderr.

mod body;
mod config;
mod logging;
mod problem;
mod record;
mod serve;
mod solve;
pub mod study;
mod sweep;
mod tune;

use crate::error::Error;
use crate::http::openapi;
use clap::{Parser, Subcommand};
use config::{Flags, Settings};
use std::process::ExitCode;

/// Exit code when the input is at fault, as with every usage error.
const INPUT_FAULT: u8 = 2;

/// A preference-learning tuning service for walking gaits of powered prostheses.
///
/// Research software; not a medical device.
#[derive(Debug, Parser)]
#[command(name = "gaitwright", version, about)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Serve the pages and the REST interface, and run the studies of a database.
    Serve(serve::Serve),
    /// Tune a gait unattended: propose, optimise, compare by Gait RMSE, repeat.
    Tune(tune::Tune),
    /// Optimise one gait.
    Solve(solve::Solve),
    /// Optimise one gait for each row of a table of actions.
    Sweep(sweep::Sweep),
    /// Check the audit trail.
    Audit(record::Audit),
    /// Show the settings of the service.
    Config(config::Config),
    /// Print the description of the REST interface (OpenAPI 3.1).
    Openapi,
    /// Copy a database, also while it is served.
    Backup(record::Backup),
    /// Put a copy in place of a database.
    Restore(record::Restore),
    /// Write a whole study into one file.
    Export(study::Export),
    /// Add the study of such a file to a database.
    Import(study::Import),
    /// Drop old trajectories; what was learned from them stays.
    Prune(study::Prune),
}

/// Runs the program.
pub fn run() -> ExitCode {
    let cli = Cli::parse();
    let settings = match &cli.command {
        Command::Serve(serve) => serve.settings(),
        _ => Settings::read(&Flags::default()),
    };
    let settings = match settings {
        Ok(settings) => settings,
        Err(error) => return report(&error),
    };
    let (filter, json) = settings.log();
    logging::start(filter, json);
    let runtime = match tokio::runtime::Builder::new_multi_thread().enable_all().build() {
        Ok(runtime) => runtime,
        Err(error) => return report(&Error::Internal(error.to_string())),
    };
    let done = match cli.command {
        Command::Serve(serve) => runtime.block_on(serve.run(&settings)),
        Command::Tune(tune) => runtime.block_on(tune.run()),
        Command::Solve(solve) => runtime.block_on(solve.run()),
        Command::Sweep(sweep) => runtime.block_on(sweep.run()),
        Command::Audit(audit) => runtime.block_on(audit.run()),
        Command::Config(config) => config.run(),
        Command::Openapi => openapi::text().map(|text| print!("{text}")).map_err(|e| Error::Internal(e.to_string())),
        Command::Backup(backup) => runtime.block_on(backup.run()),
        Command::Restore(restore) => runtime.block_on(restore.run()),
        Command::Export(export) => runtime.block_on(export.run()),
        Command::Import(import) => runtime.block_on(import.run()),
        Command::Prune(prune) => runtime.block_on(prune.run()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => report(&error),
    }
}

fn report(error: &Error) -> ExitCode {
    eprintln!("gaitwright: {error}");
    if error.is_input() { ExitCode::from(INPUT_FAULT) } else { ExitCode::FAILURE }
}
