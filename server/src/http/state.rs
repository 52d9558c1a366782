//! What every handler can reach.

use super::host::Hosts;
use crate::store::{Reader, Store, StoreResult, Writer};
use crate::studies::director::Director;

/// What every handler can reach.
#[derive(Debug, Clone)]
pub struct AppState {
    /// Runs the studies.
    pub director: Director,
    /// The names that the service answers to.
    pub hosts: Hosts,
}

impl AppState {
    /// The record.
    pub fn store(&self) -> &Store {
        self.director.store()
    }

    /// A connection to read with.
    ///
    /// # Errors
    /// When none can be had.
    pub async fn read(&self) -> StoreResult<Reader> {
        self.store().read().await
    }

    /// A write transaction.
    ///
    /// # Errors
    /// When none can be begun.
    pub async fn write(&self) -> StoreResult<Writer> {
        self.store().write().await
    }
}
