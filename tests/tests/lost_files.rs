//! Files of an open record that are deleted, replaced or truncated, and records whose end is missing.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gaitwright_store::backup_folder::BackupFolder;
use gaitwright_store::{Store, StoreError, anchor, verify};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::cli;
use gaitwright_tests::service::Service;
use serde_json::json;
use skipped_tests::skipped;
use sqlx::Connection;
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;

async fn service() -> (TempDir, PathBuf, Service) {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let service = Service::start(&database, Analytic::default(), 1).await;
    (folder, database, service)
}

/// Adds subjects, and returns how many were acknowledged and how many refused with 503.
async fn add_subjects(service: &Service, name: &str, count: usize) -> (usize, usize) {
    let (mut added, mut refused) = (0, 0);
    for number in 0..count {
        let body = json!({"pseudonym": format!("{name}{number}"), "height_m": 1.8, "body_mass_kg": 70.0});
        let answer = service.post("/api/v1/subjects", &body).await;
        added += usize::from(answer.status == StatusCode::CREATED);
        if answer.status == StatusCode::SERVICE_UNAVAILABLE {
            assert_eq!(answer.json()["type"], "/problems/record-vanished", "{}", answer.text);
            refused += 1;
        }
    }
    (added, refused)
}

fn beside(database: &Path, ending: &str) -> PathBuf {
    PathBuf::from(format!("{}{ending}", database.display()))
}

#[tokio::test]
async fn writes_are_refused_after_a_file_of_the_record_is_lost() {
    for ending in ["", "-wal", "-shm"] {
        for replaced in [false, true] {
            let (_folder, database, service) = service().await;
            assert_eq!(add_subjects(&service, "before", 5).await, (5, 0));
            let file = beside(&database, ending);
            let copy = std::fs::read(&file).unwrap();
            std::fs::remove_file(&file).unwrap();
            if replaced {
                std::fs::write(&file, copy).unwrap();
            }
            assert_eq!(add_subjects(&service, "after", 20).await, (0, 20), "{ending} replaced: {replaced}");
            println!("a.db{ending} {}: 20 of 20 writes refused", if replaced { "replaced" } else { "deleted" });
            let pages = service.fetch("/api/v1/subjects").await;
            assert_eq!(pages.status, StatusCode::OK, "what was read before can still be read");
            assert_eq!(service.fetch("/ready").await.status, StatusCode::SERVICE_UNAVAILABLE);
            assert!(service.fetch("/system").await.text.contains("The record cannot be written"));
            service.abandon().await;
        }
    }
}

#[tokio::test]
async fn writes_are_refused_after_the_log_or_the_file_is_truncated() {
    for ending in ["", "-wal"] {
        let (_folder, database, service) = service().await;
        assert_eq!(add_subjects(&service, "before", 5).await, (5, 0));
        // In the middle of a change, whose commit makes the log longer than it was.
        let mut writer = service.store.write().await.unwrap();
        sqlx::query(SUBJECT).execute(&mut **writer).await.unwrap();
        let file = std::fs::OpenOptions::new().write(true).open(beside(&database, ending)).unwrap();
        file.set_len(100).unwrap();
        let refused = gaitwright_store::commit(writer).await;
        assert!(matches!(refused, Err(StoreError::RecordVanished { .. })), "{ending}: {refused:?}");
        assert_eq!(add_subjects(&service, "after", 20).await, (0, 20), "{ending}");
        service.abandon().await;
    }
}

const SUBJECT: &str =
    "insert into subjects (id, pseudonym, height_m, body_mass_kg, created_at) values ('S', 'S', 1.8, 70, '')";

