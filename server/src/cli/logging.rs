//! Logs: to stderr, `RUST_LOG` decides how much, `GAITWRIGHT_LOG_FORMAT=json` how.

use super::output::tell;
use tracing_subscriber::EnvFilter;

pub(super) fn start() {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("warn,gaitwright=info"));
    let builder = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr);
    let started = if std::env::var("GAITWRIGHT_LOG_FORMAT").is_ok_and(|format| format == "json") {
        builder.json().try_init()
    } else {
        builder.with_target(false).try_init()
    };
    if let Err(error) = started {
        tell(&format!("gaitwright: no logs: {error}"));
    }
}
