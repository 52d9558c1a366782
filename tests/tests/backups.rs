//! Backups are verified, belong to one record, and leave no temporary files. A restore overwrites only its record.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_store::backup_folder::BackupFolder;
use gaitwright_store::{Store, StoreError, anchor, backup, commit, verify};
use gaitwright_tests::cli;
use gaitwright_tests::every_table::filled;
use skipped_tests::skipped;
use sqlx::sqlite::{SqliteConnectOptions, SqliteConnection};
use sqlx::{AssertSqlSafe, Connection};
use std::path::Path;
use std::process::Command;
use std::time::{Duration, SystemTime};

const BINARY: &str = env!("CARGO_BIN_EXE_gaitwright-cli");

/// Changes a record outside the program.
async fn forge(database: &Path, sql: &str) {
    let options = SqliteConnectOptions::new().filename(database);
    let mut connection = SqliteConnection::connect_with(&options).await.unwrap();
    sqlx::query(AssertSqlSafe(sql.to_owned())).execute(&mut connection).await.unwrap();
    connection.close().await.unwrap();
}

async fn record(database: &Path) {
    let store = Store::open(database).await.unwrap();
    let mut writer = store.write().await.unwrap();
    let sql = "insert into subjects (id, pseudonym, height_m, body_mass_kg, created_at) values ('S', 'S', 1.8, 70, '')";
    sqlx::query(sql).execute(&mut **writer).await.unwrap();
    commit(writer).await.unwrap();
    store.close().await;
}

#[tokio::test]
async fn damaged_record_is_not_backed_up_and_a_damaged_backup_is_not_restored() {
    let (folder, database) = filled().await;
    let run = |arguments: &[&str]| cli::run(BINARY, folder.path(), arguments);
    let name = database.to_str().unwrap();
    assert!(run(&["backup", "--database", name, "good.db"]).status.success());
    for (sql, what) in [
        ("update users set role = 'administrator'", "of users"),
        ("update sessions set by_link = 1 - by_link", "of sessions"),
        ("drop trigger users_no_delete", "trigger users_no_delete"),
        ("create table more (x)", "table more"),
    ] {
        let damaged = folder.path().join("damaged.db");
        std::fs::copy(folder.path().join("good.db"), &damaged).unwrap();
        forge(&damaged, sql).await;
        let refused = run(&["backup", "--database", "damaged.db", "copy.db"]);
        let text = String::from_utf8_lossy(&refused.stderr);
        assert!(
            !refused.status.success() && text.contains("failed verification") && text.contains(what),
            "{sql}: {text}"
        );
        let files = cli::files(folder.path());
        assert!(!files.iter().any(|name| name.contains("copy")), "{sql}: {files:?}");

        let record = std::fs::read(&database).unwrap();
        let refused = run(&["restore", "--database", name, "damaged.db"]);
        let text = String::from_utf8_lossy(&refused.stderr);
        assert!(
            !refused.status.success() && text.contains("failed verification") && text.contains(what),
            "{sql}: {text}"
        );
        assert_eq!(std::fs::read(&database).unwrap(), record, "{sql}");
    }
    assert!(run(&["restore", "--database", name, "good.db"]).status.success());
}

#[tokio::test]
async fn scheduled_backup_of_a_damaged_record_fails_and_keeps_the_last_good_backup() {
    let folder = tempfile::tempdir().unwrap();
    let (database, out) = (folder.path().join("a.db"), tempfile::tempdir().unwrap());
    record(&database).await;
    let store = Store::open(&database).await.unwrap();
    let claimed = BackupFolder::claim(&store, out.path()).unwrap();
    let (good, _) = claimed.add(&store, 1).await.unwrap();
    forge(&database, "update subjects set notes = 'forged'").await;
    let refused = claimed.add(&store, 1).await;
    assert!(matches!(refused, Err(StoreError::Unverified { .. })), "{refused:?}");
    assert!(backup::to_record_folder(&store).await.is_err());
    assert_eq!(claimed.backups().unwrap().len(), 1);
    verify::file(&good, &[]).await.unwrap();
}

#[tokio::test]
async fn new_backup_stays_beside_a_file_with_a_time_in_the_future() {
    let folder = tempfile::tempdir().unwrap();
    let (database, out) = (folder.path().join("a.db"), tempfile::tempdir().unwrap());
    record(&database).await;
    let store = Store::open(&database).await.unwrap();
    let claimed = BackupFolder::claim(&store, out.path()).unwrap();
    let file = std::fs::File::create(out.path().join("a.db.scheduled-20990101T000000")).unwrap();
    file.set_modified(SystemTime::now() + Duration::from_hours(24)).unwrap();
    let (new, _) = claimed.add(&store, 1).await.unwrap();
    assert!(new.exists());
    assert_eq!(claimed.backups().unwrap().len(), 1);
}

