//! Starts logging to stderr, with the filter from `RUST_LOG` or the setting `log`.

use super::output::tell;
use gaitwright_service::error::Error;
use std::io::IsTerminal;
use tracing_subscriber::EnvFilter;

/// Starts logging.
///
/// # Errors
/// [`Error::Invalid`] when `RUST_LOG` cannot be read.
pub(super) fn start(filter: EnvFilter, json: bool) -> Result<(), Error> {
    let filter = match std::env::var(EnvFilter::DEFAULT_ENV) {
        Ok(text) => EnvFilter::try_new(&text).map_err(|_| {
            Error::invalid(EnvFilter::DEFAULT_ENV, text, "a list of targets and levels such as warn,gaitwright=info")
        })?,
        Err(_) => filter,
    };
    // No colours in files and pipes, nor with NO_COLOR (https://no-color.org).
    let colours = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
    let builder = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(std::io::stderr)
        .with_ansi(colours)
        // Such an error would go to stderr, which cannot be written then.
        .log_internal_errors(false);
    let started = if json { builder.json().try_init() } else { builder.with_target(false).try_init() };
    if let Err(error) = started {
        tell(&format!("gaitwright: cannot start logging: {error}"));
    }
    Ok(())
}
