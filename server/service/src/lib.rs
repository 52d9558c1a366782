//! Gaitwright without HTTP: access control ([`access`]), the rules of studies and the tuning loop ([`studies`]), and
//! the engines that solve ([`workers`]).
//!
//! Arrows point down: [`access`], [`studies`] -> [`workers`] -> the record.

#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

pub mod access;
pub mod backups;
pub mod dispatch_error;
pub mod error;
pub mod expired_data;
pub mod job;
pub mod json_document;
pub mod printable;
pub mod scheduled_backups;
pub mod studies;
pub mod study_notices;
pub mod supervise;
pub mod workers;
