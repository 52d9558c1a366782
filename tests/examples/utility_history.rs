//! How long the utility of the recommended gait over the answers takes: all of it, as after a restart, and again after one more
//! answer.
//!
//! `cargo run -p gaitwright-tests --example utility_history -- [ANSWERS]...`

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use gaitwright_service::studies::analysis::Analyses;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_store::StudyId;
use gaitwright_store::studies::AnswerSource;
use gaitwright_tests::analytic::Analytic;
use gaitwright_tests::service::Service;
use gaitwright_tests::users::answer_once;
use std::sync::Arc;
use std::time::{Duration, Instant};

#[tokio::main]
async fn main() {
    let given: Vec<u32> = std::env::args().skip(1).map(|text| text.parse().expect("a number of answers")).collect();
    for answers in if given.is_empty() { vec![30, 200] } else { given } {
        let folder = tempfile::tempdir().unwrap();
        let service = Service::start(&folder.path().join("a.db"), Analytic::default(), 1).await;
        let study = service.study(|new| (new.number_of_trials, new.answer_source) = (390, AnswerSource::People)).await;
        for _ in 0..answers {
            answer_once(&service, study).await;
        }
        let analyses = Arc::new(Analyses::default());
        let (all, points) = history(&service, study, &analyses).await;
        answer_once(&service, study).await;
        let (again, _) = history(&service, study, &analyses).await;
        println!("{answers} answers: {points} points in {all:.2?}, after one more answer in {again:.2?}");
        service.stop().await;
    }
}

async fn history(service: &Service, study: StudyId, analyses: &Arc<Analyses>) -> (Duration, usize) {
    let study = service.get(study).await;
    let snapshot = StudySnapshot::read(&mut service.store.read().await.unwrap(), study).await.unwrap();
    let analyses = Arc::clone(analyses);
    let begun = Instant::now();
    let points = service.store.clone().compute(move |pool| analyses.utility_history(pool, &snapshot)).await;
    (begun.elapsed(), points.unwrap().unwrap().len())
}
