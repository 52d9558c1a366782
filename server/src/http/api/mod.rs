//! REST under `/api/v1`: one file per resource.

pub mod health;

use super::AppState;
use axum::Router;

/// Every route below `/api/v1`.
pub fn routes() -> Router<AppState> {
    Router::new()
}
