//! Every row with evidence is sealed, and changes outside the program are detected.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_store::seals::{self, SealCheck};
use gaitwright_store::{Store, StoreError, audit, commit, read_only, verify as store_verify};
use gaitwright_tests::every_table::filled;
use sha2::{Digest, Sha256};
use sqlx::sqlite::{SqliteConnectOptions, SqliteConnection};
use sqlx::{AssertSqlSafe, Connection, Row};
use std::path::{Path, PathBuf};

async fn open(database: &Path) -> SqliteConnection {
    let options = SqliteConnectOptions::new().filename(database).foreign_keys(false);
    SqliteConnection::connect_with(&options).await.unwrap()
}

async fn verify(database: &Path) -> SealCheck {
    let pool = read_only::open(database).await.unwrap();
    seals::verify(&mut pool.acquire().await.unwrap()).await.unwrap()
}

/// A copy of the record after this change with SQLite, without any other trace.
async fn touched(database: &Path, sql: &str) -> PathBuf {
    let copy = database.with_file_name("touched.db");
    std::fs::copy(database, &copy).unwrap();
    let mut connection = open(&copy).await;
    let triggers = sqlx::query("select name, sql from sqlite_master where type = 'trigger'");
    let triggers = triggers.fetch_all(&mut connection).await.unwrap();
    for trigger in &triggers {
        let drop = format!("drop trigger {}", trigger.get::<&str, _>(0));
        sqlx::query(AssertSqlSafe(drop)).execute(&mut connection).await.unwrap();
    }
    sqlx::query("pragma ignore_check_constraints = on").execute(&mut connection).await.unwrap();
    let done = sqlx::query(AssertSqlSafe(sql.to_owned())).execute(&mut connection).await.unwrap();
    assert!(done.rows_affected() > 0, "{sql}");
    for trigger in &triggers {
        sqlx::query(AssertSqlSafe(trigger.get::<String, _>(1))).execute(&mut connection).await.unwrap();
    }
    connection.close().await.unwrap();
    copy
}

#[tokio::test]
async fn audit_verify_finds_rows_that_another_program_changed_added_or_deleted() {
    let (_folder, database) = filled().await;
    assert!(matches!(verify(&database).await, SealCheck::Intact { .. }));
    for sealed in seals::TABLES {
        let (table, key) = (sealed.table, sealed.key[0]);
        let written = match table {
            "attempts" => "received_at",
            "explanations" => "program",
            "other_local_optima" => "gait_sha256",
            "safety_review_reports" => "report_id",
            _ => "created_at",
        };
        for sql in [
            format!("update {table} set {written} = {written} || '0' where {key} = (select max({key}) from {table})"),
            format!("delete from {table} where {key} = (select max({key}) from {table})"),
        ] {
            let found = verify(&touched(&database, &sql).await).await;
            let named = match &found {
                SealCheck::Touched { table, .. } => table,
                // A row whose key was changed is one without a seal.
                SealCheck::Unsealed { table, .. } if written == "report_id" => table,
                _ => panic!("{sql}: {found:?}"),
            };
            assert_eq!(named, table, "{sql}");
        }
    }
    for (sql, table) in [
        ("update gaits set gait = x'00'", "gaits"),
        ("update trials set gait_rmse_rad = gait_rmse_rad + 1e-12", "trials"),
        ("update studies set seed = seed + 1", "studies"),
        ("update users set role = 'administrator'", "users"),
        ("update feedback set replaces = null where replaces is not null", "feedback"),
        ("update feedback set restores = null where restores is not null", "feedback"),
        ("update assessments set replaces = null where replaces is not null", "assessments"),
        (
            "insert into feedback (id, study_id, kind, trial_a, trial_b, source, author, created_at) \
             select 'x', study_id, 'no_difference', min(id), max(id), 'subject', 'K', '' from trials group by study_id",
            "feedback",
        ),
    ] {
        let found = verify(&touched(&database, sql).await).await;
        let (SealCheck::Touched { table: named, .. } | SealCheck::Unsealed { table: named, .. }) = &found else {
            panic!("{sql}: {found:?}")
        };
        assert_eq!(named, table, "{sql}");
    }
}

