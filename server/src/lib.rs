//! Gaitwright: a preference-learning tuning service for walking gaits of powered prostheses.

// What a command says goes through `cli::output`, which knows readers that went away and disks that are full.
#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

pub mod cli;
