//! The table of contents of the HTTP face.

use super::{AppState, BODY_LIMIT_BYTES, api, host, pages, same_origin, static_files};
use axum::Router;
use axum::extract::DefaultBodyLimit;
use axum::http::{HeaderName, HeaderValue, header};
use axum::middleware;
use axum::routing::get;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::set_header::SetResponseHeaderLayer;
use tower_http::trace::TraceLayer;

/// Everything comes from this origin; no inline scripts, no inline styles, no frames.
const CONTENT_SECURITY_POLICY: &str = "default-src 'self'; img-src 'self' data:; object-src 'none'; base-uri 'none'; \
                                       form-action 'self'; frame-ancestors 'none'";

/// Every route.
pub fn router(state: AppState) -> Router {
    let header = |name: HeaderName, value: &'static str| {
        SetResponseHeaderLayer::if_not_present(name, HeaderValue::from_static(value))
    };
    Router::new()
        .merge(pages::routes())
        .route("/health", get(api::health::get))
        .nest("/api/v1", api::routes())
        .route("/static/{*path}", get(static_files::get))
        .fallback(pages::error::no_such_page)
        .method_not_allowed_fallback(pages::error::no_such_method)
        .layer(middleware::from_fn(same_origin::check))
        .layer(middleware::from_fn_with_state(state.hosts.clone(), host::check))
        .layer(middleware::from_fn(pages::error::problems_as_pages))
        .layer(DefaultBodyLimit::max(BODY_LIMIT_BYTES))
        .layer(CatchPanicLayer::new())
        .layer(header(header::CONTENT_SECURITY_POLICY, CONTENT_SECURITY_POLICY))
        .layer(header(header::X_CONTENT_TYPE_OPTIONS, "nosniff"))
        .layer(header(header::REFERRER_POLICY, "same-origin"))
        .layer(header(header::X_FRAME_OPTIONS, "DENY"))
        .layer(TraceLayer::new_for_http())
        .with_state(state)
}