#[tokio::test]
async fn audit_verify_finds_missing_seals_and_audit_rows_at_the_end() {
    let (_folder, database) = filled().await;
    let SealCheck::Intact { seals: count, .. } = verify(&database).await else { panic!("whole") };
    let count = i64::try_from(count).unwrap();
    for (sql, seq) in [
        (format!("delete from seals where seq = {count}"), count),
        ("delete from seals where seq = 3".to_owned(), 4),
        ("update seals set sha256 = '' where seq = 5".to_owned(), 5),
    ] {
        assert_eq!(verify(&touched(&database, &sql).await).await, SealCheck::Broken { seq }, "{sql}");
    }
    let cut = touched(&database, "delete from audit where seq = (select max(seq) from audit)").await;
    let pool = read_only::open(&cut).await.unwrap();
    let found = audit::verify(&mut pool.acquire().await.unwrap()).await.unwrap();
    assert!(matches!(found, audit::ChainCheck::Broken { .. }), "{found:?}");
}

/// A copy of a row with a different key.
async fn forged(connection: &mut SqliteConnection, table: &str, key: &[&str]) -> String {
    // Empty where nobody signs in.
    let whole_row = match table {
        "clock" => Some("1, '2000-01-01T00:00:00.000Z'"),
        "sign_in_failures" => Some("'ada', '192.0.2.1', 1, '2000-01-01T00:00:00.000Z', '2000-01-01T00:00:00.000Z'"),
        "sign_in_sources" => Some("'192.0.2.0', 1, 1, '2000-01-01T00:00:00.000Z', '2000-01-01T00:00:00.000Z'"),
        _ => None,
    };
    if let Some(row) = whole_row {
        return format!("insert or replace into {table} values ({row})");
    }
    let columns = "select name from pragma_table_info(?) order by cid";
    let columns: Vec<String> = sqlx::query_scalar(columns).bind(table).fetch_all(connection).await.unwrap();
    let last = *key.last().unwrap();
    let value = |column: &String| match (table, column.as_str()) {
        (_, column) if column == last && ["seq", "attempt", "version", "format_version"].contains(&last) => {
            format!("{column} + 1000")
        }
        (_, column) if column == last && ["feedback_seq", "number"].contains(&last) => format!("{column} + 1000"),
        ("lab_session_steps", "step") => "'closed'".to_owned(),
        // Only one explanation of a trial is complete.
        ("explanations", "stopped_early") => "1".to_owned(),
        ("blind_pairs" | "trials" | "lab_sessions", "number") => format!("{column} + 1000"),
        (_, "hash" | "code") => "hex(randomblob(32))".to_owned(),
        ("feedback", "kind") => "'no_difference'".to_owned(),
        // An answer is replaced once and brought back once.
        (_, "replaces" | "restores") => "null".to_owned(),
        (_, "id" | "sha256" | "pseudonym" | "name") | ("solve_jobs", "trial_id") => "hex(randomblob(8))".to_owned(),
        (_, column) if column == last => "hex(randomblob(8))".to_owned(),
        (_, column) => column.to_owned(),
    };
    let values: Vec<String> = columns.iter().map(value).collect();
    format!("insert into {table} ({}) select {} from {table} limit 1", columns.join(", "), values.join(", "))
}