#[tokio::test]
async fn record_that_another_program_writes_to_accepts_no_further_changes() {
    let user = "insert into users (id, name, role, created_at) values ('mallory', 'mallory', 'administrator', '')";
    let trigger = "create trigger evil after insert on assessments begin \
                   update assessments set note = 'x' where id = new.id; end";
    for sql in [user, trigger, "update subjects set notes = 'forged'", "create table more (x)"] {
        let (_folder, database, service) = service().await;
        assert_eq!(add_subjects(&service, "before", 5).await, (5, 0));
        let options = sqlx::sqlite::SqliteConnectOptions::new().filename(&database);
        let mut other = sqlx::SqliteConnection::connect_with(&options).await.unwrap();
        // A program that only reads is no reason to refuse changes.
        sqlx::query("select * from users").fetch_all(&mut other).await.unwrap();
        assert_eq!(add_subjects(&service, "between", 2).await, (2, 0));
        sqlx::query(sqlx::AssertSqlSafe(sql)).execute(&mut other).await.unwrap();
        assert_eq!(add_subjects(&service, "after", 5).await, (0, 5), "{sql}");
        assert_eq!(service.fetch("/ready").await.status, StatusCode::SERVICE_UNAVAILABLE);
        other.close().await.unwrap();
        service.abandon().await;
        assert!(Store::open(&database).await.is_err(), "{sql}");
    }
}

#[tokio::test]
async fn log_truncated_during_a_commit_is_detected_and_never_reaches_the_file() {
    // Bytes that the log loses; 9999 stands for all but the first 100.
    for lost in [1, 4000, 4121, 20_000, 9999] {
        let (_folder, database, service) = service().await;
        assert_eq!(add_subjects(&service, "before", 40).await, (40, 0));
        let kept = std::fs::read(&database).unwrap();
        let mut writer = service.store.write().await.unwrap();
        sqlx::query(SUBJECT).execute(&mut **writer).await.unwrap();
        let log = std::fs::OpenOptions::new().write(true).open(beside(&database, "-wal")).unwrap();
        let length = log.metadata().unwrap().len();
        // SQLite calls this hook at a commit, before it writes.
        writer.lock_handle().await.unwrap().set_commit_hook(move || {
            log.set_len(if lost == 9999 { 100 } else { length - lost }).unwrap();
            true
        });
        let refused = gaitwright_store::commit(writer).await;
        assert!(matches!(refused, Err(StoreError::RecordVanished { .. })), "{lost}: {refused:?}");
        assert_eq!(add_subjects(&service, "after", 5).await, (0, 5), "{lost}");
        service.abandon().await;
        assert!(std::fs::read(&database).unwrap() == kept, "{lost}: the file holds what was in the cut log");
    }
}

#[tokio::test]
async fn long_logs_are_checkpointed_and_restarted() {
    let (_folder, database, service) = service().await;
    let mut longest = 0;
    for number in 0..12 {
        assert_eq!(add_subjects(&service, &format!("{number}-"), 40).await, (40, 0));
        longest = longest.max(std::fs::metadata(beside(&database, "-wal")).unwrap().len());
    }
    assert!(longest < 12 << 20, "{longest} bytes");
    assert!(std::fs::metadata(&database).unwrap().len() > 1 << 19);
    service.stop().await;
    verify::file(&database, &[]).await.unwrap();
}

#[tokio::test]
async fn changes_in_a_deleted_log_are_saved_when_the_loss_is_detected() {
    let (folder, database, service) = service().await;
    assert_eq!(add_subjects(&service, "S", 40).await, (40, 0));
    std::fs::remove_file(beside(&database, "-wal")).unwrap();
    assert_eq!(add_subjects(&service, "T", 1).await, (0, 1));
    // The state of the disk if the process were killed at this point.
    let killed = folder.path().join("killed.db");
    for ending in ["", ".anchor"] {
        std::fs::copy(beside(&database, ending), beside(&killed, ending)).unwrap();
    }
    verify::file(&killed, &[]).await.unwrap();
    let store = Store::open(&killed).await.unwrap();
    let found: i64 = sqlx::query_scalar("select count(*) from subjects where pseudonym glob 'S*'")
        .fetch_one(&mut **store.read().await.unwrap())
        .await
        .unwrap();
    assert_eq!(found, 40);
    store.close().await;
    service.abandon().await;
}

