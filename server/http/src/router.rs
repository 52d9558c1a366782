//! The router: all routes, and the layers around them.

use super::{
    AppState, access_log_layer, api, authentication, client_address, compression, described_parameters, host_header,
    metrics, openapi, page_error, pages, responses, same_origin, saved_as, static_files,
};
use crate::problem_details::Refusal;
use axum::Router;
use axum::extract::{DefaultBodyLimit, Request};
use axum::http::{HeaderName, HeaderValue, StatusCode, header};
use axum::middleware;
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use gaitwright_service::error::Error;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::set_header::SetResponseHeaderLayer;
use tower_http::timeout::TimeoutLayer;
use tower_http::trace::TraceLayer;
use utoipa_axum::router::OpenApiRouter;

/// Allows content from this origin only, without inline scripts, inline styles and frames.
const CONTENT_SECURITY_POLICY: &str = "default-src 'self'; img-src 'self' data:; object-src 'none'; base-uri 'none'; \
                                       form-action 'self'; frame-ancestors 'none'";

/// Every route.
pub fn router(state: AppState) -> Router {
    let (api, _) = OpenApiRouter::new().nest("/api/v1", api::routes()).split_for_parts();
    let routes = Router::new()
        .merge(pages::routes(&state))
        .route("/health", get(api::health::get))
        .merge(api.route_layer(middleware::from_fn(described_parameters::check)))
        .route("/api/openapi.json", get(description))
        .route("/metrics", get(metrics::get))
        .route("/ready", get(api::health::ready))
        .route("/static/{*path}", get(static_files::get))
        .fallback(page_error::no_such_page)
        .method_not_allowed_fallback(page_error::no_such_method);
    with_layers(routes, state)
}

/// Adds the common layers: authentication, checks of host and origin, time-outs, problem documents, security headers.
pub fn with_layers(routes: Router<AppState>, state: AppState) -> Router {
    let header = |name: HeaderName, value: &'static str| {
        SetResponseHeaderLayer::if_not_present(name, HeaderValue::from_static(value))
    };
    routes
        .layer(middleware::from_fn(saved_as::name))
        .layer(middleware::from_fn(access_log_layer::add_caller))
        .layer(middleware::from_fn_with_state(state.clone(), authentication::identify))
        .layer(middleware::from_fn_with_state(state.clone(), access_log_layer::note))
        .layer(middleware::from_fn_with_state(state.clone(), metrics::count))
        .layer(middleware::from_fn(same_origin::check))
        .layer(middleware::from_fn_with_state(state.hosts.clone(), host_header::check))
        .layer(TimeoutLayer::with_status_code(StatusCode::SERVICE_UNAVAILABLE, state.slowest_answer))
        // The whole body is in memory before a handler reads it.
        .layer(DefaultBodyLimit::disable())
        .layer(CatchPanicLayer::custom(responses::after_panic))
        .layer(TraceLayer::new_for_http().make_span_with(|_: &Request| tracing::Span::current()).on_failure(()))
        .layer(middleware::from_fn_with_state(state.clone(), client_address::note))
        .layer(middleware::from_fn(responses::complete))
        // Outside the layer above, which gives failures another body.
        .layer(compression::layer())
        .layer(header(header::CONTENT_SECURITY_POLICY, CONTENT_SECURITY_POLICY))
        .layer(header(header::X_CONTENT_TYPE_OPTIONS, "nosniff"))
        .layer(header(header::REFERRER_POLICY, "same-origin"))
        .layer(header(header::X_FRAME_OPTIONS, "DENY"))
        .layer(header(header::CACHE_CONTROL, "no-store"))
        .layer(header(HeaderName::from_static("cross-origin-opener-policy"), "same-origin"))
        .layer(header(HeaderName::from_static("cross-origin-resource-policy"), "same-origin"))
        .layer(header(HeaderName::from_static("permissions-policy"), "camera=(), geolocation=(), microphone=()"))
        .with_state(state)
}

/// `GET /api/openapi.json`.
async fn description() -> Result<Response, Refusal> {
    let text = openapi::text().map_err(|e| Error::Internal(e.to_string()))?;
    Ok(([(header::CONTENT_TYPE, "application/json")], text).into_response())
}
