//! The layer that writes the access log: views and exports of subjects' data, and refusals.
//!
//! It logs every route except those listed as free of subject data, so a new route is logged by default. A change is
//! also a view, because its response shows the changed object. Views are collected and written within a second, and
//! repeated views once a minute with their number. An export is written before the response is sent.

use super::AppState;
use super::client_address::ClientAddress;
use crate::problem_details::Refusal;
use axum::extract::{MatchedPath, RawPathParams, Request, State};
use axum::http::{HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::Response;
use gaitwright_service::access::Caller;
use gaitwright_service::error::Error;
use gaitwright_service::studies::walkable;
use gaitwright_service::supervise::Task;
use gaitwright_store::access_log::{self, Access, AccessKind, Tally};
use gaitwright_store::audit::Actor;
use gaitwright_store::{Store, StoreResult, TrialId, commit, now};
use std::time::Duration;
use uuid::Uuid;

/// Routes that show no subject data.
pub const NO_SUBJECT_DATA: [&str; 36] = [
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
    "/users",
    "/account",
    "/sign-in",
    "/sign-in/{link}",
    "/sign-out",
    "/api",
    "/api/openapi.json",
    "/api/v1/health",
    "/api/v1/me",
    "/api/v1/sessions",
    "/api/v1/sessions/{id}/end",
    "/api/v1/users",
    "/api/v1/users/{id}",
    "/api/v1/users/{id}/disable",
    "/api/v1/users/{id}/enable",
    "/api/v1/users/{id}/link",
    "/api/v1/users/{id}/role",
    "/api/v1/tokens",
    "/api/v1/tokens/{id}",
    "/api/v1/tokens/{id}/revoke",
    "/api/v1/jobs",
    "/api/v1/workers",
    "/api/v1/devices",
    "/api/v1/devices/{id}",
];

/// POST routes that export data.
const EXPORTS_BY_POST: [&str; 2] = ["/system/backup", "/api/v1/backups"];

/// Path parameters that are secrets.
const SECRETS: [&str; 2] = ["{code}", "{link}"];

/// Longest time until a row is written.
const MAX_WRITE_DELAY: Duration = Duration::from_secs(1);
/// Maximum length of a logged address.
const MAX_OBJECT: usize = 300;

/// The trials of a response that must not be sent after any of their gaits was reported as unsafe. An extension of the
/// response.
#[derive(Debug, Clone)]
pub(crate) struct OnlyWhileWalkable(pub(crate) Vec<TrialId>);

/// Writes the row of an export. The same transaction decides whether the gaits in it are still walkable, so the file of
/// a gait is not sent after a report about it was acknowledged.
async fn append_export(store: &Store, access: &Access, of: Option<&OnlyWhileWalkable>) -> Result<(), Error> {
    let mut writer = store.write().await?;
    for &trial in of.iter().flat_map(|of| &of.0) {
        walkable::admit(&mut writer, trial).await??;
    }
    let at = now();
    let tally = Tally { first_at: at, last_at: at, times: 1 };
    access_log::append(&mut writer, &[(access.clone(), tally)]).await?;
    Ok(commit(writer).await?)
}

/// Writes pending rows, as a background task of the service.
async fn keep_writing(app: AppState) {
    let scheduler = app.scheduler.clone();
    scheduler.keep("writing the access log", |task| write_pending_rows(app.clone(), task)).await;
}

async fn write_pending_rows(app: AppState, task: Task) -> Result<(), Error> {
    let mut failing = false;
    loop {
        tokio::time::sleep(MAX_WRITE_DELAY).await;
        match app.access.log.write(app.store(), false).await {
            Ok(()) => {
                task.works();
                failing = false;
            }
            // The record accepts no changes, which `/ready` reports. The rows are kept, and the failure is logged once.
            Err(error) if error.is_of_machine() => {
                if !std::mem::replace(&mut failing, true) {
                    tracing::error!(%error, "cannot write the access log; keeping its rows");
                }
            }
            Err(error) => return Err(error),
        }
    }
}

/// Deletes rows older than `days` days, every hour.
///
/// # Errors
/// None: failures are logged.
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
            Err(error) => tracing::warn!(%error, "cannot prune the access log"),
        }
        tokio::time::sleep(Duration::from_hours(1)).await;
    }
}

/// Adds the caller to the response, for [`note`].
pub(super) async fn add_caller(request: Request, next: Next) -> Response {
    let caller = request.extensions().get::<Caller>().cloned();
    let mut response = next.run(request).await;
    if let Some(caller) = caller {
        response.extensions_mut().insert(caller);
    }
    response
}

