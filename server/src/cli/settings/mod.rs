//! Settings of the service: flags override the environment, which overrides the settings file, which overrides
//! defaults. Each value has its origin.

mod flags;
mod setting_origin;
mod settings_and_defaults;
mod settings_file;
mod values;
mod without_password;

pub(super) use flags::{AnchoredFlags, Flags, RecordFlags};
pub(super) use without_password::without_password;

use gaitwright_service::error::Error;
use setting_origin::SettingOrigin;
use settings_and_defaults::KNOWN;
pub(super) use settings_and_defaults::unknown_variables;
use settings_file::{parse, read};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// The settings file that is read by default.
const DEFAULT_FILE: &str = "gaitwright.toml";

/// The environment variable that names another settings file.
const FILE_VARIABLE: &str = "GAITWRIGHT_CONFIG";

/// Every setting, as text, with its origin.
#[derive(Debug)]
pub(super) struct Settings(BTreeMap<&'static str, (String, SettingOrigin)>);

impl Settings {
    /// Reads flags, environment and file.
    pub(super) fn read(flags: &Flags) -> Result<Self, Error> {
        Self::resolve(flags, |name| std::env::var(name).ok())
    }

    /// Reads flags and environment, without a file.
    pub(super) fn without_file(flags: &Flags) -> Self {
        Self::of(flags, |name| std::env::var(name).ok(), Path::new(DEFAULT_FILE), &BTreeMap::new())
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
        Ok(Self::of(flags, environment, &path, &file))
    }

    fn of(
        flags: &Flags,
        environment: impl Fn(&str) -> Option<String>,
        path: &Path,
        file: &BTreeMap<String, String>,
    ) -> Self {
        let mut found = BTreeMap::new();
        for &(name, default, _) in KNOWN {
            let variable = format!("GAITWRIGHT_{}", name.to_uppercase());
            let value = if let Some(value) = flags.get(name) {
                (value, SettingOrigin::Flag)
            } else if let Some(value) = environment(&variable) {
                (value, SettingOrigin::Environment(variable))
            } else if let Some(value) = file.get(name) {
                (value.clone(), SettingOrigin::File(path.to_owned()))
            } else {
                (default.to_owned(), SettingOrigin::Default)
            };
            found.insert(name, value);
        }
        Self(found)
    }

    fn text(&self, name: &str) -> &str {
        self.0.get(name).map_or("", |(value, _)| value)
    }

    fn parsed<T: FromStr>(&self, name: &str, allowed: &str) -> Result<T, Error> {
        self.text(name).parse().map_err(|_| self.refused(name, allowed))
    }

    /// The error for a setting, with its origin.
    pub(super) fn refused(&self, name: &str, allowed: &str) -> Error {
        let origin = self.0.get(name).map_or(&SettingOrigin::Default, |(_, origin)| origin);
        Error::invalid(&format!("{name} ({origin})"), without_password(self.text(name)), allowed)
    }

    /// Every setting: its name, value, origin and meaning.
    pub(super) fn entries(&self) -> impl Iterator<Item = (&'static str, &str, String, &'static str)> {
        KNOWN.iter().map(|&(name, _, meaning)| {
            let origin = self.0.get(name).map(|(_, origin)| origin.to_string()).unwrap_or_default();
            (name, self.text(name), origin, meaning)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gaitwright_service::access::session::SessionLimits;

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
        assert_eq!(found.0["workers"].1, SettingOrigin::Flag);
        assert_eq!(
            found.0["database"],
            ("env.db".to_owned(), SettingOrigin::Environment("GAITWRIGHT_DATABASE".to_owned()))
        );
        assert_eq!(found.0["idle_minutes"], ("15".to_owned(), SettingOrigin::File(file)));
        assert_eq!(found.0["listen"].1, SettingOrigin::Default);
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
        let secret = "workers = 2\nnats = \"nats://u:SECRET@x\n";
        let broken = parse(Path::new("x.toml"), secret).unwrap_err().to_string();
        assert!(broken.contains("line 2, column ") && !broken.contains("SECRET"), "{broken}");
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

    proptest::proptest! {
        #[test]
        fn any_settings_file_is_read_or_refused(text in "[a-z_]{0,12} ?=? ?\\PC{0,40}", bytes in "\\PC{0,200}") {
            let _ = parse(Path::new("x.toml"), &text);
            let _ = parse(Path::new("x.toml"), &bytes);
            let _ = parse(Path::new("x.toml"), &format!("listen = {bytes:?}"));
        }
    }
}
