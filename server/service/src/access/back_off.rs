//! Sign-in back-off: each failed attempt doubles the wait before another password for the same name is checked. Failures
//! count separately for the network of the client, for the site that a network belongs to, and for all networks together.
//! The wait of all networks is short, so that an attacker cannot lock a user out. Browsers in which the user signed in
//! earlier have counts of their own. Counts are in the record, so they survive a restart.

use crate::error::Error;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::sign_in_failures::{self as failures, Failures};
use gaitwright_store::{Instant, UserId, Writer};
use serde_json::json;
use std::time::Duration;

/// The waits of one count.
#[derive(Debug, Clone, Copy)]
struct Limit {
    /// Number of failures without a wait, because people mistype.
    free: u32,
    /// The longest wait.
    longest: Duration,
}

const NETWORK: Limit = Limit { free: 3, longest: Duration::from_mins(15) };
const SITE: Limit = Limit { free: 6, longest: Duration::from_mins(15) };
/// Allows one guess each ten seconds. An attacker uses these up only with a guess from another site each time: one site
/// has four guesses an hour.
const ALL_NETWORKS_LIMIT: Limit = Limit { free: 50, longest: Duration::from_secs(10) };
/// Source of the failures of all networks.
const ALL_NETWORKS: &str = "*";
/// Number of names of one network that are counted separately; further names share a count.
const MAX_NAMES: u32 = 1000;
/// Time after the last failure until failures are forgotten.
const REMEMBERED_SECONDS: i64 = 24 * 3600;
/// Key of the shared count. No name contains a line break.
const OTHER_NAMES: &str = "\n";

/// Where a sign-in comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AttemptOrigin {
    /// The network of the client.
    pub network: String,
    /// The larger network that may belong to the same client, if any.
    pub site: Option<String>,
    /// The user who signed in earlier in the same browser. Failures of others do not affect this user.
    pub known: Option<UserId>,
}

/// A stored count of failures.
#[derive(Debug)]
struct Count {
    name: String,
    source: String,
    limit: Limit,
}

/// An attempt whose password may be checked.
#[derive(Debug)]
#[must_use]
pub struct PasswordAttempt {
    name: String,
    counts: Vec<Count>,
    origin: AttemptOrigin,
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
    origin: AttemptOrigin,
) -> Result<Result<PasswordAttempt, Duration>, Error> {
    prune(writer, now).await?;
    let name = normal(name);
    let mut own = Count::of_origin(&name, &origin);
    let mut is_new_name = own.failures(writer).await?.is_none();
    if is_new_name && origin.known.is_none() {
        let network = failures::of_network(writer, &origin.network).await?;
        if network.is_some_and(|network| network.names >= MAX_NAMES) {
            OTHER_NAMES.clone_into(&mut own.name);
            is_new_name = own.failures(writer).await?.is_none();
        }
    }
    let attempts = failures::count(writer, &origin.network, now, is_new_name).await?;
    let mut counts = vec![own];
    if let Some(user) = origin.known {
        // Somebody who has the cookie of such a browser gets no more guesses than somebody with many networks.
        counts.push(Count { name: name.clone(), source: format!("{ALL_NETWORKS} {user}"), limit: ALL_NETWORKS_LIMIT });
    } else {
        counts.extend(origin.site.clone().map(|site| Count { name: name.clone(), source: site, limit: SITE }));
        counts.push(Count { name: name.clone(), source: ALL_NETWORKS.to_owned(), limit: ALL_NETWORKS_LIMIT });
    }
    let mut wait = 0.0_f64;
    for count in &counts {
        let found = count.failures(writer).await?;
        wait = wait.max(found.map_or(0.0, |found| found.waits_until.seconds_since(now)));
    }
    if wait > 0.0 {
        note(writer, "sign_in.delay", &name, &origin, attempts).await?;
        return Ok(Err(Duration::from_secs_f64(wait)));
    }
    for count in &counts {
        let before = count.failures(writer).await?.map_or(0, |found| found.count);
        count.set(writer, now, before.saturating_add(1)).await?;
    }
    Ok(Ok(PasswordAttempt { name, counts, origin, attempts }))
}

impl PasswordAttempt {
    /// Records a wrong password and starts the wait.
    ///
    /// # Errors
    /// Errors of the database.
    pub async fn failed(self, writer: &mut Writer, now: Instant) -> Result<(), Error> {
        for count in &self.counts {
            let counted = count.failures(writer).await?.map_or(1, |found| found.count);
            count.set(writer, now, counted).await?;
        }
        note(writer, "sign_in.refused", &self.name, &self.origin, self.attempts).await
    }

