//! What the service does when computing takes long, a task of its own fails or the disk is full.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright::store::studies::StudyState;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::client;
use gaitwright_tests::large;
use gaitwright_tests::service::Service;
use std::time::{Duration, Instant};

/// The service on a port of its own, for clients that wait at the same time.
async fn listening(service: &Service) -> String {
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let router = service.router();
    tokio::spawn(async move { axum::serve(listener, router).await.unwrap() });
    address
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn health_answers_while_eight_requests_compute() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let service = Service::start(&database, Analytic::default(), 1).await;
    let (one, other) =
        (service.study(|new| new.trial_budget = 3).await, service.study(|new| new.trial_budget = 3).await);
    for study in [one, other] {
        service.wait_for(study, &[StudyState::Finished]).await;
    }
    service.stop().await;
    for study in [one, other] {
        large::fill_to(&database, study, 390).await;
    }
    let service = Service::start(&database, Analytic::default(), 1).await;
    let address = listening(&service).await;
    let begun = Instant::now();
    let slow: Vec<_> = (0..8)
        .map(|_| {
            let (address, path) = (address.clone(), format!("/api/v1/compare?ids={one},{other}"));
            std::thread::spawn(move || client::get(&address, &path).map(|reply| reply.status))
        })
        .collect();
    std::thread::sleep(Duration::from_millis(50));
    let mut times = Vec::new();
    while slow.iter().any(|one| !one.is_finished()) {
        let asked = Instant::now();
        assert_eq!(client::get(&address, "/health").unwrap().status, 200);
        times.push(asked.elapsed());
        std::thread::sleep(Duration::from_millis(10));
    }
    let computing = begun.elapsed();
    for one in slow {
        // Slower than the client waits is no fault here.
        assert!(one.join().unwrap().is_ok_and(|status| status == 200) || computing > Duration::from_secs(9));
    }
    times.sort();
    println!("{} answers in {computing:?}, the slowest after {:?}", times.len(), times.last());
    assert!(times.len() > 5, "the learner was too fast to tell: {computing:?}");
    assert!(times[times.len() * 9 / 10] < Duration::from_millis(100), "{times:?}");
    service.stop().await;
}