#[tokio::test]
async fn record_with_a_forged_row_is_not_opened() {
    let (_folder, database) = filled().await;
    let (mut tables, mut found) = (0, 0);
    for sealed in seals::TABLES.iter().chain(seals::CHECKED) {
        let table = sealed.table;
        let sql = forged(&mut open(&database).await, table, sealed.key).await;
        let copy = touched(&database, &sql).await;
        let before = std::fs::read(&copy).unwrap();
        let refused = Store::open(&copy).await;
        tables += 1;
        let at_open = matches!(&refused, Err(StoreError::Unsealed { table: named, .. }) if named == table);
        let newer = table == "_sqlx_migrations" && matches!(&refused, Err(StoreError::NewerSchema { .. }));
        assert!(at_open || newer, "{sql}: {:?}", refused.err());
        let refused = store_verify::file(&copy, &[]).await;
        assert!(refused.is_err(), "{sql}");
        assert_eq!(std::fs::read(&copy).unwrap(), before, "{sql}: nothing was changed");
        found += 1;
    }
    println!("{found} of {tables} forged rows found at open and by audit verify");
}

#[tokio::test]
async fn record_with_a_changed_or_deleted_row_or_schema_is_not_opened() {
    let (_folder, database) = filled().await;
    let mut statements = vec![
        "delete from audit where seq = 2".to_owned(),
        "delete from audit where seq = (select max(seq) from audit)".to_owned(),
        "update audit set actor = 'x' where seq = 1".to_owned(),
        "delete from seals where seq = (select max(seq) from seals)".to_owned(),
        "delete from checksums where table_name = 'solve_jobs'".to_owned(),
    ];
    for sealed in seals::TABLES.iter().chain(seals::CHECKED) {
        let table = sealed.table;
        let rows: i64 = sqlx::query_scalar(AssertSqlSafe(format!("select count(*) from {table}")))
            .fetch_one(&mut open(&database).await)
            .await
            .unwrap();
        if rows == 0 || table == "_sqlx_migrations" {
            continue;
        }
        let columns = "select name from pragma_table_info(?) where not pk order by cid limit 1";
        let column = sqlx::query_scalar(columns).bind(table).fetch_optional(&mut open(&database).await).await.unwrap();
        let column: String = column.unwrap_or_else(|| sealed.key[0].to_owned());
        statements.push(format!("update {table} set {column} = {column} || '1' where {column} is not null"));
        statements.push(format!("delete from {table}"));
    }
    for sql in &statements {
        let copy = touched(&database, sql).await;
        let before = std::fs::read(&copy).unwrap();
        let refused = Store::open(&copy).await;
        let known = matches!(&refused, Err(StoreError::Damaged { .. } | StoreError::Unsealed { .. }));
        assert!(known, "{sql}: {:?}", refused.err());
        assert_eq!(std::fs::read(&copy).unwrap(), before, "{sql}: nothing was changed");
    }
    println!("{} changed or deleted rows keep the record from opening", statements.len());
    for sql in [
        "drop trigger users_no_delete",
        "drop trigger feedback_no_update",
        "create trigger evil after insert on assessments begin delete from events; end",
        "create table more (x)",
        "create view v as select 1",
        "create index i on users (role)",
    ] {
        let copy = database.with_file_name("schema.db");
        std::fs::copy(&database, &copy).unwrap();
        let mut connection = open(&copy).await;
        sqlx::query(sql).execute(&mut connection).await.unwrap();
        connection.close().await.unwrap();
        let refused = Store::open(&copy).await;
        assert!(matches!(&refused, Err(StoreError::Damaged { .. })), "{sql}: {:?}", refused.err());
    }
}

/// Writes without a seal through the writing connection, as if another program had done it unnoticed.
async fn unnoticed(store: &Store, table: &str, sql: &str) {
    let mut writer = store.write().await.unwrap();
    let triggers = "select name, sql from sqlite_temp_master where type = 'trigger' and tbl_name = ?";
    let triggers: Vec<(String, String)> = sqlx::query_as(triggers).bind(table).fetch_all(&mut **writer).await.unwrap();
    assert_eq!(triggers.len(), 3, "{table}");
    for (name, _) in &triggers {
        sqlx::query(AssertSqlSafe(format!("drop trigger temp.{name}"))).execute(&mut **writer).await.unwrap();
    }
    let done = sqlx::query(AssertSqlSafe(sql.to_owned())).execute(&mut **writer).await.unwrap();
    assert!(done.rows_affected() > 0, "{sql}");
    for (_, text) in &triggers {
        let text = text.replacen("CREATE TRIGGER", "create temp trigger", 1);
        sqlx::query(AssertSqlSafe(text)).execute(&mut **writer).await.unwrap();
    }
    commit(writer).await.unwrap();
}

