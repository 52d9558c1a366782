//! `gaitwright users`: lists users, and creates sign-in links for them.

use super::database_file::exists;
use super::output::{data, tell};
use super::settings::{AnchoredFlags, Settings};
use clap::{Args, Subcommand};
use gaitwright_service::access::user_administration;
use gaitwright_service::error::Error;
use gaitwright_store::audit::Actor;
use gaitwright_store::{Store, StoreError, commit, users};

#[derive(Debug, Args)]
pub(super) struct UsersCommand {
    #[command(subcommand)]
    what: UsersSubcommand,
}

#[derive(Debug, Subcommand)]
enum UsersSubcommand {
    /// List users: name, role, sign-in method, and whether the account is disabled.
    List {
        #[command(flatten)]
        record: AnchoredFlags,
    },
    /// Create a one-time sign-in link for a user, such as an administrator who has forgotten their password.
    Link {
        /// Name of the user.
        name: String,
        #[command(flatten)]
        record: AnchoredFlags,
    },
}

impl UsersCommand {
    pub(super) fn record(&self) -> &AnchoredFlags {
        match &self.what {
            UsersSubcommand::List { record } | UsersSubcommand::Link { record, .. } => record,
        }
    }

    pub(super) async fn run(self, settings: &Settings) -> Result<(), Error> {
        exists(&settings.database())?;
        let store = match settings.open_record().await {
            Err(StoreError::InUse { .. }) => {
                let instead = match self.what {
                    UsersSubcommand::List { .. } => "Stop it first, or use the Users and tokens page.",
                    UsersSubcommand::Link { .. } => "Stop it first, or restart it with --sign-in-link.",
                };
                return Err(Error::conflict(format!("The service is using this database. {instead}")));
            }
            opened => opened?,
        };
        let done = self.with(&store).await;
        store.close().await;
        done
    }

    async fn with(&self, store: &Store) -> Result<(), Error> {
        match &self.what {
            UsersSubcommand::List { .. } => {
                for user in users::all(&mut *store.read().await?).await? {
                    let operator_administrator = if user.has_password { "password" } else { "one-time link" };
                    let disabled = if user.disabled_at.is_some() { "\tdisabled" } else { "" };
                    data(&format!("{}\t{}\t{operator_administrator}{disabled}", user.name, user.role.as_str()))?;
                }
                Ok(())
            }
            UsersSubcommand::Link { name, .. } => {
                let mut writer = store.write().await?;
                let missing = || Error::NotFound { what: "user".to_owned(), id: name.clone() };
                let user = users::by_name(&mut writer, name.trim()).await?.ok_or_else(missing)?;
                let secret = user_administration::link(&mut writer, &Actor::terminal(), user.id).await?;
                commit(writer).await?;
                tell(&format!(
                    "sign-in link for {}: append this path to the address of the service. The link works only once and expires \
                     after a day.",
                    user.name
                ));
                data(&format!("/sign-in/{secret}"))
            }
        }
    }
}
