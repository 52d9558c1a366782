//! `gaitwright doctor` names what is wrong, and fails only then.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_store::{Store, access_clock, commit};
use gaitwright_tests::broker::Broker;
use gaitwright_tests::cli;
use gaitwright_tests::every_table::filled;
use gaitwright_tests::serve_process::Process;
use skipped_tests::skipped;
use sqlx::sqlite::SqliteConnection;
use sqlx::{AssertSqlSafe, Connection};
use std::path::Path;
use std::process::Command;
use std::time::{Duration, SystemTime};

const BINARY: &str = env!("CARGO_BIN_EXE_gaitwright-cli");

/// Its exit code, and its lines. It checks any free port, unless the arguments name an address.
fn doctor(folder: &Path, arguments: &[&str]) -> (Option<i32>, Vec<String>) {
    let address: &[&str] = if arguments.contains(&"--listen") { &[] } else { &["--listen", "127.0.0.1:0"] };
    let arguments: Vec<&str> = ["doctor"].iter().chain(address).chain(arguments).copied().collect();
    let output = cli::run(BINARY, folder, &arguments);
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

/// The line of a check.
#[track_caller]
fn line<'a>(lines: &'a [String], check: &str) -> &'a str {
    lines.iter().find(|line| line.split_whitespace().nth(1) == Some(check)).expect("the check")
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
    assert_eq!(
        said,
        ["program", "kernels", "settings", "tls", "address", "folders", "disk", "record", "clock", "broker"]
    );
    assert!(lines.iter().all(|line| line.starts_with("ok ")), "{lines:?}");
    assert!(line(&lines, "record").contains("no record yet at"), "{lines:?}");
    assert!(cli::files(folder.path()).is_empty());
}

#[tokio::test]
async fn doctor_reports_a_clock_that_was_set_back() {
    let (folder, database) = filled().await;
    let (code, lines) = doctor(folder.path(), &["--database", "a.db"]);
    assert_eq!(code, Some(0), "{lines:?}");
    assert!(line(&lines, "record").contains("a.db is intact"), "{lines:?}");
    let store = Store::open(&database).await.unwrap();
    let mut writer = store.write().await.unwrap();
    access_clock::reach(&mut writer, "2099-01-01T00:00:00.000Z".parse().unwrap()).await.unwrap();
    commit(writer).await.unwrap();
    store.close().await;
    let clock = only_error(doctor(folder.path(), &["--database", "a.db"]));
    assert!(clock.contains("clock") && clock.contains("was set back"), "{clock}");
}

#[test]
fn doctor_reports_a_clock_before_the_installation_of_the_program() {
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("gaitwright");
    std::fs::copy(BINARY, &program).unwrap();
    let ahead = SystemTime::now() + Duration::from_secs(3600);
    std::fs::File::options().write(true).open(&program).unwrap().set_modified(ahead).unwrap();
    let report = cli::run(program.to_str().unwrap(), folder.path(), &["doctor", "--listen", "127.0.0.1:0"]);
    let lines: Vec<String> = String::from_utf8(report.stdout).unwrap().lines().map(str::to_owned).collect();
    let clock = only_error((report.status.code(), lines));
    assert!(clock.contains("when the file of this program was written: the clock is wrong"), "{clock}");
}

#[test]
fn doctor_refuses_a_database_without_a_name() {
    let folder = tempfile::tempdir().unwrap();
    let record = only_error(doctor(folder.path(), &["--database", ""]));
    assert!(record.contains("The path of the database is empty; it must name a file."), "{record}");
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
    let folders = only_error(doctor(folder.path(), &["--database", "no/such/a.db"]));
    assert!(folders.contains("cannot write to the folder no/such"), "{folders}");
}

#[test]
fn doctor_reports_the_version_of_a_reachable_broker() {
    let Some(broker) = Broker::start() else { return };
    let folder = tempfile::tempdir().unwrap();
    // The process may not listen yet.
    let found = (0..100).map(|_| doctor(folder.path(), &["--nats", &broker.url()])).find(|(code, _)| *code == Some(0));
    assert!(line(&found.unwrap().1, "broker").contains("with JetStream"));
}

#[test]
fn doctor_names_settings_with_which_the_service_does_not_start() {
    let folder = tempfile::tempdir().unwrap();
    for (flags, named) in [
        (&["--listen", "nonsense"][..], "listen"),
        (&["--backup-folder", "missing"], "backup_folder"),
        (&["--anchor", "missing/anchor"], "There is no folder missing"),
        (&["--tls-certificate", "missing", "--tls-key", "missing"], "the certificate missing"),
        (&["--listen", "0.0.0.0:0", "--no-sign-in"], "without sign-in"),
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

#[test]
fn doctor_refuses_a_certificate_that_the_service_refuses() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("c.pem"), "not a certificate").unwrap();
    std::fs::write(folder.path().join("k.pem"), "not a key").unwrap();
    let flags = ["--tls-certificate", "c.pem", "--tls-key", "k.pem", "--listen", "127.0.0.1:0"];
    let found = only_error(doctor(folder.path(), &flags));
    let arguments: Vec<&str> = ["serve"].into_iter().chain(flags).collect();
    let serve = cli::run(BINARY, folder.path(), &arguments);
    assert!(!serve.status.success());
    let refused = String::from_utf8(serve.stderr).unwrap();
    let (_, reason) = found.split_once("tls").expect("the check of the certificate");
    assert!(refused.contains(reason.trim()), "{found}\n{refused}");
}

