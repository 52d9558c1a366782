//! Files that are not records of this program, and other names of a record.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_store::{Store, StoreError};
use gaitwright_tests::cli;
use sqlx::sqlite::{SqliteConnectOptions, SqlitePool};
use std::path::Path;

async fn write(database: &Path, sql: &'static str) {
    let options = SqliteConnectOptions::new().filename(database).create_if_missing(true);
    let pool = SqlitePool::connect_with(options).await.unwrap();
    sqlx::raw_sql(sql).execute(&pool).await.unwrap();
    pool.close().await;
}

const LIST: &str = "create table _sqlx_migrations (version bigint primary key, description text not null, installed_on \
                    timestamp not null default current_timestamp, success boolean not null, checksum blob not null, \
                    execution_time bigint not null)";

#[tokio::test]
async fn database_of_another_program_is_refused_and_unchanged() {
    let users = format!("{LIST}; insert into _sqlx_migrations values (1, 'users', '2026-01-01', true, x'00', 1)");
    let users: &'static str = users.leak();
    for (sql, why) in [("create table notes (text)", "has the table \"notes\""), (users, "has its own migrations")] {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("other.db");
        write(&file, sql).await;
        let (bytes, files) = (std::fs::read(&file).unwrap(), cli::files(folder.path()));
        for command in [
            &["tune", "--trials", "1", "--muscles", "off"][..],
            &["serve", "--listen", "127.0.0.1:0"],
            &["prune", "--older-than-days", "1"],
            &["audit", "verify"],
            &["backup", "copy.db"],
        ] {
            let binary = env!("CARGO_BIN_EXE_gaitwright-cli");
            let output = cli::run(binary, folder.path(), &[command, &["--database", "other.db"]].concat());
            let text = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(2), "{command:?}: {text}");
            assert!(
                text.contains("other.db is not a Gaitwright database") && text.contains(why),
                "{command:?}: {text}"
            );
            assert_eq!(std::fs::read(&file).unwrap(), bytes, "{command:?}");
            assert_eq!(cli::files(folder.path()), files, "{command:?} left something behind");
        }
    }
}

/// The file that remains if a process is killed while creating a record.
#[tokio::test]
async fn interrupted_creation_of_a_record_is_completed() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("new.db");
    write(&file, LIST).await;
    Store::open(&file).await.unwrap().close().await;
}

#[tokio::test]
async fn link_to_a_record_in_use_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.db");
    let store = Store::open(&file).await.unwrap();
    let link = folder.path().join("link.db");
    std::os::unix::fs::symlink(&file, &link).unwrap();
    for path in [&file, &link] {
        assert!(matches!(Store::open(path).await, Err(StoreError::InUse { .. })), "{}", path.display());
    }
    store.close().await;
}
