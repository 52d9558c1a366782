//! A worker with the analytic solver, as a process: for tests that kill it.
//!
//! `worker-analytic URL QUEUE LEASE_MILLISECONDS MILLISECONDS_PER_ITERATION HANGS_ONCE`

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_service::workers::nats::NatsWorker;
use gaitwright_tests::analytic::Analytic;
use std::sync::Arc;
use std::time::Duration;
use tokio_util::sync::CancellationToken;

#[tokio::main]
async fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [url, queue, lease, pause, hangs] = &arguments[..] else { panic!("five arguments") };
    let milliseconds = |text: &str| Duration::from_millis(text.parse().expect("milliseconds"));
    let solver = Analytic { hangs: u32::from(hangs == "true"), ..Analytic::slow(milliseconds(pause)) };
    let name = format!("worker {}", std::process::id());
    let worker = NatsWorker::connect(url, queue, name, 1, milliseconds(lease), Arc::new(solver)).await.unwrap();
    Box::pin(worker.run(CancellationToken::new())).await.unwrap();
}
