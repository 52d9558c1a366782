//! The service during long computations, failures of background tasks, and with a full disk.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use axum::http::StatusCode;
use futures_util::future::BoxFuture;
use gaitwright_service::dispatch_error::DispatchError;
use gaitwright_service::workers::{Assignment, Dispatch, EngineMessage, InProcess};
use gaitwright_store::TrialId;
use gaitwright_store::studies::StudyState;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::client;
use gaitwright_tests::large;
use gaitwright_tests::service::Service;
use serde_json::json;
use skipped_tests::skipped;
use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn health_responds_while_eight_requests_compute() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let service = Service::start(&database, Analytic::default(), 1).await;
    let (one, other) =
        (service.study(|new| new.number_of_trials = 3).await, service.study(|new| new.number_of_trials = 3).await);
    for study in [one, other] {
        service.wait_for(study, &[StudyState::Finished]).await;
    }
    service.stop().await;
    for study in [one, other] {
        large::fill_to(&database, study, 390).await;
    }
    let service = Service::start(&database, Analytic::default(), 1).await;
    let address = service.listening().await;
    let begun = Instant::now();
    let slow: Vec<_> = (0..8)
        .map(|_| {
            let (address, path) = (address.clone(), format!("/api/v1/study-comparison?ids={one},{other}"));
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
        // A response after the time-out of the client is not a failure here.
        assert!(one.join().unwrap().is_ok_and(|status| status == 200) || computing > Duration::from_secs(9));
    }
    times.sort();
    println!("{} answers in {computing:?}, the slowest after {:?}", times.len(), times.last());
    assert!(times.len() > 5, "the learner was too fast to tell: {computing:?}");
    // The machine may be busy, so most responses must be fast, and none may wait for a computation.
    assert!(times[times.len() / 2] < Duration::from_millis(100), "{times:?}");
    assert!(times[times.len() - 1] < computing / 2, "{computing:?}: {times:?}");
    service.stop().await;
}

/// Sets a pragma of the writing connection.
async fn set(service: &Service, pragma: &str) {
    let mut writer = service.store.write().await.unwrap();
    let pragma = sqlx::AssertSqlSafe(format!("pragma {pragma}"));
    sqlx::query(pragma).execute(&mut **writer).await.unwrap();
}

#[tokio::test]
async fn service_refuses_with_507_on_a_full_disk_and_continues_when_there_is_space() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    // A file that may not grow, in place of a disk that is full.
    set(&service, "max_page_count = 1").await;
    let subject = |number: usize| {
        let notes = "x".repeat(1500);
        json!({"pseudonym": format!("S{number}"), "height_m": 1.7, "body_mass_kg": 70.0, "notes": notes})
    };
    let mut refused = None;
    for number in 0..200 {
        let answer = service.post("/api/v1/subjects", &subject(number)).await;
        if answer.status != StatusCode::CREATED {
            refused = Some((number, answer));
            break;
        }
    }
    let (number, answer) = refused.expect("the file grew");
    assert_eq!(answer.status, StatusCode::INSUFFICIENT_STORAGE, "{}", answer.text);
    assert_eq!(answer.json()["type"], "/problems/storage-full");
    assert!(answer.text.contains("Nothing was changed"), "{}", answer.text);
    set(&service, "max_page_count = 1000000").await;
    assert_eq!(service.post("/api/v1/subjects", &subject(number)).await.status, StatusCode::CREATED);
    service.stop().await;
}

/// A file system of a few megabytes; only root may mount one.
struct SmallDisk(tempfile::TempDir);

impl SmallDisk {
    fn mount() -> Option<Self> {
        let folder = tempfile::tempdir().unwrap();
        let mounted = std::process::Command::new("mount")
            .args(["-t", "tmpfs", "-o", "size=16m", "tmpfs"])
            .arg(folder.path())
            .output()
            .is_ok_and(|output| output.status.success());
        mounted.then_some(Self(folder))
    }
}

impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = std::process::Command::new("umount").arg("--lazy").arg(self.0.path()).status();
    }
}

