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
use std::fs::Permissions;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, SystemTime};

const BINARY: &str = env!("CARGO_BIN_EXE_gaitwright-cli");

/// Its exit code, and its lines. It checks any free port, unless the arguments name an address.
fn doctor(folder: &Path, arguments: &[&str]) -> (Option<i32>, Vec<String>) {
    let address: &[&str] = if arguments.contains(&"--listen") { &[] } else { &["--listen", "127.0.0.1:0"] };
    let arguments: Vec<&str> = ["doctor"].iter().chain(address).chain(arguments).copied().collect();
    let output = cli::run(BINARY, folder, &arguments);
    (output.status.code(), lines_of(&output))
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

/// Why both `doctor` and `serve` refuse a record.
#[track_caller]
fn refused_by_both(folder: &Path, user: Option<u32>, database: &str) -> String {
    let run = |name| {
        let mut command = cli::command(BINARY, folder, &[name, "--listen", "127.0.0.1:0", "--database", database]);
        if let Some(user) = user {
            command.uid(user);
        }
        command.output().unwrap()
    };
    let (doctor, serve) = (run("doctor"), run("serve"));
    let record = only_error((doctor.status.code(), lines_of(&doctor)));
    let reason = record.split_once("record").expect("the check of the record").1.trim();
    let refused = String::from_utf8(serve.stderr).unwrap();
    assert!(!serve.status.success() && refused.contains(reason), "{record}\n{refused}");
    record
}

fn lines_of(output: &Output) -> Vec<String> {
    String::from_utf8_lossy(&output.stdout).lines().map(str::to_owned).collect()
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
    // The service makes a record of an empty file.
    std::fs::write(folder.path().join("a.db"), "").unwrap();
    let (code, lines) = doctor(folder.path(), &["--database", "a.db"]);
    assert_eq!(code, Some(0), "{lines:?}");
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
fn doctor_accepts_a_copy_of_the_program_with_the_time_of_the_original() {
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("gaitwright");
    std::fs::copy(BINARY, &program).unwrap();
    let ahead = SystemTime::now() + Duration::from_hours(1);
    std::fs::File::options().write(true).open(&program).unwrap().set_modified(ahead).unwrap();
    let report = cli::run(program.to_str().unwrap(), folder.path(), &["doctor", "--listen", "127.0.0.1:0"]);
    assert!(report.status.success(), "{report:?}");
}

#[test]
fn doctor_and_the_service_refuse_a_database_without_a_file_name() {
    let folder = tempfile::tempdir().unwrap();
    for database in ["", "x/", "x/."] {
        let record = refused_by_both(folder.path(), None, database);
        assert!(record.contains(&format!("must name a file, but is \"{database}\".")), "{record}");
    }
    assert!(cli::files(folder.path()).is_empty());
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
    let in_use = "The database a.db is in use by another Gaitwright process.";
    let found = only_error(doctor(folder.path(), &["--database", "a.db"]));
    assert!(found.contains(in_use), "{found}");
    // The second lock is on the database file itself.
    std::fs::remove_file(folder.path().join("a.db.lock")).unwrap();
    let found = only_error(doctor(folder.path(), &["--database", "a.db"]));
    assert!(found.contains(in_use), "{found}");
}

#[tokio::test]
async fn doctor_reports_a_lost_record() {
    let (folder, database) = filled().await;
    std::fs::remove_file(&database).unwrap();
    let record = only_error(doctor(folder.path(), &["--database", "a.db"]));
    assert!(record.contains("There is no record at a.db"), "{record}");
}

#[test]
fn doctor_and_the_service_do_not_wait_for_a_pipe_in_place_of_the_record() {
    let folder = tempfile::tempdir().unwrap();
    assert!(Command::new("mkfifo").arg(folder.path().join("a.db")).status().unwrap().success());
    let record = refused_by_both(folder.path(), None, "a.db");
    assert!(record.contains("it is not a file"), "{record}");
}

#[tokio::test]
async fn doctor_and_the_service_refuse_a_record_that_cannot_be_written() {
    let (folder, database) = filled().await;
    let file = |ending: &str| folder.path().join(format!("a.db{ending}"));
    std::fs::File::create(file("-wal")).unwrap();
    std::fs::File::create(file("-shm")).unwrap();
    // Root may write every file. Files of root, however, are those of another user for anyone else.
    let is_root = folder.path().metadata().unwrap().uid() == 0;
    let user = is_root.then_some(65534);
    if user.is_some_and(|user| Command::new(BINARY).arg("--version").uid(user).output().is_err()) {
        return skipped("no other user can run the program");
    }
    std::os::unix::fs::chown(folder.path(), user, None).unwrap();
    let set = |path: &Path, mode| std::fs::set_permissions(path, Permissions::from_mode(mode)).unwrap();
    for name in cli::files(folder.path()) {
        set(&folder.path().join(name), 0o666);
    }
    for ending in ["", "-wal", "-shm", ".lock"] {
        set(&file(ending), 0o444);
        let record = refused_by_both(folder.path(), user, "a.db");
        let cannot = format!("Cannot open or write a.db{ending}: ");
        assert!(record.contains(&cannot) && record.contains("denied"), "{record}");
        set(&file(ending), 0o666);
    }
    for ending in ["-wal", "-shm", ".lock", ".access"] {
        let _ = std::fs::remove_file(file(ending));
        std::fs::create_dir(file(ending)).unwrap();
        let record = refused_by_both(folder.path(), None, "a.db");
        assert!(record.contains(&format!("Cannot open or write a.db{ending}: it is not a file")), "{record}");
        std::fs::remove_dir(file(ending)).unwrap();
    }
    std::fs::hard_link(&database, folder.path().join("second")).unwrap();
    let record = refused_by_both(folder.path(), None, "a.db");
    assert!(record.contains("has other hard links"), "{record}");
    std::fs::remove_file(folder.path().join("second")).unwrap();
    let (code, lines) = doctor(folder.path(), &["--database", "a.db"]);
    assert_eq!(code, Some(0), "{lines:?}");
}

#[tokio::test]
async fn commands_follow_a_link_to_the_record() {
    let (folder, database) = filled().await;
    let elsewhere = tempfile::tempdir().unwrap();
    std::os::unix::fs::symlink(&database, elsewhere.path().join("absolute.db")).unwrap();
    std::os::unix::fs::symlink("absolute.db", elsewhere.path().join("link.db")).unwrap();
    let link = ["--database", "link.db"];
    let (code, lines) = doctor(elsewhere.path(), &link);
    assert_eq!(code, Some(0), "{lines:?}");
    let record = line(&lines, "record");
    assert!(record.contains(database.to_str().unwrap()) && record.ends_with("anchors: 1"), "{record}");
    let verified = cli::run(BINARY, elsewhere.path(), &[&["audit", "verify"], &link[..]].concat());
    let text = String::from_utf8(verified.stdout).unwrap();
    assert!(verified.status.success() && text.contains("complete according to anchor"), "{text}");
    let process = Process::start(BINARY, elsewhere.path(), &["--no-sign-in", "--database", "link.db"], "listening on ");
    let (code, lines) = doctor(elsewhere.path(), &[&link[..], &["--listen", process.address()]].concat());
    assert_eq!(code, Some(0), "{lines:?}");
    drop(process);
    assert_eq!(cli::files(elsewhere.path()), ["absolute.db", "link.db"]);
    assert!(folder.path().join("a.db.anchor").exists());
}

#[tokio::test]
async fn doctor_and_the_service_accept_a_link_to_a_new_record_and_refuse_a_circle_of_links() {
    let folder = tempfile::tempdir().unwrap();
    let link = |to: &str, name: &str| std::os::unix::fs::symlink(to, folder.path().join(name)).unwrap();
    link("new.db", "link.db");
    drop(Process::start(BINARY, folder.path(), &["--no-sign-in", "--database", "link.db"], "listening on "));
    assert!(cli::files(folder.path()).contains(&"new.db.anchor".to_owned()));
    let (code, lines) = doctor(folder.path(), &["--database", "link.db"]);
    assert_eq!(code, Some(0), "{lines:?}");
    link("here.db", "there.db");
    link("there.db", "here.db");
    let record = refused_by_both(folder.path(), None, "here.db");
    assert!(record.contains("Too many levels of symbolic links"), "{record}");
}

#[tokio::test]
async fn doctor_names_the_folder_that_has_less_space_than_the_reserve() {
    let (folder, _) = filled().await;
    std::fs::create_dir(folder.path().join("full")).unwrap();
    let unshare = |script: &str| {
        let mut unshare = cli::command("unshare", folder.path(), &["--user", "--map-root-user", "--mount", "sh", "-c"]);
        unshare.arg(format!("mount -t tmpfs -o size=64k tmpfs full && {script}"));
        unshare.env("GAITWRIGHT_RESERVE_MB", "1").output()
    };
    if !unshare("true").is_ok_and(|done| done.status.success()) {
        return skipped("no disk can be mounted here");
    }
    for (flag, value) in [("--backup-folder", "full"), ("--anchor", "full/anchor")] {
        let flags = format!("--listen 127.0.0.1:0 --database a.db {flag} {value}");
        let output = unshare(&format!("{BINARY} doctor {flags}")).unwrap();
        let disk = only_error((output.status.code(), lines_of(&output)));
        assert!(disk.contains("free in the folder full, less than the reserve of 1 MB"), "{disk}");
    }
}

#[test]
fn doctor_reports_an_invalid_reserve_once() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("gaitwright.toml"), "reserve_mb = \"much\"\n").unwrap();
    let settings = only_error(doctor(folder.path(), &[]));
    assert!(settings.contains("settings") && settings.contains("reserve_mb"), "{settings}");
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
