//! Settings of the service: flags override the environment, which overrides the settings file, which overrides
//! defaults. Each value has its origin.

use super::flag_numbers::workers;
use super::output::data;
use super::scheduled_backups::BackupPlan;
use clap::{Args, Subcommand};
use gaitwright_http::connections::ConnectionLimits;
use gaitwright_http::{NETWORKS, Network, Proxies, ProxyHeaders};
use gaitwright_service::access::sign_in::SessionLimits;
use gaitwright_service::error::Error;
use gaitwright_store::{Store, StoreResult};
use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;
use tracing_subscriber::EnvFilter;

/// The settings file that is read by default.
const DEFAULT_FILE: &str = "gaitwright.toml";

/// The environment variable that names another settings file.
const FILE_VARIABLE: &str = "GAITWRIGHT_CONFIG";

/// Every setting: name in the file, default, meaning. Flag and environment variable derive from the name.
const KNOWN: &[(&str, &str, &str)] = &[
    ("listen", "127.0.0.1:8080", "address and port to listen on"),
    ("database", "gaitwright.db", "SQLite file"),
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
    ("session_hours", "12", "hours after which a session ends in any case"),
    ("tls_certificate", "", "PEM file with the certificate chain; enables HTTPS, with tls_key"),
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
    ("log", "warn,gaitwright=info", "log filter, as in RUST_LOG"),
    ("log_format", "text", "log format: text or json"),
];

/// Flags of every command that reads a record.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct RecordFlags {
    /// TOML settings file (default: GAITWRIGHT_CONFIG, or gaitwright.toml if it exists).
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// SQLite file of the record (default: gaitwright.db).
    #[arg(long, value_name = "FILE")]
    database: Option<String>,
}

/// Flags of every command that verifies or changes a record.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct AnchoredFlags {
    #[command(flatten)]
    record: RecordFlags,
    /// Second anchor file for the newest hashes of the record, preferably on another disk. An empty name means none.
    #[arg(long, value_name = "FILE")]
    anchor: Option<String>,
}

impl From<RecordFlags> for AnchoredFlags {
    fn from(record: RecordFlags) -> Self {
        Self { record, anchor: None }
    }
}

impl From<AnchoredFlags> for Flags {
    fn from(record: AnchoredFlags) -> Self {
        Self { record, ..Self::default() }
    }
}

/// Flags of `serve` and `config show`.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct Flags {
    #[command(flatten)]
    record: AnchoredFlags,
    /// Address and port to listen on (default: 127.0.0.1:8080).
    #[arg(long, value_name = "ADDRESS:PORT")]
    listen: Option<String>,
    /// Folder for scheduled backups, preferably on another disk (default: no backups).
    #[arg(long, value_name = "FOLDER")]
    backup_folder: Option<String>,
    /// Hours between scheduled backups (default: 24).
    #[arg(long, value_name = "HOURS")]
    backup_hours: Option<String>,
    /// Number of scheduled backups to keep (default: 14).
    #[arg(long, value_name = "NUMBER")]
    backup_keep: Option<String>,
    /// Host name of the service, besides its address and localhost; can be repeated.
    #[arg(long, value_delimiter = ',', value_name = "NAME")]
    host_name: Vec<String>,
    /// Number of solves that run in parallel (default: number of cores).
    #[arg(long, value_name = "NUMBER", value_parser = workers, allow_negative_numbers = true)]
    workers: Option<usize>,
    /// NATS broker for remote workers; see `gaitwright worker` (default: solve in this process).
    #[arg(long, value_name = "URL")]
    nats: Option<String>,
    /// Name of this service on the broker (default: gaitwright).
    #[arg(long, value_name = "NAME")]
    nats_queue: Option<String>,
    /// Do not require users to sign in. Allowed only on a loopback address.
    #[arg(long)]
    no_sign_in: bool,
    /// Minutes without a request after which a session ends (default: 60).
    #[arg(long, value_name = "MINUTES")]
    idle_minutes: Option<String>,
    /// Hours after which a session ends even if it is in use (default: 12).
    #[arg(long, value_name = "HOURS")]
    session_hours: Option<String>,
    /// Address or network of a reverse proxy whose headers are trusted; can be repeated.
    #[arg(long, value_delimiter = ',', value_name = "ADDRESS[/BITS]")]
    trusted_proxy: Vec<String>,
    /// Headers of trusted proxies: x-forwarded or forwarded (default: x-forwarded).
    #[arg(long, value_name = "KIND")]
    proxy_headers: Option<String>,
    /// PEM file with the certificate chain; enables HTTPS, with --tls-key.
    #[arg(long, value_name = "FILE")]
    tls_certificate: Option<String>,
    /// PEM file with the private key.
    #[arg(long, value_name = "FILE")]
    tls_key: Option<String>,
}

