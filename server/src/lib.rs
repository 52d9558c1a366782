//! Gaitwright: a preference-learning tuning service for walking gaits of powered prostheses.

// Commands print through `cli::output`, which handles closed pipes and full disks.
#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

pub mod cli;
