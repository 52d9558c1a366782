//! Prometheus metrics: totals of the record, and counts and durations of requests.

use super::AppState;
use super::authorization::Authorized;
use crate::problem_details::Refusal;
use crate::request_counts::{BUCKETS, Requests};
use axum::extract::{MatchedPath, Request, State};
use axum::http::{Method, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use gaitwright_service::access::Read;
use gaitwright_store::totals;
use std::fmt::Write;
use std::time::Instant;

/// Counts and times a request by its route. Addresses would give unlimited labels.
pub(super) async fn count(State(app): State<AppState>, request: Request, next: Next) -> Response {
    let route = request.extensions().get::<MatchedPath>().map_or("none", MatchedPath::as_str).to_owned();
    let method = named(request.method()).to_owned();
    let begun = Instant::now();
    let response = next.run(request).await;
    app.requests.add(method, route, response.status(), begun.elapsed().as_secs_f64());
    response
}

/// The label of a method. Unknown methods share one, because clients can invent any number.
fn named(method: &Method) -> &str {
    let known = [Method::GET, Method::HEAD, Method::POST, Method::PUT, Method::PATCH, Method::DELETE, Method::OPTIONS];
    if known.contains(method) { method.as_str() } else { "other" }
}

/// `GET /metrics`.
pub(super) async fn get(_: Authorized<Read>, State(app): State<AppState>) -> Result<Response, Refusal> {
    let totals = totals::read(&mut *app.read().await?).await?;
    let mut text = String::new();
    for (name, label, meaning, rows) in [
        ("gaitwright_studies", "state", "Studies by state", &totals.studies),
        ("gaitwright_trials", "state", "Trials by state", &totals.trials),
        ("gaitwright_solve_jobs", "state", "Solves by state", &totals.solve_jobs),
    ] {
        line(&mut text, format_args!("# HELP {name} {meaning}\n# TYPE {name} gauge"));
        for (state, count) in rows {
            line(&mut text, format_args!("{name}{{{label}=\"{state}\"}} {count}"));
        }
    }
    for (name, meaning, value) in [
        ("gaitwright_workers", "Number of solves that can run in parallel", app.scheduler.workers() as f64),
        (
            "gaitwright_solves_running",
            "Number of solves running in this process",
            app.scheduler.running_solves().running() as f64,
        ),
        ("gaitwright_database_bytes", "Size of the record", totals.bytes as f64),
        ("gaitwright_oldest_queued_seconds", "Waiting time of the oldest queued solve", totals.oldest_queued_seconds),
    ] {
        line(&mut text, format_args!("# HELP {name} {meaning}\n# TYPE {name} gauge\n{name} {value}"));
    }
    if let Some(backups) = app.backups.scheduled() {
        let name = "gaitwright_scheduled_backup_failed";
        let failed = u8::from(backups.failure().is_some());
        let meaning = "1 if the last scheduled backup failed";
        line(&mut text, format_args!("# HELP {name} {meaning}\n# TYPE {name} gauge\n{name} {failed}"));
    }
    requests(&mut text, &app.requests);
    Ok(([(header::CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")], text).into_response())
}

fn requests(text: &mut String, requests: &Requests) {
    let name = "gaitwright_request_seconds";
    line(text, format_args!("# HELP {name} Duration of requests by route\n# TYPE {name} histogram"));
    for ((method, route, status), timed) in requests.map().iter() {
        let labels = format!("method=\"{method}\",route=\"{route}\",status=\"{status}\"");
        for (end, within) in BUCKETS.iter().zip(timed.within) {
            line(text, format_args!("{name}_bucket{{{labels},le=\"{end}\"}} {within}"));
        }
        line(text, format_args!("{name}_bucket{{{labels},le=\"+Inf\"}} {}", timed.count));
        line(text, format_args!("{name}_sum{{{labels}}} {}", timed.seconds));
        line(text, format_args!("{name}_count{{{labels}}} {}", timed.count));
    }
}

fn line(text: &mut String, line: std::fmt::Arguments<'_>) {
    // Writing to a String cannot fail.
    let _ = writeln!(text, "{line}");
}
