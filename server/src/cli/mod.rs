//! The command line: parses arguments, runs a command, sets the exit code. Data goes to stdout, messages and logs to
//! stderr.

mod archive_commands;
mod atlas;
mod atlas_study;
mod atlas_table;
mod audit;
mod backup;
mod certify;
mod command_end;
mod config;
mod convert;
mod cores;
mod database_file;
mod doctor;
mod emg;
mod flag_choices;
mod flag_names;
mod flag_numbers;
mod gait_file;
mod input_file;
mod interruption;
mod lineage;
mod logging;
mod multi_start_flags;
mod out_file;
mod output;
mod problem_files;
mod problem_flags;
mod prune;
mod reference;
mod reference_comparison;
mod reproduce;
mod resumed_study;
mod serve;
mod service_plan;
mod settings;
mod simulate;
mod simulated_walks_flags;
mod solve;
mod solve_file;
mod subject_flags;
mod sweep;
#[cfg(feature = "tls")]
mod tls;
mod tune;
mod unattended_study;
mod users;
mod worker;

use clap::{Parser, Subcommand};
use command_end::{CommandEnd, report};
use gaitwright_http::openapi;
use gaitwright_service::error::Error;
use output::{data, tell};
use settings::{AnchoredFlags, Flags, RecordFlags, Settings, unknown_variables};
use std::process::ExitCode;

/// Tunes walking gaits for powered prostheses by preference learning.
///
/// Research software; not a medical device.
///
/// In this help, "the paper" is K. Li, M. Tucker, R. Gehlhar, Y. Yue, A. D. Ames, Natural Multicontact Walking for
/// Robotic Assistive Devices via Musculoskeletal Models and Hybrid Zero Dynamics, IEEE Robotics and Automation Letters,
/// 2022.
#[derive(Debug, Parser)]
#[command(name = "gaitwright", version, about)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the service (web pages and REST interface) and the studies in its database.
    Serve(serve::ServeCommand),
    /// Run solves on this machine for a service on another machine, through a NATS broker.
    Worker(worker::WorkerCommand),
    /// Run an unattended study in which Gait RMSE, not a person, answers the comparisons.
    ///
    /// If the record has an unfinished study with the same settings, continue it instead of creating another one.
    Tune(tune::TuneCommand),
    /// Reproduce the paper's comparison of gaits with and without muscles.
    Reproduce(reproduce::ReproduceCommand),
    /// Optimise one gait.
    Solve(solve::SolveCommand),
    /// Optimise a gait for each row of a table of actions.
    Sweep(sweep::SweepCommand),
    /// Find the gait of every action of Table I, starting every solve from one root gait.
    ///
    /// Actions that differ only in inactive bounds share a gait, so only a fraction of the solves is needed.
    Atlas(atlas::AtlasCommand),
    /// Certify a gait independently of the optimiser: residuals, closed loop, stability.
    Certify(certify::CertifyCommand),
    /// Simulate walks with a gait on level and uneven ground, under laboratory controllers.
    Simulate(simulate::SimulateCommand),
    /// Convert a gait to a table, an OpenSim motion file or a picture.
    Convert(convert::ConvertCommand),
    /// Compute a reference gait from a recording of joint angles.
    Reference(reference::ReferenceCommand),
    /// Process an EMG recording: envelopes, mean cycles, EMG RMSE, average activity.
    Emg(emg::EmgCommand),
    /// Verify the integrity of a record.
    Audit(audit::AuditCommand),
    /// Show the settings of the service.
    Config(config::ConfigCommand),
    /// Check the machine, the settings, the address and folders of the service, the record, the clock and the broker. Exits with
    /// status 1 if anything is wrong.
    ///
    /// The output is meant for bug reports: it contains no subject data and no secrets.
    Doctor(doctor::DoctorCommand),
    /// Print the description of the REST interface (OpenAPI 3.1).
    Openapi,
    /// Back up a record, even while the service is running.
    Backup(backup::BackupCommand),
    /// Replace a record with a backup; the service must be stopped.
    ///
    /// The replaced record is kept in the same folder under another name.
    Restore(backup::RestoreCommand),
    /// Export a study to an archive, even while the service is running.
    Export(archive_commands::ExportCommand),
    /// Import a study from an archive; the service must be stopped.
    Import(archive_commands::ImportCommand),
    /// Create a key for signing archives, and print its public key.
    SigningKey(archive_commands::SigningKeyCommand),
    /// List users or create sign-in links for them; the service must be stopped.
    Users(users::UsersCommand),
    /// Delete old trajectories; the service must be stopped.
    ///
    /// Results, answers and recommended gaits are kept. Also deletes expired idempotency keys, sessions and sign-in links.
    Prune(prune::PruneCommand),
}