#[tokio::test]
async fn later_change_does_not_seal_a_row_of_another_program() {
    let (folder, database) = filled().await;
    let user = "insert into users (id, name, role, created_at) values ('mallory', 'mallory', 'administrator', '')";
    for (table, sql, change) in [
        ("users", user, "update users set password = 'x' where id = 'mallory'"),
        ("users", "update users set role = 'administrator'", "update users set password = 'x'"),
        ("studies", "update studies set created_at = '2000'", "update studies set name = name || '2'"),
        ("studies", "update studies set created_at = '2000'", "update studies set created_at = created_at"),
        ("tokens", "update tokens set scopes = '[\"administer\"]'", "update tokens set revoked_at = '2000'"),
        ("sessions", "update sessions set by_link = 1 - by_link", "update sessions set seen_at = '2000'"),
        ("sessions", "update sessions set by_link = 1 - by_link", "delete from sessions"),
        ("sign_in_links", "update sign_in_links set expires_at = '9999'", "update sign_in_links set used_at = '2000'"),
        ("sign_in_links", "update sign_in_links set expires_at = '9999'", "delete from sign_in_links"),
        ("solve_jobs", "update solve_jobs set failures = failures + 1", "update solve_jobs set state = state"),
        ("idempotency_keys", "update idempotency_keys set body = 'x'", "delete from idempotency_keys"),
    ] {
        let copy = folder.path().join("copy.db");
        for ending in ["", "-wal", "-shm", ".anchor"] {
            let _ = std::fs::remove_file(folder.path().join(format!("copy.db{ending}")));
        }
        std::fs::copy(&database, &copy).unwrap();
        let store = Store::open(&copy).await.unwrap();
        // Before another program changes a row, the service can make this change.
        if sql != user {
            let mut writer = store.write().await.unwrap();
            let done = sqlx::query(AssertSqlSafe(change)).execute(&mut **writer).await.unwrap();
            if done.rows_affected() == 0 {
                println!("no rows for {change}");
                drop(writer);
                store.close().await;
                continue;
            }
            if change.starts_with("update") {
                commit(writer).await.unwrap();
            }
        }

        unnoticed(&store, table, sql).await;
        let mut writer = store.write().await.unwrap();
        sqlx::query(AssertSqlSafe(change)).execute(&mut **writer).await.unwrap();
        let refused = commit(writer).await;
        let text = format!("{refused:?}");
        assert!(matches!(refused, Err(StoreError::Damaged { .. })) && text.contains(table), "{sql}, {change}: {text}");
        let found = seals::verify(&mut store.read().await.unwrap()).await.unwrap();
        assert!(!matches!(found, SealCheck::Intact { .. }), "{sql}, {change}: the forged row was sealed");
        // Other changes are still possible.
        commit(store.write().await.unwrap()).await.unwrap();
        store.close().await;
    }
}

/// Appends a seal with a valid hash.
async fn append_seal(database: &Path, table: &str, key: &str) {
    let mut connection = open(database).await;
    let last = "select hash from seals order by seq desc limit 1";
    let previous: String = sqlx::query_scalar(last).fetch_one(&mut connection).await.unwrap();
    let sha256 = "0".repeat(64);
    let hash = hex::encode(Sha256::digest(format!("{previous}\n{sha256}\n{table}\n{key}")));
    let append = "insert into seals (table_name, key, sha256, previous, hash) values (?, ?, ?, ?, ?)";
    let append = sqlx::query(append).bind(table).bind(key).bind(sha256).bind(previous).bind(hash);
    append.execute(&mut connection).await.unwrap();
    connection.close().await.unwrap();
}

