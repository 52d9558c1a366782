//! `gaitwright config`.

use super::settings::Flags;
use clap::{Args, Subcommand};

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
}
