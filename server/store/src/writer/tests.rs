//! Tests of the writing connection.

use super::*;
use sqlx::sqlite::SqliteConnectOptions;

async fn open(file: &std::path::Path) -> SqliteConnection {
    let options = SqliteConnectOptions::new().filename(file).create_if_missing(true);
    SqliteConnection::connect_with(&options.journal_mode(sqlx::sqlite::SqliteJournalMode::Wal)).await.unwrap()
}

async fn table(file: &std::path::Path) -> Writing {
    let mut connection = open(file).await;
    run(&mut connection, "create table t (x integer primary key) strict").await.unwrap();
    Writing::new(connection, None, Space::of(file), Outside::default())
}

async fn insert(writer: &mut Writer, x: i64) -> Result<(), sqlx::Error> {
    sqlx::query("insert into t (x) values (?)").bind(x).execute(&mut **writer).await.map(drop)
}

/// The rows that another connection sees.
async fn rows(file: &std::path::Path) -> Vec<i64> {
    let rows = sqlx::query("select x from t order by x").fetch_all(&mut open(file).await).await.unwrap();
    rows.iter().map(|row| row.get(0)).collect()
}

#[tokio::test]
async fn acknowledged_change_is_visible_and_dropped_change_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.db");
    let writing = table(&file).await;
    let mut kept = writing.begin().await.unwrap();
    insert(&mut kept, 1).await.unwrap();
    kept.commit().await.unwrap();
    assert_eq!(rows(&file).await, [1]);
    let mut dropped = writing.begin().await.unwrap();
    insert(&mut dropped, 2).await.unwrap();
    assert!(insert(&mut dropped, 1).await.is_err());
    drop(dropped);
    let mut after = writing.begin().await.unwrap();
    insert(&mut after, 3).await.unwrap();
    after.commit().await.unwrap();
    assert_eq!(rows(&file).await, [1, 3]);
    writing.close().await;
    assert!(matches!(writing.begin().await, Err(StoreError::Closed)));
}

#[tokio::test]
async fn parallel_changes_all_happen_and_failed_ones_affect_no_others() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.db");
    let writing = Arc::new(table(&file).await);
    let changes = (0..200_i64).map(|x| {
        let writing = Arc::clone(&writing);
        tokio::spawn(async move {
            let mut writer = writing.begin().await.unwrap();
            insert(&mut writer, x).await.unwrap();
            if x % 3 == 0 { drop(writer) } else { writer.commit().await.unwrap() }
        })
    });
    for change in changes.collect::<Vec<_>>() {
        change.await.unwrap();
    }
    writing.close().await;
    assert_eq!(rows(&file).await, (0..200).filter(|x| x % 3 != 0).collect::<Vec<_>>());
}

#[tokio::test]
async fn all_changes_of_a_rolled_back_transaction_fail() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.db");
    let writing = table(&file).await;
    let mut first = writing.begin().await.unwrap();
    insert(&mut first, 1).await.unwrap();
    // As when the disk is full, the whole transaction is rolled back.
    run(&mut first, "rollback").await.unwrap();
    assert!(first.commit().await.is_err());
    let mut second = writing.begin().await.unwrap();
    insert(&mut second, 2).await.unwrap();
    second.commit().await.unwrap();
    assert_eq!(rows(&file).await, [2]);
    writing.close().await;
}

/// Otherwise a loss of power could take back changes that were acknowledged.
#[tokio::test]
async fn writing_connection_syncs_the_log_at_every_commit() {
    let folder = tempfile::tempdir().unwrap();
    let store = crate::Store::open(&folder.path().join("a.db")).await.unwrap();
    let mut writer = store.write().await.unwrap();
    let journal_mode: String = sqlx::query_scalar("pragma journal_mode").fetch_one(&mut **writer).await.unwrap();
    let synchronous: i64 = sqlx::query_scalar("pragma synchronous").fetch_one(&mut **writer).await.unwrap();
    assert_eq!((journal_mode.as_str(), synchronous), ("wal", FULL));
    drop(writer);
    store.close().await;
}

/// The value of `pragma synchronous` for FULL.
const FULL: i64 = 2;
