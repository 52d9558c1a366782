//! The HTTP interface: REST under `/api/v1`, pages, static files.

#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

pub mod access_log_layer;
mod accessible;
pub mod api;
mod attachment;
mod authentication;
mod authorization;
mod blind_motion;
mod body_limits;
mod body_measures;
mod bound_units;
mod client_address;
mod compression;
pub mod connections;
mod csv_response;
mod described_parameters;
mod entity_tag;
mod extractors;
mod figures;
mod form_errors;
mod format;
mod forwarded;
mod host_header;
mod idempotent;
pub mod known_browser;
mod metrics;
mod network;
pub mod openapi;
mod openapi_binary;
mod openapi_dependent_rules;
mod openapi_descriptions;
mod openapi_nulls;
mod openapi_rules;
mod openapi_schemas;
mod openapi_settings;
mod openapi_solver_settings;
pub mod page_error;
pub mod pages;
mod paging;
mod problem_details;
mod problem_kinds;
mod qr_code;
mod query_string;
mod readiness;
mod request_body;
pub mod request_counts;
mod resources;
mod responded_to;
mod responses;
mod router;
mod same_origin;
mod saved_as;
mod shared_state;
mod static_files;
mod study_listener;
mod units;
pub mod unwritten_access;
mod visible;

pub use client_address::ClientAddress;
pub use forwarded::{Proxies, ProxyHeaders};
pub use host_header::{Hosts, is_loopback_name};
pub use network::{NETWORKS, Network};
pub use router::{router, with_layers};
pub use shared_state::{AccessState, AppState};
