//! `gaitwright prune`.

use super::database_file::exists;
use super::flag_numbers::days;
use super::output::{data, tell};
use super::settings::{AnchoredFlags, Settings};
use clap::Args;
use gaitwright_service::error::Error;
use gaitwright_service::expired_data::{self, DeletedCounts};
use gaitwright_service::studies::pruning::prune;

#[derive(Debug, Args)]
pub(super) struct PruneCommand {
    /// Delete the trajectories of gaits in studies that ended more than this many days ago. Keeps the
    /// trajectories of gaits that are or may be recommended, of the gaits that warm-started them, and of gaits in lab
    /// sessions.
    #[arg(long, value_name = "DAYS", value_parser = days, allow_negative_numbers = true)]
    older_than_days: u32,
    #[command(flatten)]
    pub(super) record: AnchoredFlags,
}

impl PruneCommand {
    pub(super) async fn run(self, settings: &Settings) -> Result<(), Error> {
        exists(&settings.database())?;
        let mut store = settings.open_record().await?;
        let done = prune(&mut store, self.older_than_days).await;
        let expired = expired_data::delete_expired(&store).await;
        store.close().await;
        let (DeletedCounts { answers, sessions, links }, trajectories) = (expired?, done?);
        let (keys, sessions) = (count(answers, "idempotency key"), count(sessions, "session"));
        tell(&format!("deleted {keys}, {sessions} and {}", count(links, "sign-in link")));
        data(&format!("trajectories deleted: {trajectories}"))
    }
}

/// How many things expired, as in `2 expired sessions`.
fn count(number: u64, what: &str) -> String {
    format!("{number} expired {what}{}", if number == 1 { "" } else { "s" })
}
