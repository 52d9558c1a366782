//! The workers of the service, for the page *System* and for REST.

use crate::shared_state::AppState;
use gaitwright_store::{StoreResult, jobs};
use serde::Serialize;
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// Workers of the service.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Workers {
    /// Number of solves that can run in parallel.
    pub(crate) places: usize,
    /// Number of running solves by worker.
    pub(crate) at_work: BTreeMap<String, u32>,
}

impl Workers {
    pub(crate) async fn read(app: &AppState) -> StoreResult<Self> {
        // Names of workers reveal nothing about studies.
        let at_work = jobs::by_worker(&mut *app.read().await?).await?;
        Ok(Self { places: app.scheduler.workers(), at_work })
    }
}
