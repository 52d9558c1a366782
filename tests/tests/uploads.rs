//! Bodies that are too large, over a connection: a client that sends its whole body first still gets the answer.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::client;
use gaitwright_tests::service::Service;

const UNKNOWN: &str = "01890000-0000-7000-8000-000000000000";
const UPLOAD_LIMIT: usize = 8 << 20;

#[tokio::test]
async fn body_above_the_limit_is_answered_with_413_on_every_upload_path() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let address = service.listening().await;
    let post = async |path: &str, length: usize| {
        let (address, path) = (address.clone(), path.to_owned());
        let send = move || client::send(&address, "POST", &path, &"x".repeat(length));
        #[allow(clippy::disallowed_methods)] // a test waits for a process or a thread
        tokio::task::spawn_blocking(send).await.unwrap()
    };
    let of_session = |kind: &str| format!("/lab-sessions/{UNKNOWN}/measurement-files/{kind}");
    for page in ["/reference-gaits".to_owned(), of_session("emg"), of_session("joint-angles")] {
        let operation = format!("/api/v1{page}");
        for length in [UPLOAD_LIMIT + 1, 3 * UPLOAD_LIMIT] {
            let refused = post(&operation, length).await.unwrap();
            assert_eq!(refused.status, 413, "{operation}: {}", refused.body);
            assert!(refused.head.to_lowercase().contains("content-type: application/problem+json"), "{}", refused.head);
            let problem = refused.json();
            assert_eq!(problem["type"], "/problems/too-large", "{problem}");
            assert!(problem["detail"].as_str().unwrap().contains("8 MiB"), "{problem}");
        }
        for length in [2 * UPLOAD_LIMIT + 1, 5 * UPLOAD_LIMIT] {
            let refused = post(&page, length).await.unwrap();
            assert_eq!(refused.status, 413, "{page}: {}", refused.body);
        }
        let accepted = post(&operation, UPLOAD_LIMIT).await.unwrap();
        assert_ne!(accepted.status, 413, "{operation}: {}", accepted.body);
    }
    // A minute of six channels at 2000 Hz, as a form encodes it: three bytes for each comma and each end of a line.
    let row = [["-0.01234"; 6].join("%2C"), "%0A".to_owned()].concat();
    let page = of_session("emg");
    let accepted = post(&page, "recording=".len() + 120_000 * row.len()).await.unwrap();
    assert_ne!(accepted.status, 413, "{page}: {}", accepted.body);
    let refused = post("/api/v1/subjects", 2 << 20).await.unwrap();
    assert_eq!((refused.status, &refused.json()["type"]), (413, &"/problems/too-large".into()));
    service.stop().await;
}
