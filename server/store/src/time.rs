//! Instants of the record: RFC 3339 in UTC with milliseconds, sortable as text.

use serde::{Deserialize, Serialize};
use sqlx::encode::IsNull;
use sqlx::error::BoxDynError;
use sqlx::{Decode, Encode, Sqlite, Type};
use std::fmt;
use std::str::FromStr;
use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant as Steady, SystemTime};
use utoipa::ToSchema;

/// A time in UTC (RFC 3339).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
#[schema(value_type = String, format = DateTime)]
#[serde(try_from = "String", into = "String")]
pub struct Instant(jiff::Timestamp);

/// The clock of this process, in milliseconds.
struct ClockState {
    /// An instant, and the steady time at which it was current.
    anchor: (i64, Steady),
    /// The latest instant that was given.
    latest: i64,
}

impl ClockState {
    /// Starts at the machine's clock.
    fn start(machine: i64) -> Self {
        Self { anchor: (machine, Steady::now()), latest: machine.saturating_sub(1) }
    }

    /// The instant of the anchor plus the time that has passed since.
    fn passed(&self) -> i64 {
        let (start, since) = self.anchor;
        start.saturating_add(i64::try_from(since.elapsed().as_millis()).unwrap_or(i64::MAX))
    }
}

static CLOCK: Mutex<Option<ClockState>> = Mutex::new(None);
/// Milliseconds that [`set_machine_clock`] adds to the clock of the machine.
static SET_BY_MS: AtomicI64 = AtomicI64::new(0);

fn machine_ms() -> i64 {
    jiff::Timestamp::now().as_millisecond().saturating_add(SET_BY_MS.load(Ordering::Relaxed))
}

/// The current time of the server, for all rows. Later than every earlier instant of this process, and than those in
/// the record that it opened and in the archives that it imported, so that the order of times is the order of recording
/// even if the machine's clock is set back or that of another machine was ahead. Time passes all the same.
pub fn now() -> Instant {
    let machine = machine_ms();
    let mut clock = CLOCK.lock().unwrap_or_else(PoisonError::into_inner);
    let clock = clock.get_or_insert_with(|| ClockState::start(machine));
    let passed = clock.passed();
    if machine > passed {
        clock.anchor = (machine, Steady::now());
    }
    clock.latest = machine.max(passed).max(clock.latest.saturating_add(1));
    Instant(jiff::Timestamp::from_millisecond(clock.latest).unwrap_or(jiff::Timestamp::MAX))
}

/// Makes every later [`now`] later than an instant.
pub(crate) fn never_before(instant: Instant) {
    let least = instant.0.as_millisecond();
    let mut clock = CLOCK.lock().unwrap_or_else(PoisonError::into_inner);
    let clock = clock.get_or_insert_with(|| ClockState::start(machine_ms()));
    if clock.latest < least {
        clock.anchor = (clock.passed().max(least), Steady::now());
        clock.latest = least;
    }
}

/// Sets the clock of the machine ahead or back for this process, as tests of a wrong clock do.
#[doc(hidden)]
pub fn set_machine_clock(by_seconds: i64) {
    SET_BY_MS.store(by_seconds.saturating_mul(1000), Ordering::Relaxed);
}

impl Instant {
    /// The time of a file, if it is within the range of the record.
    pub fn of_file(time: SystemTime) -> Option<Self> {
        jiff::Timestamp::try_from(time).ok().map(Self)
    }

    /// Adds seconds, without change on overflow.
    #[must_use]
    pub fn plus_seconds(self, seconds: i64) -> Self {
        Self(self.0.checked_add(jiff::SignedDuration::from_secs(seconds)).unwrap_or(self.0))
    }

    /// Adds a duration, without change on overflow.
    #[must_use]
    pub fn after(self, time: Duration) -> Self {
        Self(self.0.checked_add(time).unwrap_or(self.0))
    }

    /// Seconds from `earlier` to this instant.
    pub fn seconds_since(self, earlier: Self) -> f64 {
        self.0.duration_since(earlier.0).as_secs_f64()
    }

    /// `2026-11-20 14:03`, UTC, for pages.
    pub fn minute(self) -> String {
        self.0.strftime("%Y-%m-%d %H:%M").to_string()
    }
}

impl fmt::Display for Instant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.3}", self.0)
    }
}

impl FromStr for Instant {
    type Err = jiff::Error;
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        text.parse().map(Self)
    }
}

impl TryFrom<String> for Instant {
    type Error = jiff::Error;
    fn try_from(text: String) -> Result<Self, Self::Error> {
        text.parse()
    }
}

impl From<Instant> for String {
    fn from(instant: Instant) -> Self {
        instant.to_string()
    }
}

impl Type<Sqlite> for Instant {
    fn type_info() -> sqlx::sqlite::SqliteTypeInfo {
        <String as Type<Sqlite>>::type_info()
    }
}

impl Encode<'_, Sqlite> for Instant {
    fn encode_by_ref(&self, buffer: &mut <Sqlite as sqlx::Database>::ArgumentBuffer) -> Result<IsNull, BoxDynError> {
        <String as Encode<'_, Sqlite>>::encode(self.to_string(), buffer)
    }
}

impl Decode<'_, Sqlite> for Instant {
    fn decode(value: <Sqlite as sqlx::Database>::ValueRef<'_>) -> Result<Self, BoxDynError> {
        Ok(<&str as Decode<'_, Sqlite>>::decode(value)?.parse()?)
    }
}
