//! `gaitwright doctor` names what is wrong, and fails only then.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_store::{Store, access_clock, commit};
use gaitwright_tests::broker::Broker;
use gaitwright_tests::cli;
use gaitwright_tests::every_table::filled;
use sqlx::sqlite::SqliteConnection;
use sqlx::{AssertSqlSafe, Connection};
use std::path::Path;

/// Its exit code, and its lines.
fn doctor(folder: &Path, arguments: &[&str]) -> (Option<i32>, Vec<String>) {
    let arguments: Vec<&str> = ["doctor"].iter().chain(arguments).copied().collect();
    let output = cli::run(env!("CARGO_BIN_EXE_gaitwright-cli"), folder, &arguments);
    let text = String::from_utf8(output.stdout).unwrap();
    (output.status.code(), text.lines().map(str::to_owned).collect())
}

/// The only error of a run, which fails.
#[track_caller]
fn only_error((code, lines): (Option<i32>, Vec<String>)) -> String {
    assert_eq!(code, Some(1), "{lines:?}");
    let mut errors = lines.iter().filter(|line| line.starts_with("error "));
    let found = errors.next().expect("an error").clone();
    assert!(errors.next().is_none(), "{lines:?}");
    found
}

async fn change(database: &Path, sql: &str) {
    let mut connection = SqliteConnection::connect(database.to_str().unwrap()).await.unwrap();
    sqlx::query(AssertSqlSafe(sql.to_owned())).execute(&mut connection).await.unwrap();
    connection.close().await.unwrap();
}

#[test]
fn doctor_describes_a_machine_without_a_record_and_creates_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (code, lines) = doctor(folder.path(), &[]);
    assert_eq!(code, Some(0), "{lines:?}");
    let said: Vec<&str> = lines.iter().map(|line| line.split_whitespace().nth(1).unwrap()).collect();
    assert_eq!(said, ["program", "kernels", "settings", "disk", "record", "clock", "broker"]);
    assert!(lines.iter().all(|line| line.starts_with("ok ")), "{lines:?}");
    assert!(lines[4].contains("no record yet at"), "{lines:?}");
    assert!(cli::files(folder.path()).is_empty());
}

#[tokio::test]
async fn doctor_reports_a_clock_that_was_set_back() {
    let (folder, database) = filled().await;
    let (code, lines) = doctor(folder.path(), &["--database", "a.db"]);
    assert_eq!(code, Some(0), "{lines:?}");
    assert!(lines[4].contains("a.db is intact"), "{lines:?}");
    let store = Store::open(&database).await.unwrap();
    let mut writer = store.write().await.unwrap();
    access_clock::reach(&mut writer, "2099-01-01T00:00:00.000Z".parse().unwrap()).await.unwrap();
    commit(writer).await.unwrap();
    store.close().await;
    let clock = only_error(doctor(folder.path(), &["--database", "a.db"]));
    assert!(clock.contains("clock") && clock.contains("was set back"), "{clock}");
}

#[tokio::test]
async fn doctor_reports_a_changed_row() {
    let (folder, database) = filled().await;
    change(&database, "update subjects set notes = 'forged'").await;
    let record = only_error(doctor(folder.path(), &["--database", "a.db"]));
    assert!(record.contains("record") && record.contains("of subjects was changed"), "{record}");
}

#[test]
fn doctor_reports_an_unreachable_broker_and_a_missing_folder() {
    let folder = tempfile::tempdir().unwrap();
    let broker = only_error(doctor(folder.path(), &["--nats", "nats://127.0.0.1:1"]));
    assert!(broker.contains("The NATS broker failed"), "{broker}");
    let disk = only_error(doctor(folder.path(), &["--database", "no/such/a.db"]));
    assert!(disk.contains("does not exist"), "{disk}");
}

#[test]
fn doctor_reports_the_version_of_a_reachable_broker() {
    let Some(broker) = Broker::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    // The process may not listen yet.
    let found = (0..100).map(|_| doctor(folder.path(), &["--nats", &broker.url()])).find(|(code, _)| *code == Some(0));
    assert!(found.unwrap().1[6].contains("with JetStream"));
}

#[test]
fn doctor_names_settings_with_which_the_service_does_not_start() {
    let folder = tempfile::tempdir().unwrap();
    for (flags, named) in [
        (&["--listen", "nonsense"][..], "listen"),
        (&["--backup-folder", "missing"], "backup_folder"),
        (&["--anchor", "missing/anchor"], "anchor"),
        (&["--tls-certificate", "missing", "--tls-key", "missing"], "tls_certificate"),
    ] {
        let found = only_error(doctor(folder.path(), flags));
        assert!(found.starts_with("error") && found.contains(named), "{found}");
    }
}

#[test]
fn doctor_prints_no_password_of_a_refused_setting() {
    let folder = tempfile::tempdir().unwrap();
    let (code, lines) = doctor(folder.path(), &["--nats", "http://lab:s3cret@broker:4222"]);
    assert_eq!(code, Some(1), "{lines:?}");
    assert!(!lines.join("\n").contains("s3cret"), "{lines:?}");
}
