//! `gaitwright config`.

use super::settings::Flags;
use clap::{Args, Subcommand};

/// `gaitwright config`.
#[derive(Debug, Args)]
pub(super) struct Config {
    #[command(subcommand)]
    what: ConfigCommand,
}

#[derive(Debug, Subcommand)]
enum ConfigCommand {
    /// Show every setting of `gaitwright serve`, its value and where the value comes from.
    Show {
        #[command(flatten)]
        flags: Box<Flags>,
    },
}

impl Config {
    pub(super) fn flags(&self) -> Flags {
        let ConfigCommand::Show { flags } = &self.what;
        (**flags).clone()
    }
}
