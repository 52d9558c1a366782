//! Ten thousand trials in one study: no page and no list is slow.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use gaitwright::store::studies::StudyState;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::many_trials::{TRIALS, fill};
use gaitwright_tests::service::Service;
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_millis(200);

#[tokio::test]
async fn ten_thousand_trials_slow_no_page_and_no_list() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let service = Service::start(&database, Analytic::default(), 1).await;
    let study = service.study(|new| new.trial_budget = 3).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let trial = service.trials(study).await[0].id;
    service.stop().await;
    fill(&database, study).await;

    let service = Service::start(&database, Analytic::default(), 1).await;
    let api = format!("/api/v1/studies/{study}");
    let mut slow = Vec::new();
    for path in [
        "/".to_owned(),
        format!("/studies/{study}"),
        format!("/studies/{study}/live"),
        format!("/studies/{study}?sort=a5&order=ascending&state=converged&contains=drawn&page=3"),
        format!("/studies/{study}/belief"),
        "/system".to_owned(),
        format!("/studies/{study}/compare"),
        format!("/trials/{trial}"),
        "/api/v1/studies".to_owned(),
        api.clone(),
        format!("{api}/trials?after=9000"),
        format!("{api}/preferences?after=9000&limit=200"),
        format!("{api}/raters"),
        "/api/v1/audit".to_owned(),
        "/metrics".to_owned(),
    ] {
        let mut fastest = Duration::MAX;
        for _ in 0..3 {
            let begun = Instant::now();
            let answer = service.fetch(&path).await;
            fastest = fastest.min(begun.elapsed());
            assert_eq!(answer.status, StatusCode::OK, "{path}: {}", answer.text);
            assert!(answer.text.len() < 2_000_000, "{path}: {} bytes", answer.text.len());
        }
        println!("{:>6.1} ms  {}", fastest.as_secs_f64() * 1e3, path.replace(&study.to_string(), "STUDY"));
        if fastest > LIMIT {
            slow.push(format!("{path}: {fastest:?}"));
        }
    }
    assert!(slow.is_empty(), "{slow:?}");
    // Every trial can be had, page by page.
    let (mut after, mut seen) = (0, 0);
    loop {
        let page = service.fetch(&format!("{api}/trials?limit=1000&after={after}")).await.json();
        seen += page["trials"].as_array().unwrap().len();
        match page["next"].as_u64() {
            Some(next) => after = next,
            None => break,
        }
    }
    assert_eq!(seen, TRIALS as usize);
    service.stop().await;
}
