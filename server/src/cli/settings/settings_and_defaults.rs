//! Every setting of the service.

/// Every setting: name in the file, default, meaning. The environment variable derives from the name.
pub(super) const KNOWN: &[(&str, &str, &str)] = &[
    ("listen", "127.0.0.1:8080", "address and port to listen on"),
    ("database", "gaitwright.db", "SQLite file of the record"),
    ("anchor", "", "second anchor file, preferably on another disk; the first one is next to the database"),
    ("backup_folder", "", "folder for scheduled backups, preferably on another disk; empty: no backups"),
    ("backup_hours", "24", "hours between scheduled backups"),
    ("backup_keep", "14", "number of scheduled backups to keep"),
    ("host_names", "", "comma-separated host names of the service, besides its address and localhost"),
    ("workers", "cores", "number of solves that run in parallel; with nats, the total of all workers"),
    ("nats", "", "NATS broker for remote workers, nats://HOST:PORT; empty: solve in this process"),
    ("nats_queue", "gaitwright", "name of this service on the broker; its workers must use the same name"),
    ("sign_in", "true", "whether users and programs must sign in; false only on a loopback address"),
    ("idle_minutes", "60", "minutes without a request after which a session ends"),
    ("session_hours", "12", "hours after which a session ends even if it is in use"),
    ("tls_certificate", "", "PEM file with the certificate chain; HTTPS needs this file and tls_key"),
    ("tls_key", "", "PEM file with the private key"),
    ("trusted_proxies", "", "comma-separated addresses and networks of reverse proxies whose headers are trusted"),
    (
        "proxy_headers",
        "x-forwarded",
        "headers of the trusted proxies: x-forwarded (X-Forwarded-For, -Proto, -Host) or forwarded",
    ),
    ("connections", "1000", "maximum number of open connections, if the system has enough file descriptors"),
    ("connections_per_address", "100", "maximum number of connections from one address; trusted proxies are exempt"),
    ("access_log_days", "0", "days for which rows of the access log are kept; 0: forever"),
    ("reserve_mb", "500", "free disk space, MB, below which no new study or solve starts"),
    (
        "notify_program",
        "",
        "program to run as PROGRAM STUDY STATE when a study finishes, stops, pauses or waits for an answer; empty: none",
    ),
    ("log", "warn,gaitwright=info", "log filter, as in RUST_LOG"),
    ("log_format", "text", "log format: text or json"),
];

/// Environment variables that look like settings of this program but are not. They get a warning, not an error:
/// Kubernetes announces services in variables that may start with our prefix.
pub(in crate::cli) fn unknown_variables(names: impl Iterator<Item = String>) -> Vec<String> {
    let is_known = |name: &str| name == "CONFIG" || KNOWN.iter().any(|(known, ..)| known.to_uppercase() == *name);
    let mut unknown: Vec<String> =
        names.filter(|name| name.strip_prefix("GAITWRIGHT_").is_some_and(|rest| !is_known(rest))).collect();
    unknown.sort();
    unknown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_environment_variables_are_found() {
        let names = ["GAITWRIGHT_WORKER", "GAITWRIGHT_WORKERS", "GAITWRIGHT_CONFIG", "HOME"];
        assert_eq!(unknown_variables(names.into_iter().map(str::to_owned)), ["GAITWRIGHT_WORKER"]);
    }
}
