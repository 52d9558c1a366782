//! The service with the analytic solver, as a process: for tests that kill it and for looking at pages.
//!
//! `serve-analytic DATABASE ADDRESS:PORT [MILLISECONDS_PER_ITERATION]`

#![allow(clippy::unwrap_used, clippy::expect_used)]

use gait_optimizer::Gait;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::certified::Verdicts;
use gaitwright_tests::explained::Clearance;
use gaitwright_tests::service::Service;
use std::path::PathBuf;
use std::time::Duration;

#[tokio::main]
async fn main() {
    let mut arguments = std::env::args().skip(1);
    let database = PathBuf::from(arguments.next().expect("a database"));
    let address = arguments.next().expect("an address");
    let pause = arguments.next().map_or(0, |text| text.parse().expect("milliseconds"));
    // About half of the gaits pass.
    let certifier =
        Verdicts { pause: Duration::from_millis(20), passes: |gait: &Gait| gait.bounds.to_array()[5] < 0.25 };
    let (solver, explainer) =
        (Analytic::slow(Duration::from_millis(pause)), Clearance::slow(Duration::from_millis(20)));
    let service = Service::start_looking_back(&database, solver, certifier, explainer).await;
    let listener = tokio::net::TcpListener::bind(address).await.unwrap();
    println!("http://{}", listener.local_addr().unwrap());
    axum::serve(listener, service.router()).await.unwrap();
}
