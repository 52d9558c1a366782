//! What waits to be solved, what is being solved, and by whom.

use crate::AppState;
use crate::may::May;
use crate::problem::Refusal;
use axum::Json;
use axum::extract::State;
use gaitwright_service::access::{Reach, Read};
use gaitwright_store::jobs::{self, Job};
use serde::Serialize;
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// Jobs listed at most.
const MOST: u32 = 1000;

/// `GET`: the jobs that are not done, of studies that the caller reaches, in the order of queueing, at most 1000 of them.
#[utoipa::path(
    get,
    path = "/jobs",
    operation_id = "list_jobs",
    tag = "operation",
    responses((status = 200, description = "Those that are not done", body = Vec<Job>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn list(may: May<Read>, State(app): State<AppState>) -> Result<Json<Vec<Job>>, Refusal> {
    Ok(Json(jobs::open(&mut *app.read().await?, may.caller.reach(), MOST).await?))
}

/// Who solves.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Workers {
    /// How many solves can run at the same time.
    pub(crate) places: usize,
    /// Solves by the name of the worker that runs them.
    pub(crate) at_work: BTreeMap<String, u32>,
}

impl Workers {
    pub(crate) async fn read(app: &AppState) -> Result<Self, Refusal> {
        let mut at_work = BTreeMap::new();
        // Names of workers alone: they say nothing of a study.
        for worker in
            jobs::open(&mut *app.read().await?, Reach::Every, MOST).await?.into_iter().filter_map(|job| job.worker)
        {
            *at_work.entry(worker).or_default() += 1;
        }
        Ok(Self { places: app.scheduler.workers(), at_work })
    }
}

/// `GET`: who solves at the moment. A worker behind a broker is known while it has a job.
#[utoipa::path(
    get,
    path = "/workers",
    operation_id = "list_workers",
    tag = "operation",
    responses((status = 200, description = "Who solves", body = Workers)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn workers(_: May<Read>, State(app): State<AppState>) -> Result<Json<Workers>, Refusal> {
    Ok(Json(Workers::read(&app).await?))
}
