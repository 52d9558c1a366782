//! Logs: to stderr. `RUST_LOG` or the setting `log` decides how much, `log_format` how.

use super::output::tell;
use tracing_subscriber::EnvFilter;

pub(super) fn start(filter: &str, json: bool) {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(filter));
    let builder = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr);
    let started = if json { builder.json().try_init() } else { builder.with_target(false).try_init() };
    if let Err(error) = started {
        tell(&format!("gaitwright: no logs: {error}"));
    }
}
