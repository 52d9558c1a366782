//! `gaitwright users`: who may sign in, and a way in for whoever has the record.

use super::output::{data, tell};
use super::record::exists;
use clap::{Args, Subcommand};
use gaitwright_service::access::people;
use gaitwright_service::error::Error;
use gaitwright_store::audit::Actor;
use gaitwright_store::{Store, StoreError, commit, users};
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(super) struct Users {
    #[command(subcommand)]
    what: UsersCommand,
}

#[derive(Debug, Subcommand)]
enum UsersCommand {
    /// List the users: name, role, way to sign in, and who is disabled.
    List {
        /// The SQLite file; the service must not be running.
        #[arg(long, env = "GAITWRIGHT_DATABASE", default_value = "gaitwright.db", value_name = "FILE")]
        database: PathBuf,
    },
    /// Make a one-time sign-in link for a user, such as an administrator who forgot the password.
    Link {
        /// Name of the user.
        name: String,
        /// The SQLite file; the service must not be running.
        #[arg(long, env = "GAITWRIGHT_DATABASE", default_value = "gaitwright.db", value_name = "FILE")]
        database: PathBuf,
    },
}

impl Users {
    pub(super) async fn run(self) -> Result<(), Error> {
        let database = match &self.what {
            UsersCommand::List { database } | UsersCommand::Link { database, .. } => database,
        };
        exists(database)?;
        let store = match Store::open(database).await {
            Err(StoreError::InUse { .. }) => {
                let reason = "the service is running with this record: stop it first, or start it anew with \
                              --sign-in-link";
                return Err(Error::conflict(reason));
            }
            opened => opened?,
        };
        let done = self.with(&store).await;
        store.close().await;
        done
    }

    async fn with(&self, store: &Store) -> Result<(), Error> {
        match &self.what {
            UsersCommand::List { .. } => {
                for user in users::all(&mut *store.read().await?).await? {
                    let way_in = if user.has_password { "password" } else { "one-time link" };
                    let disabled = if user.disabled_at.is_some() { "\tdisabled" } else { "" };
                    data(&format!("{}\t{}\t{way_in}{disabled}", user.name, user.role.as_str()))?;
                }
                Ok(())
            }
            UsersCommand::Link { name, .. } => {
                let mut writer = store.write().await?;
                let missing = || Error::NotFound { what: "the user".to_owned(), id: name.clone() };
                let user = users::by_name(&mut writer, name.trim()).await?.ok_or_else(missing)?;
                let secret = people::link(&mut writer, &Actor::terminal(), user.id).await?;
                commit(writer).await?;
                tell(&format!(
                    "a sign-in link for {}, once, within a day: open it at the service's address",
                    user.name
                ));
                data(&format!("/sign-in/{secret}"))
            }
        }
    }
}
