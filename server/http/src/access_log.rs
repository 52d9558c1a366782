//! The access log: who saw or exported data of subjects, and who was refused.
//!
//! Every route is logged that is not listed as one without data of subjects, so a new route is, too. Rows of views are
//! gathered and written within a second, repeated ones once a minute with their number; an export is written before it is
//! given out.

use super::AppState;
use super::client_address::ClientAddress;
use crate::problem::Refusal;
use axum::extract::{MatchedPath, RawPathParams, Request, State};
use axum::http::{HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::Response;
use gaitwright_service::access::Caller;
use gaitwright_service::error::Error;
use gaitwright_service::supervise::Task;
use gaitwright_store::access_log::{self, Access, Kind, Tally};
use gaitwright_store::audit::Actor;
use gaitwright_store::{Store, StoreResult, access_spool, commit, now};
use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use uuid::Uuid;

/// Routes that show nothing of a subject.
pub const NO_SUBJECT_DATA: [&str; 28] = [
    "/static/{*path}",
    "/health",
    "/ready",
    "/metrics",
    "/help",
    "/help/{name}",
    "/help/images/{name}",
    "/problems",
    "/problems/{name}",
    "/system",
    "/devices",
    "/devices/{id}",
    "/people",
    "/account",
    "/sign-in",
    "/sign-in/{link}",
    "/sign-out",
    "/api",
    "/api/openapi.json",
    "/api/v1/health",
    "/api/v1/me",
    "/api/v1/sessions",
    "/api/v1/users",
    "/api/v1/tokens",
    "/api/v1/jobs",
    "/api/v1/workers",
    "/api/v1/devices",
    "/api/v1/devices/{id}",
];

/// Routes that give data out when they are posted to.
const EXPORTS_BY_POST: [&str; 2] = ["/system/backup", "/api/v1/backups"];

/// Parts of routes that stand for a secret.
const SECRETS: [&str; 2] = ["{token}", "{link}"];

/// Rows are written at least this often.
const WITHIN: Duration = Duration::from_secs(1);
/// Repetitions of a request are one row in so long.
const REPEATED_WITHIN: Duration = Duration::from_mins(1);
/// Rows written in one transaction: others wait for the writer no longer than these take.
const AT_ONCE: usize = 50;
/// Rows that wait to be written; beyond, refusals of strangers are counted together.
const MOST_WAITING: usize = 1000;
/// Longest address that is kept.
const LONGEST_OBJECT: usize = 300;

/// What is to be written.
#[derive(Debug, Default)]
pub struct AccessLog(Mutex<Waiting>);

#[derive(Debug, Default)]
struct Waiting {
    rows: HashMap<Access, Tally>,
    /// When a row that may be repeated was written.
    written: HashMap<Access, Instant>,
    /// A task will write what waits.
    scheduled: bool,
}

impl AccessLog {
    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        // What waits is whole between any two statements that hold the lock.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Counts an access; whether a task must be started that writes it.
    fn count(&self, mut access: Access) -> bool {
        let mut waiting = self.waiting();
        if waiting.rows.len() >= MOST_WAITING && access.kind == Kind::Refused && !waiting.rows.contains_key(&access) {
            "several".clone_into(&mut access.address);
            "several".clone_into(&mut access.object);
            access.named.clear();
        }
        let at = now();
        let tally = waiting.rows.entry(access).or_insert(Tally { first_at: at, last_at: at, times: 0 });
        (tally.last_at, tally.times) = (at, tally.times.saturating_add(1));
        !std::mem::replace(&mut waiting.scheduled, true)
    }

    /// The rows that are due; all of them, or those that were not written within the last minute.
    fn due(&self, all: bool) -> Vec<(Access, Tally)> {
        let mut waiting = self.waiting();
        let Waiting { rows, written, .. } = &mut *waiting;
        written.retain(|_, at| at.elapsed() < REPEATED_WITHIN);
        let due: Vec<_> = rows.extract_if(|access, _| all || !written.contains_key(access)).collect();
        written.extend(due.iter().map(|(access, _)| (access.clone(), Instant::now())));
        due
    }

    /// Puts back what could not be written.
    fn put_back(&self, rows: &[(Access, Tally)]) {
        let mut waiting = self.waiting();
        for (access, tally) in rows {
            waiting.written.remove(access);
            let there = waiting.rows.entry(access.clone()).or_insert(Tally { times: 0, ..*tally });
            (there.first_at, there.times) = (tally.first_at, there.times.saturating_add(tally.times));
        }
    }

    /// Writes what is due, and what commands noted beside the record.
    ///
    /// # Errors
    /// What the database reports; nothing is lost then.
    pub async fn write(&self, store: &Store, all: bool) -> Result<(), Error> {
        let due = self.due(all);
        for (done, rows) in due.chunks(AT_ONCE).enumerate() {
            if let Err(error) = append(store, rows).await {
                self.put_back(&due[done * AT_ONCE..]);
                return Err(error.into());
            }
        }
        if let Some(spool) = access_spool::take(store.path())? {
            append(store, &spool.noted).await?;
            spool.clear()?;
        }
        Ok(())
    }
}

async fn append(store: &Store, rows: &[(Access, Tally)]) -> StoreResult<()> {
    let mut writer = store.write().await?;
    for (access, tally) in rows {
        access_log::append(&mut writer, access, *tally).await?;
    }
    commit(writer).await
}

/// Writes what waits until nothing waits any more.
async fn keep_writing(app: AppState) {
    loop {
        tokio::time::sleep(WITHIN).await;
        let log = &app.access.log;
        if let Err(error) = log.write(app.store(), false).await {
            tracing::error!(%error, "the access log cannot be written; its rows wait");
        }
        let mut waiting = log.waiting();
        if waiting.rows.is_empty() {
            waiting.scheduled = false;
            return;
        }
    }
}

/// Drops rows that are older than so many days, and again every hour.
///
/// # Errors
/// None: what fails is logged.
pub async fn keep_pruning(store: Store, days: u32, task: Task) -> Result<(), Error> {
    const ROWS: u32 = 500;
    loop {
        task.works();
        let pruned = async {
            let mut writer = store.write().await?;
            let rows = access_log::prune(&mut writer, &Actor::program(), days, ROWS).await?;
            commit(writer).await?;
            StoreResult::Ok(rows)
        };
        match pruned.await {
            Ok(rows) if rows >= u64::from(ROWS) => continue,
            Ok(_) => {}
            Err(error) => tracing::warn!(%error, "the access log cannot be pruned"),
        }
        tokio::time::sleep(Duration::from_hours(1)).await;
    }
}

/// Says who was answered.
pub(super) async fn say_caller(request: Request, next: Next) -> Response {
    let caller = request.extensions().get::<Caller>().cloned();
    let mut answer = next.run(request).await;
    if let Some(caller) = caller {
        answer.extensions_mut().insert(caller);
    }
    answer
}

/// Notes what an answer shows, gives out or refuses. An export is given out only when its row is durable.
pub(super) async fn note(
    State(app): State<AppState>,
    parameters: Result<RawPathParams, axum::extract::rejection::RawPathParamsRejection>,
    request: Request,
    next: Next,
) -> Result<Response, Refusal> {
    let Some(route) = request.extensions().get::<MatchedPath>().map(|route| route.as_str().to_owned()) else {
        return Ok(next.run(request).await);
    };
    let address = request.extensions().get::<ClientAddress>().map(ToString::to_string).unwrap_or_default();
    let has_token = request.headers().contains_key(header::AUTHORIZATION);
    let (method, uri) = (request.method().clone(), request.uri().clone());
    let object = object(&route, uri.path(), uri.query());
    let mut named: Vec<String> = parameters
        .iter()
        .flat_map(|parameters| parameters.iter().map(|(_, value)| value.to_owned()))
        .filter(|_| !route.contains("{link}"))
        .collect();
    named.extend(uuids(&object));
    let answer = next.run(request).await;
    let caller = answer.extensions().get::<Caller>();
    let Some(kind) = kind_of(&route, &method, &answer, has_token || caller.is_some()) else { return Ok(answer) };
    let actor =
        caller.map_or_else(|| Actor::anonymous().as_str().to_owned(), |caller| caller.actor.as_str().to_owned());
    let (method, status) = (method.to_string(), answer.status().as_u16());
    let access = Access { kind, actor, address, method, route, object, status, named };
    if kind == Kind::Export {
        let at = now();
        append(app.store(), &[(access, Tally { first_at: at, last_at: at, times: 1 })]).await?;
    } else if app.access.log.count(access) {
        tokio::spawn(keep_writing(app.clone()));
    }
    Ok(answer)
}

/// What an answer means; `None`: it shows nothing of a subject, or what it did is in the audit trail.
fn kind_of(route: &str, method: &Method, answer: &Response, known: bool) -> Option<Kind> {
    let status = answer.status();
    let signing_in = route.starts_with("/sign-in") && *method == Method::POST;
    if matches!(status, StatusCode::UNAUTHORIZED | StatusCode::FORBIDDEN) && (known || signing_in) {
        return Some(Kind::Refused);
    }
    let shown = status.is_success() || status == StatusCode::NOT_MODIFIED;
    if !shown {
        return None;
    }
    if EXPORTS_BY_POST.contains(&route) && *method == Method::POST {
        return Some(Kind::Export);
    }
    let reads = matches!(*method, Method::GET | Method::HEAD);
    if !reads || NO_SUBJECT_DATA.contains(&route) {
        return None;
    }
    let starts = |name, start: &[u8]| {
        answer.headers().get(name).map(HeaderValue::as_bytes).is_some_and(|v| v.starts_with(start))
    };
    let file = starts(header::CONTENT_DISPOSITION, b"attachment") || starts(header::CONTENT_TYPE, b"text/csv");
    Some(if file { Kind::Export } else { Kind::View })
}

/// The address that was asked for, cut to a length; the route in its place where a part of it is a secret.
fn object(route: &str, path: &str, query: Option<&str>) -> String {
    if SECRETS.iter().any(|secret| route.contains(secret)) {
        return route.to_owned();
    }
    let whole = query.map_or_else(|| path.to_owned(), |query| format!("{path}?{query}"));
    whole.chars().filter(|c| !c.is_control()).take(LONGEST_OBJECT).collect()
}

/// Identifiers in an address.
fn uuids(object: &str) -> Vec<String> {
    let parts = object.split(|c: char| !c.is_ascii_alphanumeric() && c != '-');
    parts.filter(|part| Uuid::parse_str(part).is_ok()).map(str::to_owned).collect()
}