#[tokio::test]
async fn full_file_system_is_reported_and_loses_no_acknowledged_change() {
    let Some(disk) = SmallDisk::mount() else {
        return skipped("a small disk cannot be mounted here");
    };
    let service = Service::start(&disk.0.path().join("a.db"), Analytic::default(), 1).await;
    service.store.set_reserve(1 << 20);
    let subject = |number: usize| {
        let notes = "x".repeat(3500);
        json!({"pseudonym": format!("S{number}"), "height_m": 1.7, "body_mass_kg": 70.0, "notes": notes})
    };
    let filler = disk.0.path().join("filler");
    let mut acknowledged = Vec::new();
    let mut refused = None;
    for number in 0..2000 {
        if number == 150 {
            // Fails when the disk is full. The write-ahead log was restarted and still accepts some changes.
            let _ = std::fs::write(&filler, vec![0; 16 << 20]);
            assert!(service.store.probe().await.is_err_and(|reason| reason.contains("full")));
        }
        let answer = service.post("/api/v1/subjects", &subject(number)).await;
        if answer.status != StatusCode::CREATED {
            refused = Some(answer);
            break;
        }
        acknowledged.push(answer.json()["id"].as_str().unwrap().to_owned());
    }
    let refused = refused.expect("the disk has no end");
    assert_eq!(refused.status, StatusCode::INSUFFICIENT_STORAGE, "{}", refused.text);
    assert_eq!(refused.json()["type"], "/problems/storage-full");
    let ready = service.fetch("/ready").await;
    assert_eq!(ready.status, StatusCode::SERVICE_UNAVAILABLE, "{}", ready.text);
    assert!(ready.text.contains("is full"), "{}", ready.text);
    let backup = service.post("/api/v1/backups", &json!({})).await;
    assert_eq!(backup.status, StatusCode::INSUFFICIENT_STORAGE, "{}", backup.text);
    assert_eq!(service.fetch("/health").await.json()["status"], "short_of_space");
    assert!(service.fetch("/subjects").await.text.contains("0 MB is free"));

    std::fs::remove_file(&filler).unwrap();
    let answer = service.post("/api/v1/subjects", &subject(3000)).await;
    assert_eq!(answer.status, StatusCode::CREATED, "{}", answer.text);
    for id in &acknowledged {
        assert_eq!(service.fetch(&format!("/api/v1/subjects/{id}")).await.status, StatusCode::OK, "{id}");
    }
    let database = service.store.path().to_owned();
    service.stop().await;
    gaitwright_store::verify::file(&database, &[]).await.unwrap();
    println!("{} acknowledged before the disk was full, all there", acknowledged.len());
}

#[tokio::test]
async fn service_is_not_ready_while_the_record_accepts_no_changes() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    assert_eq!(service.fetch("/ready").await.text, "ready");
    set(&service, "query_only = 1").await;
    tokio::time::sleep(Duration::from_millis(1100)).await;
    let answer = service.fetch("/ready").await;
    assert_eq!(answer.status, StatusCode::SERVICE_UNAVAILABLE, "{}", answer.text);
    assert!(answer.text.contains("The record cannot be written"), "{}", answer.text);
    service.stop().await;
}

#[tokio::test]
async fn low_disk_space_stops_new_studies_but_not_answers() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let study = json!({"subject_id": service.subject().await, "muscles": false, "number_of_trials": 2});
    service.store.set_reserve(u64::MAX);
    let answer = service.post("/api/v1/studies", &study).await;
    assert_eq!(answer.status, StatusCode::INSUFFICIENT_STORAGE, "{}", answer.text);
    assert!(answer.text.contains("The disk is nearly full"), "{}", answer.text);
    let subject = json!({"pseudonym": "S1", "height_m": 1.7, "body_mass_kg": 70.0});
    assert_eq!(service.post("/api/v1/subjects", &subject).await.status, StatusCode::CREATED);
    let ready = service.fetch("/ready").await;
    assert!(ready.status == StatusCode::OK && ready.text.contains("nearly full"), "{}", ready.text);
    for page in ["/", "/studies/new", "/subjects", "/system", "/rate", "/help"] {
        assert!(service.fetch(page).await.text.contains("The disk is nearly full"), "{page}");
    }
    assert_eq!(service.fetch("/health").await.json()["status"], "short_of_space");
    service.store.set_reserve(0);
    let made = service.post("/api/v1/studies", &study).await;
    assert_eq!(made.status, StatusCode::CREATED, "{}", made.text);
    service.stop().await;
}

