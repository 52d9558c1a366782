//! Gaitwright: a preference-learning tuning service for walking gaits of powered prostheses.
//!
//! Arrows point down: [`cli`] -> `http` -> [`access`], [`studies`] -> [`workers`], [`store`].

// What a command says goes through `cli::output`, which knows readers that went away and disks that are full.
#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

pub mod access;
pub mod cli;
pub mod compute;
mod csv_table;
mod document;
pub mod error;
mod gait_charts;
mod gait_series;
mod gait_table;
pub mod http;
pub mod plots;
mod printable;
pub mod store;
pub mod studies;
pub mod supervise;
pub mod workers;
