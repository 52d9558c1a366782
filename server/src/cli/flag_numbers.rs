//! Parsers of numbers on the command line. Errors name the allowed range.

use gaitwright_service::studies::seed::MAX_SEED;
use std::fmt::Display;
use std::str::FromStr;

/// Maximum number of parallel solves.
const MAX_WORKERS: usize = 64;

pub(super) fn workers(text: &str) -> Result<usize, String> {
    whole(text, 1, MAX_WORKERS)
}

pub(super) fn trials(text: &str) -> Result<u32, String> {
    whole(text, 1, 10_000)
}

pub(super) fn seed(text: &str) -> Result<u64, String> {
    whole(text, 0, MAX_SEED)
}

pub(super) fn iterations(text: &str) -> Result<usize, String> {
    whole(text, 1, 1_000_000)
}

pub(super) fn subject(text: &str) -> Result<u32, String> {
    text.parse().map_err(|_| "must be 1 or 2".to_owned())
}

/// Days after which something is deleted.
pub(super) fn days(text: &str) -> Result<u32, String> {
    whole(text, 1, 36_500)
}

pub(super) fn local_optimum(text: &str) -> Result<usize, String> {
    text.trim().parse().map_err(|_| "must be a whole number".to_owned())
}

pub(super) fn filter_order(text: &str) -> Result<usize, String> {
    text.trim().parse().map_err(|_| "must be 2, 4, 6 or 8".to_owned())
}

pub(super) fn number(text: &str) -> Result<f64, String> {
    text.trim().parse().map_err(|_| "must be a number".to_owned())
}

pub(super) fn whole<T: FromStr + PartialOrd + Display + Copy>(text: &str, least: T, most: T) -> Result<T, String> {
    match text.trim().parse::<T>() {
        Ok(value) if value >= least && value <= most => Ok(value),
        _ => Err(format!("must be a whole number from {least} to {most}")),
    }
}