/// An engine that panics on receiving messages until told to stop.
struct Breaks {
    inner: InProcess,
    broken: Arc<AtomicBool>,
}

impl Dispatch for Breaks {
    fn name(&self) -> &'static str {
        self.inner.name()
    }
    fn size(&self) -> usize {
        self.inner.size()
    }
    fn lease(&self) -> Duration {
        self.inner.lease()
    }
    fn outlives_process(&self) -> bool {
        false
    }
    fn submit(&self, assignment: Assignment) -> BoxFuture<'_, Result<(), DispatchError>> {
        self.inner.submit(assignment)
    }
    fn cancel(&self, trial: TrialId) -> BoxFuture<'_, ()> {
        self.inner.cancel(trial)
    }
    fn next(&self) -> BoxFuture<'_, EngineMessage> {
        assert!(!self.broken.load(Ordering::SeqCst), "the engine broke");
        self.inner.next()
    }
}

#[tokio::test]
async fn panicking_task_is_reported_and_restarted() {
    let folder = tempfile::tempdir().unwrap();
    let broken = Arc::new(AtomicBool::new(true));
    let inner = InProcess::new(1, Arc::new(Analytic::default()));
    let engine = Arc::new(Breaks { inner, broken: Arc::clone(&broken) });
    let service = Service::start_with(&folder.path().join("a.db"), engine).await;
    let mut seen = service.fetch("/ready").await;
    for _ in 0..200 {
        if seen.status == StatusCode::SERVICE_UNAVAILABLE {
            break;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
        seen = service.fetch("/ready").await;
    }
    assert_eq!(seen.status, StatusCode::SERVICE_UNAVAILABLE);
    assert!(seen.text.contains("listening to workers") && seen.text.contains("the engine broke"), "{}", seen.text);
    broken.store(false, Ordering::SeqCst);
    // A study runs to its end after the task was restarted.
    let study = service.study(|new| new.number_of_trials = 2).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    service.stop().await;
}

#[tokio::test]
async fn study_page_with_7300_answers_stays_small_and_fast() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let service = Service::start(&database, Analytic::default(), 1).await;
    let study = service.study(|new| new.number_of_trials = 3).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    service.stop().await;
    large::answer_often(&database, study, 7300).await;
    let service = Service::start(&database, Analytic::default(), 1).await;
    let path = format!("/studies/{study}");
    let mut fastest = Duration::MAX;
    let mut bytes = 0;
    for _ in 0..3 {
        let begun = Instant::now();
        let answer = service.fetch(&path).await;
        fastest = fastest.min(begun.elapsed());
        assert_eq!(answer.status, StatusCode::OK, "{}", answer.text);
        bytes = answer.text.len();
    }
    println!("{bytes} bytes in {fastest:?}");
    assert!(bytes < 100_000, "{bytes} bytes");
    // Four times the limit of a release build, because test builds are not optimised.
    assert!(fastest < Duration::from_millis(400), "{fastest:?}");
    service.stop().await;
}

#[tokio::test]
async fn study_page_with_300_trials_weighs_less_than_150_kb() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let service = Service::start(&database, Analytic::default(), 1).await;
    let study = service.study(|new| new.number_of_trials = 3).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    service.stop().await;
    large::fill_to(&database, study, 300).await;
    let service = Service::start(&database, Analytic::default(), 1).await;
    let page = service.fetch(&format!("/studies/{study}")).await.text;
    assert!(page.contains("Trials 1 to 50 of 300."), "{page}");
    assert_eq!(page.matches("<th scope=\"row\" class=\"number\">").count(), 50);
    println!("{} bytes", page.len());
    assert!(page.len() < 150_000, "{} bytes", page.len());
    // Every trial is on one of the pages that the links lead to.
    let (mut listed, mut path) = (BTreeSet::new(), format!("/studies/{study}"));
    loop {
        let page = service.fetch(&path).await.text;
        let numbers = page.split("<th scope=\"row\" class=\"number\">").skip(1);
        listed.extend(numbers.map(|row| row.split(['>', '<']).nth(2).unwrap().parse::<u32>().unwrap()));
        let next = page.split("<a href=\"").find(|link| link.contains(">Next page<"));
        let Some(next) = next.and_then(|link| link.split("#trials").next()) else { break };
        path = format!("/studies/{study}{}", next.replace("&amp;", "&").replace("&#38;", "&"));
    }
    assert_eq!(listed, (1..=300).collect());
    service.stop().await;
}