/// Logs what a response shows, exports or refuses. An export is sent only after its row is durable.
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
    let parameters = parameters.iter().flat_map(|parameters| parameters.iter().map(|(_, value)| value));
    let mut named: Vec<String> = parameters.filter(|_| !route.contains("{link}")).flat_map(named_in).collect();
    // Taken from the whole query, because `object` is truncated.
    let query: Vec<(String, String)> =
        uri.query().and_then(|query| serde_urlencoded::from_str(query).ok()).unwrap_or_default();
    named.extend(query.iter().flat_map(|(_, value)| identifiers(value)));
    let response = next.run(request).await;
    // The identifier of a new object.
    if let Some(location) = response.headers().get(header::LOCATION).and_then(|location| location.to_str().ok()) {
        named.extend(identifiers(location));
    }
    let caller = response.extensions().get::<Caller>();
    let names_object = named.iter().any(|name| Uuid::try_parse(name).is_ok());
    let Some(kind) = kind_of(&route, &method, &response, has_token || caller.is_some(), names_object) else {
        return Ok(response);
    };
    let actor =
        caller.map_or_else(|| Actor::anonymous().as_str().to_owned(), |caller| caller.actor.as_str().to_owned());
    let (method, status) = (method.to_string(), response.status().as_u16());
    let access = Access { kind, actor, address, method, route, object, status, named };
    if kind == AccessKind::Export {
        append_export(app.store(), &access, response.extensions().get()).await?;
    } else if app.access.log.count(access) {
        tokio::spawn(keep_writing(app.clone()));
    }
    Ok(response)
}

/// The kind of access. `None` if the response shows no subject data, or refuses a request without a known caller.
///
/// An object that the caller may not see is not found, so 404 is a refusal where the request names an object.
fn kind_of(route: &str, method: &Method, response: &Response, known: bool, names_object: bool) -> Option<AccessKind> {
    let status = response.status();
    let signing_in = route.starts_with("/sign-in") && *method == Method::POST;
    if matches!(status, StatusCode::UNAUTHORIZED | StatusCode::FORBIDDEN) && (known || signing_in) {
        return Some(AccessKind::Refused);
    }
    if status == StatusCode::NOT_FOUND && known && names_object && !NO_SUBJECT_DATA.contains(&route) {
        return Some(AccessKind::Refused);
    }
    let starts = |name, start: &[u8]| {
        response.headers().get(name).map(HeaderValue::as_bytes).is_some_and(|v| v.starts_with(start))
    };
    // A refused form is shown again, with the page around it.
    let again = matches!(status, StatusCode::CONFLICT | StatusCode::UNPROCESSABLE_ENTITY)
        && starts(header::CONTENT_TYPE, b"text/html");
    if !status.is_success() && status != StatusCode::NOT_MODIFIED && !again {
        return None;
    }
    if EXPORTS_BY_POST.contains(&route) && *method == Method::POST {
        return Some(AccessKind::Export).filter(|_| !again);
    }
    if status == StatusCode::NO_CONTENT || NO_SUBJECT_DATA.contains(&route) {
        return None;
    }
    let file = starts(header::CONTENT_DISPOSITION, b"attachment") || starts(header::CONTENT_TYPE, b"text/csv");
    Some(if file { AccessKind::Export } else { AccessKind::View })
}

/// The requested address, truncated; the route instead if the address contains a secret.
fn object(route: &str, path: &str, query: Option<&str>) -> String {
    if SECRETS.iter().any(|secret| route.contains(secret)) {
        return route.to_owned();
    }
    let whole = query.map_or_else(|| path.to_owned(), |query| format!("{path}?{query}"));
    whole.chars().filter(|c| !c.is_control()).take(MAX_OBJECT).collect()
}

/// Objects that a path parameter names: the identifiers in it as they stand in the record, or else the text itself, such as
/// a token.
fn named_in(parameter: &str) -> Vec<String> {
    let found: Vec<String> = identifiers(parameter).collect();
    if found.is_empty() { vec![parameter.to_owned()] } else { found }
}

/// The identifiers in a text, in the spelling of the record.
fn identifiers(text: &str) -> impl Iterator<Item = String> {
    let parts = text.split(|c: char| !c.is_ascii_alphanumeric() && !matches!(c, '-' | '{' | '}' | ':'));
    parts.filter_map(|part| {
        // `certificate-` and the identifier of a trial is that of a job.
        let end = part.len().checked_sub(36).and_then(|at| part.get(at..)).unwrap_or(part);
        Uuid::try_parse(part).or_else(|_| Uuid::try_parse(end)).ok().map(|id| id.hyphenated().to_string())
    })
}

#[cfg(test)]
mod tests {
    use super::identifiers;

    #[test]
    fn identifiers_are_found_in_every_spelling() {
        let id = "01a21581-2b1b-7470-8a46-cd8569799078";
        let (upper, simple) = (id.to_uppercase(), id.replace('-', ""));
        for text in [
            id.to_owned(),
            upper,
            simple,
            format!("{{{id}}}"),
            format!("urn:uuid:{id}"),
            format!("certificate-{id}"),
            format!("/api/v1/trials/{id}"),
        ] {
            assert_eq!(identifiers(&text).collect::<Vec<_>>(), [id], "{text}");
        }
        assert_eq!(identifiers(&format!("{id},{id}")).count(), 2);
        assert_eq!(identifiers("trials, 12 of them").count(), 0);
    }
}