#[tokio::test]
async fn backup_folder_of_another_record_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    for name in ["a", "b", "out"] {
        std::fs::create_dir(folder.path().join(name)).unwrap();
    }
    let [first, second] = ["a", "b"].map(|name| folder.path().join(name).join("gaitwright.db"));
    record(&first).await;
    std::fs::copy(&first, &second).unwrap();
    let (a, b) = (Store::open(&first).await.unwrap(), Store::open(&second).await.unwrap());
    let claimed = BackupFolder::claim(&a, &out).unwrap();
    let (kept, _) = claimed.add(&a, 1).await.unwrap();
    let refused = BackupFolder::claim(&b, &out);
    assert!(matches!(refused, Err(StoreError::FolderOfOther { .. })), "{refused:?}");
    b.close().await;
    let arguments = ["serve", "--no-sign-in", "--listen", "127.0.0.1:0", "--backup-folder", "../out"];
    let refused = cli::run(BINARY, &folder.path().join("b"), &arguments);
    let text = String::from_utf8_lossy(&refused.stderr);
    assert!(!refused.status.success() && text.contains("must have a folder of its own"), "{text}");
    drop(claimed);
    let refused = BackupFolder::claim(&b, &out);
    assert!(matches!(refused, Err(StoreError::FolderOfOther { .. })), "after the end of the other one: {refused:?}");
    let claimed = BackupFolder::claim(&a, &out).unwrap();
    assert_eq!(claimed.backups().unwrap()[0].0, kept);
    a.close().await;
}

#[tokio::test]
async fn second_anchor_that_is_another_file_is_refused_and_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    record(&database).await;
    let run = |arguments: &[&str]| cli::run(BINARY, folder.path(), arguments);
    assert!(run(&["backup", "--database", "a.db", "copy.db"]).status.success());
    std::fs::write(folder.path().join("notes.txt"), "my notes").unwrap();
    std::fs::write(folder.path().join("empty"), "").unwrap();
    std::os::unix::fs::symlink("a.db", folder.path().join("link")).unwrap();
    let content = || {
        let names = cli::files(folder.path()).into_iter().filter(|name| !name.ends_with(".access"));
        names.map(|name| (std::fs::read(folder.path().join(&name)).unwrap(), name)).collect::<Vec<_>>()
    };
    let before = content();
    for name in ["notes.txt", "empty", "copy.db", "a.db", "./a.db", "link", "a.db.anchor", "a.db-wal", "copy.db-wal"] {
        let refused = run(&["restore", "--database", "a.db", "--anchor", name, "copy.db"]);
        let text = String::from_utf8_lossy(&refused.stderr);
        assert!(!refused.status.success() && text.contains("it must be a new file"), "{name}: {text}");
        assert!(content() == before, "restore --anchor {name} changed a file");
        if !name.starts_with("copy") {
            let refused = Store::open_anchored(&database, Some(&folder.path().join(name))).await;
            assert!(matches!(refused, Err(StoreError::WrongAnchor { .. })), "{name}: {refused:?}");
            assert!(content() == before, "serve --anchor {name} changed a file");
        }
    }
    let refused = Store::open_anchored(&folder.path().join("new.db"), Some(&folder.path().join("new.db"))).await;
    assert!(matches!(refused, Err(StoreError::WrongAnchor { .. })), "{refused:?}");
    assert!(run(&["restore", "--database", "a.db", "--anchor", "b.anchor", "copy.db"]).status.success());
    assert!(anchor::read(&folder.path().join("b.anchor")).unwrap().is_some());
}

#[tokio::test]
async fn file_that_replaced_an_open_anchor_is_not_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let (database, elsewhere) = (folder.path().join("a.db"), folder.path().join("b.anchor"));
    let store = Store::open_anchored(&database, Some(&elsewhere)).await.unwrap();
    std::fs::remove_file(&elsewhere).unwrap();
    std::fs::write(&elsewhere, "my notes").unwrap();
    let mut writer = store.write().await.unwrap();
    let sql = "insert into subjects (id, pseudonym, height_m, body_mass_kg, created_at) values ('S', 'S', 1.8, 70, '')";
    sqlx::query(sql).execute(&mut **writer).await.unwrap();
    commit(writer).await.unwrap();
    assert_eq!(std::fs::read(&elsewhere).unwrap(), b"my notes");
    store.close().await;
}

#[tokio::test]
async fn leftovers_of_killed_backups_are_removed_by_the_next_backup_to_the_same_folder() {
    let (folder, database) = filled().await;
    let out = tempfile::tempdir().unwrap();
    let name = database.to_str().unwrap();
    let mut left = 0;
    for kill in 0..12 {
        let arguments = ["backup", "--database", name, &format!("copy{kill}.db")];
        let mut process = cli::command(BINARY, out.path(), &arguments).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(10 + 8 * kill));
        process.kill().unwrap();
        process.wait().unwrap();
        left += cli::files(out.path()).iter().filter(|name| name.ends_with(".copying")).count();
    }
    assert!(left > 0, "no backup was killed in time");
    assert!(cli::run(BINARY, out.path(), &["backup", "--database", name, "good.db"]).status.success());
    let files = cli::files(out.path());
    assert!(!files.iter().any(|name| name.contains("copying")), "{files:?}");
    drop(folder);
}

#[tokio::test]
async fn full_backup_disk_is_not_reported_as_a_full_record_disk() {
    let (folder, database) = filled().await;
    std::fs::create_dir(folder.path().join("full")).unwrap();
    let script = format!(
        "mount -t tmpfs -o size=64k tmpfs full && {BINARY} backup --database {} full/copy.db",
        database.display()
    );
    let unshare = |script: &str| {
        let mut unshare = Command::new("unshare");
        unshare.args(["--user", "--map-root-user", "--mount", "sh", "-c", script]).current_dir(folder.path()).output()
    };
    if !unshare("mount -t tmpfs tmpfs full").is_ok_and(|done| done.status.success()) {
        skipped("no disk can be mounted here");
        return;
    }
    let refused = unshare(&script).unwrap();
    let text = String::from_utf8_lossy(&refused.stderr);
    assert!(
        !refused.status.success() && text.contains("There is no space left on the disk for full/copy.db"),
        "{text}"
    );
}
