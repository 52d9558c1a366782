//! Gaitwright: a preference-learning tuning service for walking gaits of powered prostheses.
//!
//! Arrows point down: [`cli`] -> `http` -> [`access`], [`studies`] -> [`workers`], [`store`].

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

pub mod access;
pub mod cli;
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
pub mod workers;
