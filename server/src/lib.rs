//! Gaitwright tunes walking gaits for powered prostheses by preference learning.

// Commands print through `cli::output`, which handles closed pipes and full disks.
#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

pub mod cli;