#[tokio::test]
async fn record_without_its_newest_rows_is_refused_and_reported_by_audit_verify() {
    let (folder, database, service) = service().await;
    assert_eq!(add_subjects(&service, "S", 40).await, (40, 0));
    // As after a kill with a deleted log: only checkpointed changes are in the file.
    let cut = folder.path().join("cut.db");
    for ending in ["", ".anchor"] {
        std::fs::copy(beside(&database, ending), beside(&cut, ending)).unwrap();
    }
    service.stop().await;
    let refused = Store::open(&cut).await;
    assert!(
        matches!(
            refused,
            Err(StoreError::CutOff { .. } | StoreError::NotADatabase { .. } | StoreError::RecordMissing { .. })
        ),
        "{refused:?}"
    );
    assert!(verify::file(&cut, &[]).await.is_err());
}

#[tokio::test]
async fn each_anchor_refuses_an_earlier_state_of_the_record_until_a_restore() {
    let folder = tempfile::tempdir().unwrap();
    let (database, elsewhere) = (folder.path().join("a.db"), folder.path().join("elsewhere.anchor"));
    let add = async |name: &'static str| {
        let store = Store::open_anchored(&database, Some(&elsewhere)).await.unwrap();
        let mut writer = store.write().await.unwrap();
        let sql = "insert into subjects (id, pseudonym, height_m, body_mass_kg, created_at) values (?, ?, 1.8, 70, '')";
        sqlx::query(sql).bind(name).bind(name).execute(&mut **writer).await.unwrap();
        gaitwright_store::commit(writer).await.unwrap();
        store.close().await;
    };
    add("S1").await;
    let early = folder.path().join("early.db");
    std::fs::copy(&database, &early).unwrap();
    add("S2").await;
    verify::file(&database, std::slice::from_ref(&elsewhere)).await.unwrap();

    std::fs::copy(&early, &database).unwrap();
    let refused = Store::open_anchored(&database, Some(&elsewhere)).await;
    assert!(matches!(refused, Err(StoreError::CutOff { .. })), "{refused:?}");
    std::fs::remove_file(anchor::path_of(&database)).unwrap();
    let refused = Store::open_anchored(&database, Some(&elsewhere)).await;
    assert!(matches!(refused, Err(StoreError::CutOff { .. })), "{refused:?}");
    let refused = verify::file(&database, std::slice::from_ref(&elsewhere)).await;
    assert!(matches!(refused, Err(StoreError::CutOff { .. })), "{refused:?}");

    let binary = env!("CARGO_BIN_EXE_gaitwright-cli");
    let restored =
        cli::run(binary, folder.path(), &["restore", "early.db", "--database", "a.db", "--anchor", "elsewhere.anchor"]);
    assert!(restored.status.success(), "{restored:?}");
    // A different history of the same length.
    add("S3").await;
    let other = folder.path().join("other.db");
    std::fs::copy(&database, &other).unwrap();
    std::fs::copy(&elsewhere, anchor::path_of(&other)).unwrap();
    std::fs::copy(&early, &database).unwrap();
    for name in [&elsewhere, &anchor::path_of(&database)] {
        std::fs::remove_file(name).unwrap();
    }
    add("S4").await;
    std::fs::copy(&elsewhere, anchor::path_of(&other)).unwrap();
    let refused = Store::open(&other).await;
    assert!(matches!(refused, Err(StoreError::Rewritten { .. })), "{refused:?}");
}

#[tokio::test]
async fn empty_record_is_not_created_in_place_of_a_lost_one() {
    let (folder, database, service) = service().await;
    service.stop().await;
    for leave_empty in [false, true] {
        std::fs::remove_file(&database).unwrap();
        if leave_empty {
            std::fs::write(&database, "").unwrap();
        }
        let refused = Store::open(&database).await;
        assert!(matches!(refused, Err(StoreError::RecordMissing { .. })), "{refused:?}");
        std::fs::write(&database, "").unwrap();
    }
    // A reader of the service that ends late leaves its log behind, which would be named first.
    for rest in ["-wal", "-shm"] {
        let _ = std::fs::remove_file(beside(&database, rest));
    }
    let refused = Store::open(&database).await.unwrap_err().to_string();
    assert!(refused.contains("a.db.anchor"), "{refused}");
    std::fs::remove_file(anchor::path_of(&database)).unwrap();
    Store::open(&database).await.unwrap().close().await;
    drop(folder);
}