#[test]
fn doctor_reports_a_port_in_use() {
    let folder = tempfile::tempdir().unwrap();
    let other = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = other.local_addr().unwrap().to_string();
    let found = only_error(doctor(folder.path(), &["--listen", &address]));
    assert!(found.contains(&format!("Cannot listen on {address}")), "{found}");
}

#[test]
fn doctor_tells_the_running_service_from_another_program_at_its_address() {
    let folder = tempfile::tempdir().unwrap();
    let process = Process::start(BINARY, folder.path(), &["--no-sign-in", "--database", "a.db"], "listening on ");
    let (code, lines) = doctor(folder.path(), &["--database", "a.db", "--listen", process.address()]);
    assert_eq!(code, Some(0), "{lines:?}");
    assert!(line(&lines, "address").contains("the service is running on"), "{lines:?}");
    let other = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let address = other.local_addr().unwrap().to_string();
    let found = only_error(doctor(folder.path(), &["--database", "a.db", "--listen", &address]));
    assert!(found.contains(&format!("Cannot listen on {address}")), "{found}");
}

#[tokio::test]
async fn doctor_reports_a_lost_record() {
    let (folder, database) = filled().await;
    std::fs::remove_file(&database).unwrap();
    let record = only_error(doctor(folder.path(), &["--database", "a.db"]));
    assert!(record.contains("There is no record at a.db"), "{record}");
}

#[cfg(unix)]
#[test]
fn doctor_does_not_wait_for_a_pipe_in_place_of_the_record() {
    let folder = tempfile::tempdir().unwrap();
    assert!(Command::new("mkfifo").arg(folder.path().join("a.db")).status().unwrap().success());
    let record = only_error(doctor(folder.path(), &["--database", "a.db"]));
    assert!(record.contains("a.db is not a file"), "{record}");
}

#[tokio::test]
async fn doctor_accepts_a_second_anchor_that_the_service_will_make() {
    let (folder, _) = filled().await;
    let (code, lines) = doctor(folder.path(), &["--database", "a.db", "--anchor", "./second"]);
    assert_eq!(code, Some(0), "{lines:?}");
}

#[tokio::test]
async fn doctor_reports_a_backup_folder_of_another_record() {
    let (folder, _) = filled().await;
    let copies = folder.path().join("copies");
    std::fs::create_dir(&copies).unwrap();
    std::fs::write(copies.join("a.db.owner"), "/other/a.db\n").unwrap();
    let flags = ["--database", "a.db", "--backup-folder", "copies"];
    let folders = only_error(doctor(folder.path(), &flags));
    assert!(folders.contains("/other/a.db"), "{folders}");
}

#[test]
fn doctor_reports_an_expired_certificate() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("e.ext"), "subjectAltName=DNS:localhost\n").unwrap();
    let openssl = |arguments: &[&str]| Command::new("openssl").args(arguments).current_dir(folder.path()).output();
    let key = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-keyout", "k.pem"];
    let request = [&["req"], &key[..], &["-out", "c.csr", "-subj", "/CN=localhost"]].concat();
    let Ok(made) = openssl(&request) else { return skipped("openssl is needed") };
    assert!(made.status.success(), "{made:?}");
    let flags = ["--tls-certificate", "c.pem", "--tls-key", "k.pem"];
    for (days, expired) in [("2", false), ("-1", true)] {
        let sign = ["x509", "-req", "-in", "c.csr", "-signkey", "k.pem", "-extfile", "e.ext", "-out", "c.pem", "-days"];
        let made = openssl(&[&sign[..], &[days]].concat()).unwrap();
        assert!(made.status.success(), "{made:?}");
        let (code, lines) = doctor(folder.path(), &flags);
        assert_eq!(code, Some(i32::from(expired)), "{lines:?}");
        assert_eq!(line(&lines, "tls").contains("has expired"), expired, "{lines:?}");
    }
}

#[test]
fn doctor_signs_in_to_a_broker_with_the_password_of_its_address() {
    let Some(broker) = Broker::start_with(&["--user", "lab", "--pass", "p@ss/word"]) else { return };
    let folder = tempfile::tempdir().unwrap();
    let url = |password: &str| broker.url().replace("nats://", &format!("nats://lab:{password}@"));
    let (code, lines) = doctor(folder.path(), &["--nats", &url("p%40ss%2Fword")]);
    assert_eq!(code, Some(0), "{lines:?}");
    let refused = only_error(doctor(folder.path(), &["--nats", &url("wrong")]));
    assert!(refused.contains("authorization") && !refused.contains("wrong"), "{refused}");
}

#[test]
fn doctor_checks_everything_else_if_the_settings_file_is_broken_or_missing() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("gaitwright.toml"), "nats = \"nats://lab:s3cret@broker:4222\n").unwrap();
    for (flags, named) in [(&[][..], "line 1, column "), (&["--config", "none.toml"], "Cannot read none.toml")] {
        let (code, lines) = doctor(folder.path(), flags);
        assert_eq!((code, lines.len()), (Some(1), 10), "{lines:?}");
        let found = only_error((code, lines.clone()));
        assert!(found.contains("settings") && found.contains(named), "{found}");
        assert!(!lines.join("\n").contains("s3cret"), "{lines:?}");
    }
}

#[test]
fn doctor_reports_an_invalid_log_filter() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("gaitwright.toml"), "log_format = \"xml\"\n").unwrap();
    let found = only_error(doctor(folder.path(), &[]));
    assert!(found.contains("log_format"), "{found}");
}
