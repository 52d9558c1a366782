//! `gaitwright config`.

use super::output::data;
use super::settings::{Flags, Settings, without_password};
use clap::{Args, Subcommand};
use gaitwright_service::error::Error;

/// `gaitwright config`.
#[derive(Debug, Args)]
pub(super) struct ConfigCommand {
    #[command(subcommand)]
    what: ConfigSubcommand,
}

#[derive(Debug, Subcommand)]
enum ConfigSubcommand {
    /// Show every setting of `gaitwright serve`, its value and where the value comes from.
    Show {
        #[command(flatten)]
        flags: Box<Flags>,
    },
}

impl ConfigCommand {
    pub(super) fn flags(&self) -> Flags {
        let ConfigSubcommand::Show { flags } = &self.what;
        (**flags).clone()
    }

    /// Prints every setting, its value and its origin.
    pub(super) fn run(settings: &Settings) -> Result<(), Error> {
        for (name, value, origin, meaning) in settings.entries() {
            data(&format!("{name} = {:?}  # {origin}; {meaning}", without_password(value)))?;
        }
        Ok(())
    }
}
