//! Load over loopback on a study with ten thousand trials, while real solves occupy a processor: several people write
//! durable preferences at a steady total rate, and others read. Then, without other load, the pages of such a study.
//!
//! `cargo run --release -p gaitwright-tests --example load -- [SECONDS] [WRITES_PER_SECOND]`
//!
//! `RUST_LOG=sqlx::query=debug` writes each statement with its time to standard error.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gait_optimizer::{CancelToken, IterationRecord, SolveOutcome};
use gaitwright_service::studies::identical_gaits::is_same_gait;
use gaitwright_service::workers::{Assignment, Evaluate, GaitSolver};
use gaitwright_store::studies::{AnswerSource, StudyState};
use gaitwright_store::trials::{Trial, TrialState};
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::large;
use gaitwright_tests::service::Service;
use serde_json::json;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// Number of people who write at the same time.
const RATERS: usize = 8;

/// Studies with muscles are solved, others answered at once.
struct Both(Analytic);

impl Evaluate for Both {
    fn evaluate(
        &self,
        assignment: &Assignment,
        observer: &mut dyn FnMut(&IterationRecord),
        cancel: &CancelToken,
    ) -> Result<SolveOutcome, String> {
        if assignment.problem.muscles {
            GaitSolver.evaluate(assignment, observer, cancel)
        } else {
            self.0.evaluate(assignment, observer, cancel)
        }
    }
}

/// A persistent connection.
struct Connection(BufReader<TcpStream>);

impl Connection {
    fn open(address: &str) -> Self {
        let stream = TcpStream::connect(address).unwrap();
        stream.set_nodelay(true).unwrap();
        Self(BufReader::new(stream))
    }

    fn send(&mut self, method: &str, path: &str, body: &str) -> u16 {
        let request = format!(
            "{method} {path} HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\ncontent-length: {}\r\n\r\n{body}",
            body.len()
        );
        self.0.get_mut().write_all(request.as_bytes()).unwrap();
        let (mut status, mut length) = (0, 0);
        loop {
            let mut line = String::new();
            self.0.read_line(&mut line).unwrap();
            let line = line.trim_end().to_ascii_lowercase();
            if let Some(rest) = line.strip_prefix("http/1.1 ") {
                status = rest[..3].parse().unwrap();
            } else if let Some(rest) = line.strip_prefix("content-length: ") {
                length = rest.parse().unwrap();
            } else if line.is_empty() {
                break;
            }
        }
        let mut bytes = vec![0; length];
        self.0.read_exact(&mut bytes).unwrap();
        status
    }
}

fn report(what: &str, mut times: Vec<Duration>, seconds: f64) {
    times.sort();
    let at = |percent: usize| times[(times.len() - 1) * percent / 100].as_secs_f64() * 1e3;
    println!(
        "{what}: {:.0} requests/s, p50 {:.2} ms, p99 {:.2} ms, slowest {:.2} ms ({} requests)",
        times.len() as f64 / seconds,
        at(50),
        at(99),
        at(100),
        times.len()
    );
}

