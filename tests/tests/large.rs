//! A study with ten thousand trials: no page and no list is slow.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_store::Store;
use gaitwright_tests::large::{self, TRIALS};
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(1);

#[tokio::test]
async fn pages_and_lists_stay_fast_with_ten_thousand_trials() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let (service, study, trial) = large::service(&database).await;
    let times = large::times(&service, study, trial).await;
    for (path, time) in &times {
        println!("{:>6.1} ms  {path}", time.as_secs_f64() * 1e3);
    }
    let slow: Vec<_> = times.iter().filter(|(_, time)| *time > LIMIT).collect();
    assert!(slow.is_empty(), "{slow:?}");
    let api = format!("/api/v1/studies/{study}");
    // Every trial can be fetched, page by page.
    let (mut cursor, mut seen) = (String::new(), 0);
    loop {
        let page = service.fetch(&format!("{api}/trials?limit=1000{cursor}")).await.json();
        seen += page["items"].as_array().unwrap().len();
        match page["next"].as_str() {
            Some(next) => cursor = format!("&cursor={next}"),
            None => break,
        }
    }
    assert_eq!(seen, TRIALS as usize);
    service.stop().await;
    // Opening the record verifies every row. The time is printed, but not tested.
    let begun = Instant::now();
    let store = Store::open(&database).await.unwrap();
    println!("{:>6.1} ms  opening the record", begun.elapsed().as_secs_f64() * 1e3);
    store.close().await;
}
