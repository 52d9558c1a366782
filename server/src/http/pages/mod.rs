//! Pages for people: rendered on the server, usable without scripts.

pub mod error;
pub mod home;

use super::AppState;
use axum::Router;
use axum::routing::get;

/// Every page.
pub fn routes() -> Router<AppState> {
    Router::new().route("/", get(home::get))
}
