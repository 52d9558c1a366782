//! Logs: to stderr. `RUST_LOG` or the setting `log` decides how much, `log_format` how.

use super::output::tell;
use crate::error::Error;
use tracing_subscriber::EnvFilter;

/// Begins to log.
///
/// # Errors
/// [`Error::Invalid`] when `RUST_LOG` cannot be read.
pub(super) fn start(filter: EnvFilter, json: bool) -> Result<(), Error> {
    let filter = match std::env::var(EnvFilter::DEFAULT_ENV) {
        Ok(text) => EnvFilter::try_new(&text).map_err(|_| {
            Error::invalid(EnvFilter::DEFAULT_ENV, text, "targets and levels such as warn,gaitwright=info")
        })?,
        Err(_) => filter,
    };
    let builder = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr);
    let started = if json { builder.json().try_init() } else { builder.with_target(false).try_init() };
    if let Err(error) = started {
        tell(&format!("gaitwright: no logs: {error}"));
    }
    Ok(())
}