#[tokio::test]
async fn second_service_is_refused_after_the_lock_file_is_deleted() {
    let (_folder, database, service) = service().await;
    std::fs::remove_file(beside(&database, ".lock")).unwrap();
    let second = Store::open(&database).await;
    assert!(matches!(second, Err(StoreError::InUse { .. })), "{second:?}");
    assert_eq!(add_subjects(&service, "S", 3).await, (3, 0));
    service.stop().await;
    Store::open(&database).await.unwrap().close().await;
}

#[cfg(unix)]
#[tokio::test]
async fn only_the_owner_can_read_the_record_and_its_backups() {
    use std::os::unix::fs::PermissionsExt;
    let (folder, _database, service) = service().await;
    service.backed_up().await;
    let study = service.study(|new| (new.number_of_trials, new.start) = (1, false)).await;
    let binary = env!("CARGO_BIN_EXE_gaitwright-cli");
    for arguments in [
        &["backup", "copy.db", "--database", "a.db"][..],
        &["export", &study.to_string(), "study.archive", "--database", "a.db"],
        &["restore", "copy.db", "--database", "b.db"],
    ] {
        let done = cli::run(binary, folder.path(), arguments);
        assert!(done.status.success(), "{done:?}");
    }
    for name in cli::files(folder.path()) {
        let mode = std::fs::metadata(folder.path().join(&name)).unwrap().permissions().mode() & 0o777;
        assert_eq!(mode, 0o600, "{name}: {mode:o}");
    }
    service.stop().await;
}

/// Runs a command in a folder that is mounted read-only for it alone.
fn on_read_only_mount(folder: &Path, arguments: &str) -> Option<std::process::Output> {
    let binary = env!("CARGO_BIN_EXE_gaitwright-cli");
    let script = format!(
        "mount --bind . . && mount -o remount,bind,ro . && cd \"$PWD\" && ! touch x 2>/dev/null && {binary} {arguments}"
    );
    let mut unshare = Command::new("unshare");
    unshare.args(["--user", "--map-root-user", "--mount", "sh", "-c", &script]).current_dir(folder);
    let can = Command::new("unshare").args(["--user", "--map-root-user", "--mount", "true"]).status();
    can.is_ok_and(|status| status.success()).then(|| unshare.output().unwrap())
}

#[tokio::test]
async fn verify_backup_and_export_work_on_a_read_only_file_system() {
    let (folder, database, service) = service().await;
    let out = tempfile::tempdir().unwrap();
    let study = service.study(|new| (new.number_of_trials, new.start) = (1, false)).await;
    add_subjects(&service, "S", 3).await;
    let killed = tempfile::tempdir().unwrap();
    for ending in ["", "-wal", ".anchor"] {
        std::fs::copy(beside(&database, ending), beside(&killed.path().join("a.db"), ending)).unwrap();
    }
    let to = |name: &str| out.path().join(name).display().to_string();
    for (state, place) in [("served", folder.path()), ("killed", killed.path()), ("closed", folder.path())] {
        for command in [
            "audit verify".to_owned(),
            format!("backup {}", to(state)),
            format!("export {study} {}", to(&format!("{state}.archive"))),
        ] {
            let Some(done) = on_read_only_mount(place, &format!("{command} --database a.db")) else {
                service.stop().await;
                return skipped("no user namespaces here");
            };
            assert!(done.status.success(), "{state}: {command}: {done:?}");
        }
        if state == "killed" {
            service.scheduler.stop();
            service.store.close().await;
        }
    }
    service.abandon().await;
    assert_eq!(cli::files(out.path()).len(), 6);
}