#[tokio::test]
async fn pages_of_the_trials_table_neither_repeat_nor_miss_a_trial_while_the_study_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let service = Service::start(&database, Analytic::default(), 1).await;
    let study = service.study(|new| new.number_of_trials = 3).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    service.stop().await;
    large::fill_to(&database, study, 120).await;
    let service = Service::start(&database, Analytic::default(), 1).await;
    let numbers = |page: &str| -> Vec<u32> {
        let rows = page.split("<th scope=\"row\" class=\"number\">").skip(1);
        rows.map(|row| row.split(['>', '<']).nth(2).unwrap().parse().unwrap()).collect()
    };
    let link = |page: &str, text: &str| {
        let found = page.split("<a href=\"").find(|link| link.contains(&format!(">{text}<"))).map(str::to_owned);
        let query = found.and_then(|link| link.split("#trials").next().map(str::to_owned));
        query.map(|query| format!("/studies/{study}{}", query.replace("&amp;", "&").replace("&#38;", "&")))
    };
    for order in ["descending", "ascending"] {
        let filter = format!("/studies/{study}?sort=seconds_total&order={order}&state=converged");
        let first = service.fetch(&filter).await.text;
        assert!(numbers(&first).len() <= 50 && link(&first, "Previous page").is_none());
        let mut pages = vec![numbers(&first)];
        let mut page = first.clone();
        while let Some(next) = link(&page, "Next page") {
            page = service.fetch(&next).await.text;
            pages.push(numbers(&page));
        }
        let mut all = pages.concat();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), pages.concat().len(), "{order}: {pages:?}");
        // The way back shows the same pages.
        for expected in pages.iter().rev().skip(1) {
            page = service.fetch(&link(&page, "Previous page").unwrap()).await.text;
            assert_eq!(&numbers(&page), expected, "{order}");
        }
    }
    // Newer trials come first, and move the others on.
    let first = service.fetch(&format!("/studies/{study}")).await.text;
    let next = link(&first, "Next page").unwrap();
    let extended = service.post(&format!("/api/v1/studies/{study}/extend"), &json!({"number_of_trials": 123})).await;
    assert!(extended.status.is_success(), "{}", extended.text);
    service.wait_for_trials(study, 123).await;
    assert_eq!(numbers(&service.fetch(&next).await.text), (21..=70).rev().collect::<Vec<u32>>());
    let other = next.replace("descending", "ascending");
    assert_eq!(service.fetch(&other).await.status, StatusCode::UNPROCESSABLE_ENTITY, "a cursor belongs to its list");
    service.stop().await;
}

#[tokio::test]
async fn study_form_is_checked_while_another_change_holds_the_writer() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
    let studies = service.fetch("/api/v1/studies").await.text;
    let writer = service.store.write().await.unwrap();
    let described = "subject=new&pseudonym=S77&height_m=1.8&body_mass_kg=70";
    for (subject, accepted) in
        [(described, true), ("subject=new&pseudonym=paper-1&height_m=1.8&body_mass_kg=70", false)]
    {
        let form = "muscles=on&answer_source=gait_rmse&number_of_trials=1&parallel_trials=1&seed=1&tuned_a5=on&reference_gait=";
        let body = format!("{form}&{subject}");
        let asked = service.post_text("/studies/new/check", "application/x-www-form-urlencoded", &body);
        let answer = tokio::time::timeout(Duration::from_secs(5), asked).await.expect("it waits for the writer");
        assert_eq!(answer.status, StatusCode::OK, "{}", answer.text);
        assert_eq!(answer.json()["faults"] == serde_json::json!([]), accepted, "{}", answer.text);
    }
    drop(writer);
    assert_eq!(service.fetch("/api/v1/studies").await.text, studies, "nothing was made");
    service.stop().await;
}
