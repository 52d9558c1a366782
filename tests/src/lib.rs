//! Shared parts of the whole-system tests: an analytic solver in place of the real one, a service on a temporary
//! record, the command line as a process. The tests live in `tests/tests`.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::missing_panics_doc)]

pub mod analytic;
pub mod archives;
pub mod bodies_from_schema;
pub mod broker;
pub mod callers;
pub mod certified;
pub mod cli;
pub mod client;
pub mod compatibility;
pub mod consistent_gaits;
pub mod described;
pub mod engine_without_workers;
pub mod every_table;
pub mod explained;
pub mod imports;
pub mod large;
pub mod measured;
pub mod page_routes;
pub mod read_allocations;
pub mod scripted;
pub mod serve_process;
pub mod service;
pub mod simulated;
pub mod sources;
pub mod users;
pub mod well_formed;