#[tokio::test]
async fn audit_verify_finds_a_seal_of_an_unknown_table() {
    let (_folder, database) = filled().await;
    let (table, key) = ("unknown", "01890000-0000-7000-8000-000000000000");
    append_seal(&database, table, key).await;
    assert_eq!(verify(&database).await, SealCheck::Touched { table: table.to_owned(), key: key.to_owned() });
    assert!(matches!(Store::open(&database).await, Err(StoreError::Damaged { .. })));
}

#[tokio::test]
async fn one_change_can_add_change_and_delete_a_row_repeatedly() {
    let (_folder, database) = filled().await;
    let store = Store::open(&database).await.unwrap();
    let link = "insert into sign_in_links (hash, user_id, created_at, expires_at) \
                select substr(hex(zeroblob(32)), 1, 63) || 'a', id, '2000', '2001' from users limit 1";
    let mut writer = store.write().await.unwrap();
    for sql in [
        link,
        "update sign_in_links set used_at = '2000'",
        "update sign_in_links set used_at = '2001'",
        "delete from sign_in_links",
        link,
        "update studies set name = name || '2'",
        "update studies set name = name || '3'",
    ] {
        sqlx::query(sql).execute(&mut **writer).await.unwrap();
    }
    commit(writer).await.unwrap();
    let mut writer = store.write().await.unwrap();
    for sql in ["delete from sign_in_links", "update studies set name = name || '4'"] {
        sqlx::query(sql).execute(&mut **writer).await.unwrap();
    }
    commit(writer).await.unwrap();
    store.close().await;
    store_verify::file(&database, &[]).await.unwrap();
}

#[tokio::test]
async fn audit_verify_finds_a_changed_row_of_a_table_with_checksums() {
    let (_folder, database) = filled().await;
    store_verify::file(&database, &[]).await.unwrap();
    for (sql, table) in [
        ("update events set payload = '{}' where seq = 1", "events"),
        ("delete from events where seq = 1", "events"),
        ("update solve_jobs set failures = 1", "solve_jobs"),
        ("update sessions set by_link = 1", "sessions"),
        ("update sign_in_links set expires_at = '9999'", "sign_in_links"),
        ("update idempotency_keys set body = 'x'", "idempotency_keys"),
        ("delete from idempotency_keys", "idempotency_keys"),
        ("update _sqlx_migrations set execution_time = 7", "_sqlx_migrations"),
    ] {
        let found = verify(&touched(&database, sql).await).await;
        assert!(matches!(&found, SealCheck::Touched { table: named, .. } if named == table), "{sql}: {found:?}");
    }
    let copy = touched(&database, "update events set payload = '{}' where seq = 1").await;
    let mut connection = open(&copy).await;
    sqlx::query("drop trigger feedback_no_update").execute(&mut connection).await.unwrap();
    connection.close().await.unwrap();
    let refused = store_verify::file(&copy, &[]).await.unwrap_err().to_string();
    assert!(refused.contains("trigger feedback_no_update"), "{refused}");
}

#[tokio::test]
async fn every_table_is_sealed_or_has_checksums() {
    let (_folder, database) = filled().await;
    let tables = "select name from sqlite_master where type = 'table' and name not glob 'sqlite_*'";
    let mut connection = open(&database).await;
    for row in sqlx::query(tables).fetch_all(&mut connection).await.unwrap() {
        let table: &str = row.get(0);
        let mut known = seals::TABLES.iter().chain(seals::CHECKED);
        let known = known.any(|sealed| sealed.table == table) || seals::NOT_SEALED.contains(&table);
        assert!(known, "{table}: name it in store/src/seals/tables.rs, in TABLES or in CHECKED");
    }
}
