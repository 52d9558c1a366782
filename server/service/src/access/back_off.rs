//! Sign-in back-off: each failed attempt doubles the wait before the next password of the same name from the same source
//! is compared. Others who sign in by that name from elsewhere do not wait, so that nobody can be kept out. Counts are in
//! the record: a restart forgets none, and none gives way to fresh names.

use crate::error::Error;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::sign_in_failures::{self as failures, Failures};
use gaitwright_store::{Instant, UserId, Writer};
use serde_json::json;
use std::time::Duration;

/// Failures that cost nothing: people mistype.
const FREE: u32 = 3;
/// The longest wait.
const LONGEST: Duration = Duration::from_mins(15);
/// Names of one network that have a count each in a day; the others share one.
const MOST_NAMES: u32 = 1000;
/// Failures are remembered for so long after the last one.
const REMEMBERED_SECONDS: i64 = 24 * 3600;
/// Stands for the names that share a count; no name has a line break.
const OTHER_NAMES: &str = "\n";

/// Where somebody signs in from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Origin {
    /// The network of the client.
    pub network: String,
    /// The user who signed in before in the same browser: others in the same network do not make this one wait.
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

/// An attempt whose password may be compared.
#[derive(Debug)]
#[must_use]
pub struct Attempt {
    name: String,
    counted_as: String,
    origin: Origin,
    attempts: u32,
}

/// Begins an attempt, which counts as failed until it has succeeded: many at once, and those that are broken off, are as
/// many as one after the other. `Err` of the inner result: how long this name must still wait here. Either is to be
/// committed.
///
/// # Errors
/// What the database reports.
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
    /// The password was wrong: the wait begins now.
    ///
    /// # Errors
    /// What the database reports.
    pub async fn failed(self, writer: &mut Writer, now: Instant) -> Result<(), Error> {
        let source = self.origin.source();
        let count = failures::find(writer, &self.counted_as, &source).await?.map_or(1, |found| found.count);
        set(writer, &self.counted_as, &source, now, count).await?;
        note(writer, "session.refuse", &self.name, &self.origin, self.attempts).await
    }

    /// The password was right.
    ///
    /// # Errors
    /// What the database reports.
    pub async fn succeeded(self, writer: &mut Writer) -> Result<(), Error> {
        failures::forget(writer, &self.counted_as, &self.origin.source()).await?;
        Ok(failures::uncount(writer, &self.origin.network).await?)
    }
}

/// As counted and shown: whatever the case of its letters, without what no name has.
fn normal(name: &str) -> String {
    name.to_lowercase().chars().filter(|c| !c.is_control()).take(80).collect()
}

async fn set(writer: &mut Writer, name: &str, source: &str, now: Instant, count: u32) -> Result<(), Error> {
    let waits_until = now.after(wait_after(count));
    Ok(failures::set(writer, name, source, now, Failures { count, waits_until }).await?)
}

/// A row of the audit trail for the first attempts of a network, and then for every 10th, 20th, 50th, 100th and so on:
/// who sends thousands does not fill the trail, and their number is there.
async fn note(writer: &mut Writer, action: &str, name: &str, origin: &Origin, attempts: u32) -> Result<(), Error> {
    if !is_noted(attempts) {
        return Ok(());
    }
    let detail = json!({ "name": name, "network": origin.network, "failed_attempts_of_network": attempts });
    Ok(audit::append(writer, &Actor::anonymous(), action, "session", &detail).await?)
}

/// Forgets what is a day old; the number of attempts stays in the audit trail.
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
    fn thirty_thousand_attempts_leave_some_rows_and_their_number() {
        let noted: Vec<u32> = (1..=30_000).filter(|attempts| is_noted(*attempts)).collect();
        assert_eq!(noted.len(), 16);
        assert_eq!(noted.last(), Some(&20_000));
    }
}
