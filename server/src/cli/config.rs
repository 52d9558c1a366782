//! `gaitwright config`.

use super::output::data;
use super::settings::{Flags, Settings};
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

/// The address without the user and password in it.
fn without_password(text: &str) -> String {
    let Some((scheme, rest)) = text.split_once("://") else { return text.to_owned() };
    match rest.rsplit_once('@') {
        Some((_, host)) => format!("{scheme}://...@{host}"),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passwords_in_addresses_are_hidden() {
        assert_eq!(without_password("nats://lab:s3@cret@broker:4222"), "nats://...@broker:4222");
        assert_eq!(without_password("nats://broker:4222"), "nats://broker:4222");
        assert_eq!(without_password("warn,gaitwright=info"), "warn,gaitwright=info");
    }
}