#[tokio::main]
async fn main() {
    if let Ok(filter) = std::env::var("RUST_LOG") {
        tracing_subscriber::fmt().with_env_filter(filter).with_ansi(false).with_writer(std::io::stderr).init();
    }
    let mut arguments = std::env::args().skip(1);
    let seconds: f64 = arguments.next().map_or(20.0, |text| text.parse().expect("seconds"));
    let rate: f64 = arguments.next().map_or(200.0, |text| text.parse().expect("writes per second"));
    let folder = tempfile::tempdir().unwrap();
    let database = folder.path().join("a.db");
    let service = Service::start(&database, Analytic::default(), 1).await;
    let mixed = AnswerSource::Both;
    let study = service.study(|new| (new.number_of_trials, new.muscles, new.answer_source) = (15, true, mixed)).await;
    service.wait_for(study, &[StudyState::Finished]).await;
    let mut gaits: Vec<Trial> = Vec::new();
    for trial in service.trials(study).await {
        if trial.state == TrialState::Converged && !gaits.iter().any(|known| is_same_gait(known, &trial)) {
            gaits.push(trial);
        }
    }
    service.stop().await;
    large::fill_to(&database, study, large::TRIALS - 100).await;
    let service = Service::start(&database, Both(Analytic::default()), 1).await;
    let more = json!({"number_of_trials": 10_000});
    // Certification belongs to the harness, and is complete by now.
    service.stop_passing_gaits().await;
    let extended = service.post(&format!("/api/v1/studies/{study}/extend"), &more).await;
    println!("the study of {} trials goes on: {}", large::TRIALS - 100, extended.status);
    let solved = service.study(|new| (new.number_of_trials, new.muscles) = (500, true)).await;
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let router = service.router();
    tokio::spawn(async move { axum::serve(listener, router).await.unwrap() });
    let pairs: Vec<_> = (1..gaits.len())
        .flat_map(|other| (0..other).map(move |one| (one, other)))
        .map(|(one, other)| (gaits[one].id, gaits[other].id))
        .collect();
    let write = format!("/api/v1/studies/{study}/preferences");
    let read = format!("/api/v1/studies/{study}");

    let rater = |number: usize| {
        let (address, write, pairs) = (address.clone(), write.clone(), pairs.clone());
        std::thread::spawn(move || {
            let mut connection = Connection::open(&address);
            let (begun, mut times) = (Instant::now(), Vec::new());
            let each = RATERS as f64 / rate;
            while begun.elapsed().as_secs_f64() < seconds {
                // Measured from when the request was due, so that the delay after a slow response counts.
                let due = (times.len() as f64 + number as f64 / RATERS as f64) * each;
                let due = begun + Duration::from_secs_f64(due);
                std::thread::sleep(due.saturating_duration_since(Instant::now()));
                // Each person answers each pair once.
                let (one, other) = pairs[times.len() % pairs.len()];
                let author = format!("{number}-{}", times.len() / pairs.len());
                let body = json!({"trial_a": one, "trial_b": other, "answer": "a", "author": author}).to_string();
                assert_eq!(connection.send("POST", &write, &body), 201);
                times.push(due.elapsed());
            }
            times
        })
    };
    let raters: Vec<_> = (0..RATERS).map(rater).collect();
    let reader = std::thread::spawn(move || {
        let mut connection = Connection::open(&address);
        let (begun, mut times) = (Instant::now(), Vec::new());
        while begun.elapsed().as_secs_f64() < seconds {
            let sent = Instant::now();
            assert_eq!(connection.send("GET", &read, ""), 200);
            times.push(sent.elapsed());
            std::thread::sleep(Duration::from_millis(5));
        }
        times
    });
    #[allow(clippy::disallowed_methods)] // a test waits for a process or a thread
    let (writes, reads) = tokio::task::spawn_blocking(|| {
        let writes = raters.into_iter().flat_map(|rater| rater.join().unwrap()).collect();
        (writes, reader.join().unwrap())
    })
    .await
    .unwrap();
    let trials = service.trials(solved).await;
    let running = trials.iter().any(|trial| trial.state.is_open());
    println!("a solve with muscles ran on one worker: {running}; trials of that study: {}", trials.len());
    report("durable preference writes", writes, seconds);
    report("study reads", reads, seconds);
    service.stop().await;

    let (service, study, trial) = large::service(&folder.path().join("large.db")).await;
    let times = large::times(&service, study, trial).await;
    if let Some((path, time)) = times.iter().max_by_key(|(_, time)| *time) {
        println!(
            "slowest of {} pages and lists of a study of {} trials: {path}, {:.1} ms",
            times.len(),
            large::TRIALS,
            time.as_secs_f64() * 1e3
        );
    }
    service.stop().await;
}