    /// Records a correct password and clears the counts of this name. The shared count stays, or anyone with an account
    /// could clear that of their guesses at other names.
    ///
    /// # Errors
    /// Errors of the database.
    pub async fn succeeded(self, writer: &mut Writer) -> Result<(), Error> {
        for count in self.counts.iter().filter(|count| count.name != OTHER_NAMES) {
            failures::forget(writer, &count.name, &count.source).await?;
        }
        Ok(failures::remove(writer, &self.origin.network).await?)
    }
}

impl Count {
    /// The count of a network, or of a browser in which the user signed in earlier.
    fn of_origin(name: &str, origin: &AttemptOrigin) -> Self {
        let source = match origin.known {
            Some(user) => format!("{} {user}", origin.network),
            None => origin.network.clone(),
        };
        Self { name: name.to_owned(), source, limit: NETWORK }
    }

    async fn failures(&self, writer: &mut Writer) -> Result<Option<Failures>, Error> {
        Ok(failures::find(writer, &self.name, &self.source).await?)
    }

    async fn set(&self, writer: &mut Writer, now: Instant, count: u32) -> Result<(), Error> {
        let failures = Failures { count, waits_until: now.after(self.limit.wait_after(count)) };
        Ok(failures::set(writer, &self.name, &self.source, now, failures).await?)
    }
}

impl Limit {
    fn wait_after(self, failures: u32) -> Duration {
        match failures.checked_sub(self.free) {
            None | Some(0) => Duration::ZERO,
            Some(more) => Duration::from_secs(1 << more.min(10)).min(self.longest),
        }
    }
}

/// Normalises a name for counting: lower case, without characters that names cannot have.
fn normal(name: &str) -> String {
    name.to_lowercase().chars().filter(|c| !c.is_control()).take(80).collect()
}

/// Writes a row of the audit trail for the first attempts of a network, then for the 10th, 20th, 50th, 100th and so on,
/// so that thousands of attempts do not fill the trail.
async fn note(
    writer: &mut Writer,
    change: &str,
    name: &str,
    origin: &AttemptOrigin,
    attempts: u32,
) -> Result<(), Error> {
    if !is_recorded(attempts) {
        return Ok(());
    }
    let detail = json!({ "name": name, "network": origin.network, "failed_attempts_of_network": attempts });
    Ok(audit::append(writer, &Actor::anonymous(), change, "session", &detail).await?)
}

/// Deletes counts that are a day old. The audit trail keeps the number of attempts.
async fn prune(writer: &mut Writer, now: Instant) -> Result<(), Error> {
    for source in failures::prune(writer, now.plus_seconds(-REMEMBERED_SECONDS)).await? {
        let detail = json!({
            "network": source.network, "failed_attempts": source.attempts, "names": source.names,
            "first_at": source.first_at, "last_at": source.last_at,
        });
        if source.attempts > 0 {
            audit::append(writer, &Actor::program(), "sign_in.failures", "session", &detail).await?;
        }
    }
    Ok(())
}

fn is_recorded(attempts: u32) -> bool {
    let mut leading = attempts;
    while leading >= 10 && leading.is_multiple_of(10) {
        leading /= 10;
    }
    attempts <= 5 || matches!(leading, 1 | 2 | 5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_double_after_the_free_failures_up_to_the_longest() {
        let waits = |limit: Limit, from: u32| [0, 1, 2, 3, 4].map(|more| limit.wait_after(from + more).as_secs());
        assert_eq!(waits(NETWORK, 3), [0, 2, 4, 8, 16]);
        assert_eq!(waits(SITE, 6), [0, 2, 4, 8, 16]);
        assert_eq!(waits(ALL_NETWORKS_LIMIT, 50), [0, 2, 4, 8, 10]);
        assert_eq!(NETWORK.wait_after(u32::MAX), Duration::from_mins(15));
    }

    #[test]
    fn thirty_thousand_attempts_leave_few_rows_with_their_number() {
        let recorded: Vec<u32> = (1..=30_000).filter(|attempts| is_recorded(*attempts)).collect();
        assert_eq!(recorded.len(), 16);
        assert_eq!(recorded.last(), Some(&20_000));
    }
}