/// The origin of a value.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Origin {
    Flag,
    Environment(String),
    File(PathBuf),
    Default,
}

impl std::fmt::Display for Origin {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Flag => write!(f, "flag"),
            Self::Environment(name) => write!(f, "environment {name}"),
            Self::File(path) => write!(f, "file {}", path.display()),
            Self::Default => write!(f, "default"),
        }
    }
}

/// Every setting, as text, with its origin.
#[derive(Debug)]
pub(super) struct Settings(BTreeMap<&'static str, (String, Origin)>);

impl Settings {
    /// Reads flags, environment and file.
    pub(super) fn read(flags: &Flags) -> Result<Self, Error> {
        Self::resolve(flags, |name| std::env::var(name).ok())
    }

    fn resolve(flags: &Flags, environment: impl Fn(&str) -> Option<String>) -> Result<Self, Error> {
        let named = flags.record.record.config.clone();
        let (path, file) = match named.or_else(|| environment(FILE_VARIABLE).map(PathBuf::from)) {
            Some(path) => (path.clone(), Some(read(&path)?)),
            None => (
                PathBuf::from(DEFAULT_FILE),
                Path::new(DEFAULT_FILE).exists().then(|| read(Path::new(DEFAULT_FILE))).transpose()?,
            ),
        };
        let file = parse(&path, file.as_deref().unwrap_or(""))?;
        let mut found = BTreeMap::new();
        for &(name, default, _) in KNOWN {
            let variable = format!("GAITWRIGHT_{}", name.to_uppercase());
            let value = if let Some(value) = flags.get(name) {
                (value, Origin::Flag)
            } else if let Some(value) = environment(&variable) {
                (value, Origin::Environment(variable))
            } else if let Some(value) = file.get(name) {
                (value.clone(), Origin::File(path.clone()))
            } else {
                (default.to_owned(), Origin::Default)
            };
            found.insert(name, value);
        }
        Ok(Self(found))
    }

    fn text(&self, name: &str) -> &str {
        self.0.get(name).map_or("", |(value, _)| value)
    }

    fn parsed<T: FromStr>(&self, name: &str, allowed: &str) -> Result<T, Error> {
        self.text(name).parse().map_err(|_| self.refused(name, allowed))
    }

    /// The error for a setting, with its origin.
    pub(super) fn refused(&self, name: &str, allowed: &str) -> Error {
        let origin = self.0.get(name).map_or(&Origin::Default, |(_, origin)| origin);
        Error::invalid(&format!("{name} ({origin})"), self.text(name), allowed)
    }

    pub(super) fn listen(&self) -> Result<SocketAddr, Error> {
        self.parsed("listen", "an address and a port such as 127.0.0.1:8080")
    }

    /// The SQLite file of the record.
    pub(super) fn database(&self) -> PathBuf {
        PathBuf::from(self.text("database"))
    }

    /// The second anchor file.
    pub(super) fn anchor(&self) -> Option<PathBuf> {
        Some(self.text("anchor")).filter(|path| !path.is_empty()).map(PathBuf::from)
    }

    /// Opens the record with its anchors.
    pub(super) async fn open_record(&self) -> StoreResult<Store> {
        Store::open_anchored(&self.database(), self.anchor().as_deref()).await
    }

    /// Scheduled backups, if any.
    pub(super) fn backups(&self) -> Result<Option<BackupPlan>, Error> {
        let hours: u64 = self.parsed("backup_hours", "1 to 8760")?;
        let keep: usize = self.parsed("backup_keep", "1 to 10000")?;
        if !(1..=8760).contains(&hours) {
            return Err(self.refused("backup_hours", "1 to 8760"));
        }
        if !(1..=10_000).contains(&keep) {
            return Err(self.refused("backup_keep", "1 to 10000"));
        }
        let folder = PathBuf::from(self.text("backup_folder"));
        if folder.as_os_str().is_empty() {
            return Ok(None);
        }
        if !folder.is_dir() {
            return Err(self.refused("backup_folder", "an existing folder"));
        }
        Ok(Some(BackupPlan { folder, every: Duration::from_secs(3600 * hours), keep }))
    }

    pub(super) fn workers(&self) -> Result<Option<usize>, Error> {
        match self.text("workers") {
            "cores" => Ok(None),
            _ => match self.parsed("workers", "1 to 64")? {
                workers @ 1..=64 => Ok(Some(workers)),
                _ => Err(self.refused("workers", "1 to 64")),
            },
        }
    }

    /// The broker and the name of the service on it, if any.
    pub(super) fn nats(&self) -> Result<Option<(&str, &str)>, Error> {
        let queue = self.text("nats_queue");
        queue_name(queue).map_err(|_| self.refused("nats_queue", QUEUE_NAMES))?;
        if cfg!(not(feature = "nats")) && !self.text("nats").is_empty() {
            return Err(self.refused("nats", "empty, because this program was built without the feature nats"));
        }
        Ok(Some((self.text("nats"), queue)).filter(|(url, _)| !url.is_empty()))
    }

    pub(super) fn host_names(&self) -> Vec<String> {
        let names = self.text("host_names").split(',').map(str::trim);
        names.filter(|name| !name.is_empty()).map(str::to_owned).collect()
    }

    pub(super) fn sign_in(&self) -> Result<bool, Error> {
        self.parsed("sign_in", "true or false")
    }

    /// When sessions expire.
    pub(super) fn session_limits(&self) -> Result<SessionLimits, Error> {
        let idle_seconds = 60.0 * self.within("idle_minutes", 1.0, 1440.0)?;
        Ok(SessionLimits { idle_seconds, lifetime_seconds: 3600.0 * self.within("session_hours", 1.0, 720.0)? })
    }

    fn within(&self, name: &str, least: f64, most: f64) -> Result<f64, Error> {
        let allowed = format!("{least} to {most}");
        let number: f64 = self.parsed(name, &allowed)?;
        if (least..=most).contains(&number) { Ok(number) } else { Err(self.refused(name, &allowed)) }
    }

    /// The trusted reverse proxies.
    pub(super) fn proxies(&self) -> Result<Proxies, Error> {
        let names = self.text("trusted_proxies").split(',').map(str::trim).filter(|name| !name.is_empty());
        let trusted: Result<Vec<Network>, _> = names.map(str::parse).collect();
        let headers = match self.text("proxy_headers") {
            "x-forwarded" => ProxyHeaders::XForwarded,
            "forwarded" => ProxyHeaders::Forwarded,
            _ => return Err(self.refused("proxy_headers", "x-forwarded or forwarded")),
        };
        Ok(Proxies::new(&trusted.map_err(|_| self.refused("trusted_proxies", NETWORKS))?, headers))
    }

    /// Days for which the access log is kept; `None`: forever.
    pub(super) fn access_log_days(&self) -> Result<Option<u32>, Error> {
        let allowed = "0 to 36500";
        let days: u32 = self.parsed("access_log_days", allowed)?;
        if days <= 36_500 { Ok((days > 0).then_some(days)) } else { Err(self.refused("access_log_days", allowed)) }
    }

    /// Limits of open connections.
    pub(super) fn connections(&self) -> Result<ConnectionLimits, Error> {
        let number = |name: &str| {
            let allowed = "1 to 60000";
            let number = self.parsed(name, allowed)?;
            if (1..=60_000).contains(&number) { Ok(number) } else { Err(self.refused(name, allowed)) }
        };
        Ok(ConnectionLimits { total: number("connections")?, per_address: number("connections_per_address")? })
    }

    /// Free space that is kept in reserve.
    pub(super) fn reserve_bytes(&self) -> Result<u64, Error> {
        const ALLOWED: &str = "0 to 1000000";
        match self.parsed::<u64>("reserve_mb", ALLOWED)? {
            mb @ 0..=1_000_000 => Ok(mb << 20),
            _ => Err(self.refused("reserve_mb", ALLOWED)),
        }
    }

    /// Certificate and key, both or neither.
    pub(super) fn tls(&self) -> Result<Option<(PathBuf, PathBuf)>, Error> {
        match (self.text("tls_certificate"), self.text("tls_key")) {
            ("", "") => Ok(None),
            ("", _) => Err(self.refused("tls_certificate", "a file, because tls_key is set")),
            (_, "") => Err(self.refused("tls_key", "a file, because tls_certificate is set")),
            _ if cfg!(not(feature = "tls")) => {
                Err(self.refused("tls_certificate", "empty, because this program was built without the feature tls"))
            }
            (certificate, key) => Ok(Some((certificate.into(), key.into()))),
        }
    }

    /// Prints every setting, its value and its origin.
    pub(super) fn show(&self) -> Result<(), Error> {
        for &(name, _, meaning) in KNOWN {
            let origin = self.0.get(name).map(|(_, origin)| origin.to_string()).unwrap_or_default();
            let value = without_password(self.text(name));
            data(&format!("{name} = {value:?}  # {origin}; {meaning}"))?;
        }
        Ok(())
    }

    /// The log filter, and whether the log is JSON.
    pub(super) fn log(&self) -> Result<(EnvFilter, bool), Error> {
        let allowed = "a list of targets and levels such as warn,gaitwright=info";
        let filter = EnvFilter::try_new(self.text("log")).map_err(|_| self.refused("log", allowed))?;
        match self.text("log_format") {
            "text" => Ok((filter, false)),
            "json" => Ok((filter, true)),
            _ => Err(self.refused("log_format", "text or json")),
        }
    }
}

impl Flags {
    /// The flags of a worker.
    pub(super) fn of_broker(config: Option<PathBuf>, nats: Option<String>, nats_queue: Option<String>) -> Self {
        Self { record: RecordFlags { config, database: None }.into(), nats, nats_queue, ..Self::default() }
    }

    fn get(&self, name: &str) -> Option<String> {
        match name {
            "listen" => self.listen.clone(),
            "database" => self.record.record.database.clone(),
            "anchor" => self.record.anchor.clone(),
            "backup_folder" => self.backup_folder.clone(),
            "backup_hours" => self.backup_hours.clone(),
            "backup_keep" => self.backup_keep.clone(),
            "host_names" => Some(self.host_name.join(",")).filter(|names| !names.is_empty()),
            "workers" => self.workers.map(|workers| workers.to_string()),
            "nats" => self.nats.clone(),
            "nats_queue" => self.nats_queue.clone(),
            "sign_in" => self.no_sign_in.then(|| "false".to_owned()),
            "idle_minutes" => self.idle_minutes.clone(),
            "session_hours" => self.session_hours.clone(),
            "trusted_proxies" => Some(self.trusted_proxy.join(",")).filter(|proxies| !proxies.is_empty()),
            "proxy_headers" => self.proxy_headers.clone(),
            "tls_certificate" => self.tls_certificate.clone(),
            "tls_key" => self.tls_key.clone(),
            _ => None,
        }
    }
}

/// Names that NATS accepts for a stream and as the first part of a subject.
const QUEUE_NAMES: &str = "1 to 60 letters, digits, - or _";

/// Checks the name of a service on a broker.
fn queue_name(text: &str) -> Result<String, String> {
    let known = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if (1..=60).contains(&text.len()) && text.chars().all(known) {
        Ok(text.to_owned())
    } else {
        Err(QUEUE_NAMES.to_owned())
    }
}

/// Environment variables that look like settings of this program but are not. They get a warning, not an error:
/// Kubernetes announces services in variables that may start with our prefix.
pub(super) fn unknown_variables(names: impl Iterator<Item = String>) -> Vec<String> {
    let is_known = |name: &str| name == "CONFIG" || KNOWN.iter().any(|(known, ..)| known.to_uppercase() == *name);
    let mut unknown: Vec<String> =
        names.filter(|name| name.strip_prefix("GAITWRIGHT_").is_some_and(|rest| !is_known(rest))).collect();
    unknown.sort();
    unknown
}

/// The address without the user and password in it.
fn without_password(text: &str) -> String {
    let Some((scheme, rest)) = text.split_once("://") else { return text.to_owned() };
    match rest.rsplit_once('@') {
        Some((_, host)) => format!("{scheme}://...@{host}"),
        None => text.to_owned(),
    }
}

fn read(path: &Path) -> Result<String, Error> {
    std::fs::read_to_string(path).map_err(|e| Error::Malformed(format!("Cannot read {}: {e}.", path.display())))
}

fn parse(path: &Path, text: &str) -> Result<BTreeMap<String, String>, Error> {
    let malformed = |reason: String| Error::Malformed(format!("{}: {reason}", path.display()));
    let table: toml::Table = text.parse().map_err(|e: toml::de::Error| malformed(e.to_string()))?;
    let mut values = BTreeMap::new();
    for (name, value) in table {
        if !KNOWN.iter().any(|(known, ..)| *known == name) {
            let known = KNOWN.iter().map(|(known, ..)| *known).collect::<Vec<_>>().join(", ");
            return Err(malformed(format!("{name} is not a setting. Settings: {known}.")));
        }
        let value = match value {
            toml::Value::String(text) => text,
            toml::Value::Integer(number) => number.to_string(),
            toml::Value::Float(number) => number.to_string(),
            toml::Value::Boolean(flag) => flag.to_string(),
            _ => return Err(malformed(format!("{name} must be a string, a number or true/false."))),
        };
        values.insert(name, value);
    }
    Ok(values)
}

/// `gaitwright config`.
#[derive(Debug, Args)]
pub(super) struct Config {
    #[command(subcommand)]
    what: ConfigCommand,
}

#[derive(Debug, Subcommand)]
enum ConfigCommand {
    /// Show every setting of `gaitwright serve`, its value and where the value comes from.
    Show {
        #[command(flatten)]
        flags: Box<Flags>,
    },
}

impl Config {
    pub(super) fn flags(&self) -> Flags {
        let ConfigCommand::Show { flags } = &self.what;
        (**flags).clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(flags: &Flags, environment: &[(&str, &str)]) -> Result<Settings, Error> {
        Settings::resolve(flags, |name| {
            environment.iter().find(|(known, _)| *known == name).map(|(_, value)| (*value).to_owned())
        })
    }

    #[test]
    fn flags_come_before_environment_before_file_before_defaults() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("g.toml");
        std::fs::write(&file, "workers = 3\nidle_minutes = 15\ndatabase = \"file.db\"\n").unwrap();
        let record = RecordFlags { config: Some(file.clone()), database: None };
        let flags = Flags { record: record.into(), workers: Some(5), ..Flags::default() };
        let found = settings(&flags, &[("GAITWRIGHT_WORKERS", "4"), ("GAITWRIGHT_DATABASE", "env.db")]).unwrap();
        assert_eq!(found.workers().unwrap(), Some(5));
        assert_eq!(found.0["workers"].1, Origin::Flag);
        assert_eq!(found.0["database"], ("env.db".to_owned(), Origin::Environment("GAITWRIGHT_DATABASE".to_owned())));
        assert_eq!(found.0["idle_minutes"], ("15".to_owned(), Origin::File(file)));
        assert_eq!(found.0["listen"].1, Origin::Default);
        assert_eq!(
            found.session_limits().unwrap(),
            SessionLimits { idle_seconds: 900.0, lifetime_seconds: 12.0 * 3600.0 }
        );
    }

    #[test]
    fn invalid_values_are_refused_with_their_origin() {
        let settings_of = settings(&Flags::default(), &[("GAITWRIGHT_WORKERS", "0")]).unwrap();
        let refused = settings_of.workers().unwrap_err().to_string();
        assert!(refused.contains("GAITWRIGHT_WORKERS") && refused.contains("1 to 64"), "{refused}");
        let half = Flags { tls_key: Some("k.pem".to_owned()), ..Flags::default() };
        assert!(settings(&half, &[]).unwrap().tls().is_err());
        assert!(parse(Path::new("x.toml"), "colour = 1").unwrap_err().to_string().contains("colour is not a setting"));
        assert!(parse(Path::new("x.toml"), "workers = [1]").is_err());
        assert!(parse(Path::new("x.toml"), "workers = ").is_err());
        let dotted = Flags { nats_queue: Some("a.b".to_owned()), ..Flags::default() };
        assert!(settings(&dotted, &[]).unwrap().nats().unwrap_err().to_string().contains("letters, digits"));
    }

    #[test]
    fn backup_settings_out_of_range_are_refused() {
        for (name, value) in [("HOURS", "0"), ("HOURS", "1.5"), ("KEEP", "0"), ("FOLDER", "/no such folder")] {
            let name = format!("GAITWRIGHT_BACKUP_{name}");
            let refused = settings(&Flags::default(), &[(&name, value)]).unwrap().backups().unwrap_err().to_string();
            assert!(refused.contains(&name), "{refused}");
        }
        assert!(settings(&Flags::default(), &[]).unwrap().backups().unwrap().is_none());
    }

    #[test]
    fn invalid_log_settings_are_refused() {
        let with =
            |name, value| settings(&Flags::default(), &[(name, value)]).unwrap().log().map_err(|e| e.to_string());
        assert!(with("GAITWRIGHT_LOG_FORMAT", "json").unwrap().1);
        let refused = with("GAITWRIGHT_LOG_FORMAT", "xml").unwrap_err();
        assert!(refused.contains("GAITWRIGHT_LOG_FORMAT") && refused.contains("text or json"), "{refused}");
        let refused = with("GAITWRIGHT_LOG", "gaitwright=loud").unwrap_err();
        assert!(refused.contains("gaitwright=loud") && refused.contains("targets and levels"), "{refused}");
    }

    #[test]
    fn unknown_environment_variables_are_found() {
        let names = ["GAITWRIGHT_WORKER", "GAITWRIGHT_WORKERS", "GAITWRIGHT_CONFIG", "HOME"];
        assert_eq!(unknown_variables(names.into_iter().map(str::to_owned)), ["GAITWRIGHT_WORKER"]);
    }

    proptest::proptest! {
        #[test]
        fn any_settings_file_is_read_or_refused(text in "[a-z_]{0,12} ?=? ?\\PC{0,40}", bytes in "\\PC{0,200}") {
            let _ = parse(Path::new("x.toml"), &text);
            let _ = parse(Path::new("x.toml"), &bytes);
            let _ = parse(Path::new("x.toml"), &format!("listen = {bytes:?}"));
        }
    }

    #[test]
    fn passwords_in_addresses_are_hidden() {
        assert_eq!(without_password("nats://lab:s3@cret@broker:4222"), "nats://...@broker:4222");
        assert_eq!(without_password("nats://broker:4222"), "nats://broker:4222");
        assert_eq!(without_password("warn,gaitwright=info"), "warn,gaitwright=info");
    }
}