impl Command {
    /// The flags that set settings.
    fn flags(&self) -> Flags {
        let record: AnchoredFlags = match self {
            Self::Serve(serve) => return serve.flags.clone(),
            Self::Config(config) => return config.flags(),
            Self::Doctor(doctor) => return doctor.flags(),
            Self::Worker(worker) => return worker.flags(),
            Self::Tune(tune) => tune.record.clone(),
            Self::Audit(audit) => audit.record().clone(),
            Self::Users(users) => users.record().clone(),
            Self::Restore(restore) => restore.record.clone(),
            Self::Import(import) => import.record.clone(),
            Self::Prune(prune) => prune.record.clone(),
            Self::Backup(backup) => backup.record.clone().into(),
            Self::Export(export) => export.record.clone().into(),
            _ => RecordFlags::default().into(),
        };
        record.into()
    }
}

/// Runs the program.
pub fn run() -> ExitCode {
    let cli = Cli::parse();
    let flags = cli.command.flags();
    let is_doctor = matches!(cli.command, Command::Doctor(_));
    let (settings, unread_file) = match Settings::read(&flags) {
        Ok(settings) => (settings, None),
        // The report says that the file cannot be read, and checks everything else.
        Err(error) if is_doctor => (Settings::without_file(&flags), Some(error)),
        Err(error) => return report(&error),
    };
    match settings.log().and_then(|(filter, json)| logging::start(filter, json)) {
        Err(error) if !is_doctor => return report(&error),
        _ => {}
    }
    for name in unknown_variables(std::env::vars_os().filter_map(|(name, _)| name.into_string().ok())) {
        tell(&format!(
            "gaitwright: the environment variable {name} is not a setting; `gaitwright config show` lists all settings"
        ));
    }
    let runtime = match tokio::runtime::Builder::new_multi_thread().enable_all().build() {
        Ok(runtime) => runtime,
        Err(error) => return report(&Error::Internal(error.to_string())),
    };
    let done = match cli.command {
        Command::Serve(serve) => runtime.block_on(serve.run(&settings)).map(|()| CommandEnd::Done),
        Command::Worker(worker) => runtime.block_on(worker.run(&settings)).map(|()| CommandEnd::Done),
        Command::Tune(tune) => runtime.block_on(tune.run(&settings)),
        Command::Reproduce(reproduce) => runtime.block_on(reproduce.run()),
        Command::Solve(solve) => runtime.block_on(solve.run()),
        Command::Sweep(sweep) => runtime.block_on(sweep.run()),
        Command::Atlas(atlas) => runtime.block_on(atlas.run()),
        Command::Certify(certify) => runtime.block_on(certify.run()).map(|()| CommandEnd::Done),
        Command::Simulate(simulate) => runtime.block_on(simulate.run()).map(|()| CommandEnd::Done),
        Command::Reference(reference) => reference.run().map(|()| CommandEnd::Done),
        Command::Emg(emg) => emg.run().map(|()| CommandEnd::Done),
        Command::Convert(convert) => convert.run().map(|()| CommandEnd::Done),
        Command::Audit(audit) => runtime.block_on(audit.run(&settings)).map(|()| CommandEnd::Done),
        Command::Config(_) => config::ConfigCommand::run(&settings).map(|()| CommandEnd::Done),
        Command::Doctor(doctor) => {
            let healthy = runtime.block_on(doctor.run(&settings, unread_file));
            healthy.map(|healthy| if healthy { CommandEnd::Done } else { CommandEnd::Failed })
        }
        Command::Openapi => {
            let text = openapi::text().map_err(|e| Error::Internal(e.to_string()));
            text.and_then(|text| data(text.trim_end())).map(|()| CommandEnd::Done)
        }
        Command::Backup(backup) => runtime.block_on(backup.run(&settings)).map(|()| CommandEnd::Done),
        Command::Restore(restore) => runtime.block_on(restore.run(&settings)).map(|()| CommandEnd::Done),
        Command::Export(export) => runtime.block_on(export.run(&settings)).map(|()| CommandEnd::Done),
        Command::SigningKey(key) => key.run().map(|()| CommandEnd::Done),
        Command::Import(import) => runtime.block_on(import.run(&settings)).map(|()| CommandEnd::Done),
        Command::Users(users) => runtime.block_on(users.run(&settings)).map(|()| CommandEnd::Done),
        Command::Prune(prune) => runtime.block_on(prune.run(&settings)).map(|()| CommandEnd::Done),
    };
    match done {
        Ok(end) => end.exit_code(),
        Err(error) => report(&error),
    }
}
