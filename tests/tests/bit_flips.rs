//! `audit verify` detects single flipped bits of a record on the disk.
//!
//! A flip counts when it changes what a reader finds: a row of any table, the schema, or whether the file can be read.
//! Bits without effect (free space of pages, counters of the header) are skipped.
//! `GAITWRIGHT_FLIPS=200 cargo test --workspace --locked --test bit_flips -- --nocapture` flips more bits.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_store::verify;
use gaitwright_tests::every_table::filled;
use sqlx::sqlite::{SqliteConnectOptions, SqliteConnection};
use sqlx::{AssertSqlSafe, Connection};
use std::path::Path;

/// Everything that can be read: the text of each row of each table, in the order of the table.
async fn content(database: &Path) -> Result<Vec<String>, sqlx::Error> {
    let options = SqliteConnectOptions::new().filename(database).read_only(true).immutable(true);
    let mut connection = SqliteConnection::connect_with(&options).await?;
    let sql = "select m.name, group_concat('quote(\"' || c.name || '\")', ' || '','' || ') from sqlite_master m, \
               pragma_table_info(m.name) c where m.type = 'table' group by m.name order by m.name";
    let tables: Vec<(String, String)> = sqlx::query_as(sql).fetch_all(&mut connection).await?;
    let schema = "select quote(type) || quote(name) || quote(tbl_name) || quote(sql) from sqlite_master";
    let mut all: Vec<String> = sqlx::query_scalar(schema).fetch_all(&mut connection).await?;
    for (table, row) in tables {
        let sql = format!("select cast('{table}: ' || {row} as blob) from {table} not indexed");
        let rows: Vec<Option<Vec<u8>>> = sqlx::query_scalar(AssertSqlSafe(sql)).fetch_all(&mut connection).await?;
        all.extend(rows.into_iter().map(|row| format!("{row:?}")));
    }
    connection.close().await?;
    Ok(all)
}

fn splitmix(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[tokio::test]
async fn audit_verify_finds_every_flipped_bit_that_a_reader_can_see() {
    let wanted: usize = std::env::var("GAITWRIGHT_FLIPS").ok().and_then(|text| text.parse().ok()).unwrap_or(40);
    let (folder, database) = filled().await;
    let before = content(&database).await.unwrap();
    verify::file(&database, &[]).await.unwrap();
    let bytes = std::fs::read(&database).unwrap();
    let seed = std::env::var("GAITWRIGHT_FLIPS_SEED").ok().and_then(|text| text.parse().ok()).unwrap_or(20_261_123);
    let (mut random, mut seen, mut passed_over, mut missed) = (seed, 0, 0, Vec::new());
    while seen < wanted {
        let mut flipped = bytes.clone();
        let bit = splitmix(&mut random);
        let place = usize::try_from(bit >> 3).unwrap() % flipped.len();
        flipped[place] ^= 1 << (bit & 7);
        let copy = folder.path().join("flipped.db");
        std::fs::write(&copy, flipped).unwrap();
        let is_found = verify::file(&copy, &[]).await.is_err();
        let after = content(&copy).await;
        let matters = !after.as_ref().is_ok_and(|after| *after == before);
        if matters {
            seen += 1;
            if !is_found {
                let after = after.unwrap_or_default();
                let change = before.iter().zip(&after).find(|(before, after)| before != after);
                let rows = (before.len(), after.len());
                missed.push(format!("byte {place}, bit {}: {rows:?} rows, first change {change:?}", bit & 7));
            }
        } else {
            passed_over += 1;
        }
        for ending in ["-wal", "-shm"] {
            let _ = std::fs::remove_file(folder.path().join(format!("flipped.db{ending}")));
        }
    }
    println!("{seen} flips that a reader can see, {} missed; {passed_over} of bits that nobody reads", missed.len());
    assert!(missed.is_empty(), "{missed:?}");
}
