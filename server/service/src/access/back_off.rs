//! Sign-in back-off: each failed attempt doubles the wait before another password for the same name and network is
//! checked. Other networks are not affected, so an attacker cannot lock a user out. Counts are in the record, so they
//! survive a restart.

use crate::error::Error;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::sign_in_failures::{self as failures, Failures};
use gaitwright_store::{Instant, UserId, Writer};
use serde_json::json;
use std::time::Duration;

/// Number of failures without a wait, because people mistype.
const FREE: u32 = 3;
/// The longest wait.
const LONGEST: Duration = Duration::from_mins(15);
/// Number of names of one network that are counted separately; further names share a count.
const MOST_NAMES: u32 = 1000;
/// Time after the last failure until failures are forgotten.
const REMEMBERED_SECONDS: i64 = 24 * 3600;
/// Key of the shared count. No name contains a line break.
const OTHER_NAMES: &str = "\n";

/// Where a sign-in comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Origin {
    /// The network of the client.
    pub network: String,
    /// The user who signed in earlier in the same browser. Failures of others in the network do not affect this user.
    pub known: Option<UserId>,
}

impl Origin {
    fn source(&self) -> String {
        match self.known {
            Some(user) => format!("{} {user}", self.network),
            None => self.network.clone(),
        }
    }
}

/// An attempt whose password may be checked.
#[derive(Debug)]
#[must_use]
pub struct Attempt {
    name: String,
    counted_as: String,
    origin: Origin,
    attempts: u32,
}

/// Begins an attempt, which counts as failed until it succeeds, so that parallel and aborted attempts count too. The
/// inner `Err` is the remaining wait. The caller must commit in both cases.
///
/// # Errors
/// Errors of the database.
pub async fn begin(
    writer: &mut Writer,
    now: Instant,
    name: &str,
    origin: Origin,
) -> Result<Result<Attempt, Duration>, Error> {
    prune(writer, now).await?;
    let (name, source) = (normal(name), origin.source());
    let mut counted_as = name.clone();
    let mut before = failures::find(writer, &name, &source).await?;
    if before.is_none() && origin.known.is_none() {
        let network = failures::of_network(writer, &origin.network).await?;
        if network.is_some_and(|network| network.names >= MOST_NAMES) {
            OTHER_NAMES.clone_into(&mut counted_as);
            before = failures::find(writer, OTHER_NAMES, &source).await?;
        }
    }
    let attempts = failures::count(writer, &origin.network, now, before.is_none()).await?;
    let wait = before.map_or(0.0, |before| before.waits_until.seconds_since(now));
    if wait > 0.0 {
        note(writer, "session.wait", &name, &origin, attempts).await?;
        return Ok(Err(Duration::from_secs_f64(wait)));
    }
    let count = before.map_or(0, |before| before.count).saturating_add(1);
    set(writer, &counted_as, &source, now, count).await?;
    Ok(Ok(Attempt { name, counted_as, origin, attempts }))
}

impl Attempt {
    /// Records a wrong password and starts the wait.
    ///
    /// # Errors
    /// Errors of the database.
    pub async fn failed(self, writer: &mut Writer, now: Instant) -> Result<(), Error> {
        let source = self.origin.source();
        let count = failures::find(writer, &self.counted_as, &source).await?.map_or(1, |found| found.count);
        set(writer, &self.counted_as, &source, now, count).await?;
        note(writer, "session.refuse", &self.name, &self.origin, self.attempts).await
    }

    /// Records a correct password and clears the count of this name. The shared count stays, or anyone with an account
    /// could clear that of their guesses at other names.
    ///
    /// # Errors
    /// Errors of the database.
    pub async fn succeeded(self, writer: &mut Writer) -> Result<(), Error> {
        if self.counted_as != OTHER_NAMES {
            failures::forget(writer, &self.counted_as, &self.origin.source()).await?;
        }
        Ok(failures::uncount(writer, &self.origin.network).await?)
    }
}

/// Normalises a name for counting: lower case, without characters that names cannot have.
fn normal(name: &str) -> String {
    name.to_lowercase().chars().filter(|c| !c.is_control()).take(80).collect()
}

async fn set(writer: &mut Writer, name: &str, source: &str, now: Instant, count: u32) -> Result<(), Error> {
    let waits_until = now.after(wait_after(count));
    Ok(failures::set(writer, name, source, now, Failures { count, waits_until }).await?)
}

/// Writes a row of the audit trail for the first attempts of a network, then for the 10th, 20th, 50th, 100th and so on,
/// so that thousands of attempts do not fill the trail.
async fn note(writer: &mut Writer, action: &str, name: &str, origin: &Origin, attempts: u32) -> Result<(), Error> {
    if !is_noted(attempts) {
        return Ok(());
    }
    let detail = json!({ "name": name, "network": origin.network, "failed_attempts_of_network": attempts });
    Ok(audit::append(writer, &Actor::anonymous(), action, "session", &detail).await?)
}

/// Deletes counts that are a day old. The audit trail keeps the number of attempts.
async fn prune(writer: &mut Writer, now: Instant) -> Result<(), Error> {
    for source in failures::prune(writer, now.plus_seconds(-REMEMBERED_SECONDS)).await? {
        let detail = json!({
            "network": source.network, "failed_attempts": source.attempts, "names": source.names,
            "first_at": source.first_at, "last_at": source.last_at,
        });
        if source.attempts > 0 {
            audit::append(writer, &Actor::program(), "session.refused", "session", &detail).await?;
        }
    }
    Ok(())
}

fn is_noted(attempts: u32) -> bool {
    let mut leading = attempts;
    while leading >= 10 && leading.is_multiple_of(10) {
        leading /= 10;
    }
    attempts <= 5 || matches!(leading, 1 | 2 | 5)
}

fn wait_after(failures: u32) -> Duration {
    match failures.checked_sub(FREE) {
        None | Some(0) => Duration::ZERO,
        Some(more) => Duration::from_secs(1 << more.min(10)).min(LONGEST),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_double_after_three_failures_up_to_a_quarter_of_an_hour() {
        let waits: Vec<u64> = (1..8).map(|failures| wait_after(failures).as_secs()).collect();
        assert_eq!(waits, [0, 0, 0, 2, 4, 8, 16]);
        assert_eq!(wait_after(u32::MAX), LONGEST);
    }

    #[test]
    fn thirty_thousand_attempts_leave_few_rows_with_their_number() {
        let noted: Vec<u32> = (1..=30_000).filter(|attempts| is_noted(*attempts)).collect();
        assert_eq!(noted.len(), 16);
        assert_eq!(noted.last(), Some(&20_000));
    }
}