#[tokio::test]
async fn backup_finishes_after_its_requester_disconnects_and_is_refused_if_it_cannot_be_recorded() {
    let (folder, database, service) = service().await;
    let path = "/api/v1/backups";
    // The client disconnects at once.
    let nothing = json!({});
    assert_eq!(service.post(path, &nothing).await.status, StatusCode::ACCEPTED);
    let copies = || cli::files(folder.path()).into_iter().filter(|name| name.contains("backup-")).collect::<Vec<_>>();
    for _ in 0..500 {
        if copies().iter().any(|name| !name.starts_with('.')) {
            break;
        }
        tokio::time::sleep(std::time::Duration::from_millis(10)).await;
    }
    let names = copies();
    assert!(names.len() == 1 && !names[0].starts_with('.'), "{names:?}");
    gaitwright_store::read_only::check(&folder.path().join(&names[0])).await.unwrap();
    // Readers see the row of the audit trail before its commit has checked the files of the record.
    let backups = &service.backups;
    for _ in 0..500 {
        if backups.running().is_empty() {
            break;
        }
        tokio::time::sleep(std::time::Duration::from_millis(10)).await;
    }
    assert_eq!(backups.running(), []);
    let recorded = service.fetch("/api/v1/audit").await.text;
    assert!(recorded.contains(&names[0]), "{recorded}");

    std::fs::remove_file(beside(&database, "-shm")).unwrap();
    let refused = service.post(path, &nothing).await;
    assert_eq!(refused.status, StatusCode::SERVICE_UNAVAILABLE, "{}", refused.text);
    assert_eq!(copies(), names);
    service.abandon().await;
}

#[tokio::test]
async fn scheduled_backups_are_made_and_checked_and_the_oldest_deleted() {
    let (_folder, _database, service) = service().await;
    let out = tempfile::tempdir().unwrap();
    std::fs::write(out.path().join("a.db.backup-by-hand"), "").unwrap();
    std::fs::write(out.path().join(".a.db.scheduled-1.9999999-0.copying"), "of a killed process").unwrap();
    let mut made = Vec::new();
    let claimed = BackupFolder::claim(&service.store, out.path()).unwrap();
    for _ in 0..4 {
        let (file, bytes) = claimed.add(&service.store, 2).await.unwrap();
        assert!(bytes > 0);
        gaitwright_store::read_only::check(&file).await.unwrap();
        made.push(file.file_name().unwrap().to_str().unwrap().to_owned());
        tokio::time::sleep(std::time::Duration::from_millis(20)).await;
    }
    let mut expected =
        vec!["a.db.backup-by-hand".to_owned(), "a.db.owner".to_owned(), made[2].clone(), made[3].clone()];
    expected.sort();
    assert_eq!(cli::files(out.path()), expected);
    let kept = claimed.backups().unwrap();
    assert!(kept[0].0.ends_with(&made[3]), "{kept:?}");
    service.stop().await;
}

#[test]
fn serve_makes_scheduled_backups_in_a_folder() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("copies")).unwrap();
    let binary = env!("CARGO_BIN_EXE_gaitwright-cli");
    let arguments = [
        "serve",
        "--no-sign-in",
        "--listen",
        "127.0.0.1:0",
        "--database",
        "a.db",
        "--backup-folder",
        "copies",
        "--anchor",
        "b.anchor",
    ];
    let mut process = cli::command(binary, folder.path(), &arguments).spawn().unwrap();
    let copy = || {
        let names = cli::files(&folder.path().join("copies"));
        names.into_iter().find(|name| name.starts_with("a.db.scheduled-"))
    };
    for _ in 0..1000 {
        if copy().is_some() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    process.kill().unwrap();
    process.wait().unwrap();
    let copy = copy().expect("a copy");
    let verified = cli::run(binary, folder.path(), &["audit", "verify", "--database", &format!("copies/{copy}")]);
    assert!(verified.status.success(), "{verified:?}");
    let verified = cli::run(binary, folder.path(), &["audit", "verify", "--database", "a.db", "--anchor", "b.anchor"]);
    let text = String::from_utf8_lossy(&verified.stdout);
    assert!(verified.status.success() && text.contains("complete according to anchor b.anchor"), "{verified:?}");
}
