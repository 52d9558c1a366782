//! Writes a record of this version with a row in every table. The repository has such a record for each schema version,
//! to test upgrades.
//!
//! `cargo run -p gaitwright-tests --example every_table -- tests/records/v1.db.zst`

#![allow(clippy::unwrap_used, clippy::expect_used)]

use gaitwright_store::backup;
use gaitwright_tests::every_table;

/// The strongest compression that does not need more memory for decompression.
const LEVEL: i32 = 19;

#[tokio::main]
async fn main() {
    let to = std::env::args().nth(1).expect("where the compressed record goes");
    let (folder, database) = every_table::filled().await;
    // A copy, because part of a record may be in its log.
    let copy = folder.path().join("copy.db");
    backup::of_file(&database, &copy).await.unwrap();
    let record = std::fs::read(copy).unwrap();
    let packed = zstd::encode_all(record.as_slice(), LEVEL).unwrap();
    println!("{to}: {} bytes, {} uncompressed", packed.len(), record.len());
    std::fs::write(to, packed).unwrap();
}
