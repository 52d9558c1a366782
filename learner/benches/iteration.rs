//! Time of one iteration of a study on the grid of Table I (11,664 actions): posterior and proposal.
//!
//! `cargo bench -p gait-learner`. Each visited action has one comparison and one label. `warm`: the cache holds the
//! fit before the last action, as in a running study. `cold`: the cache is empty, as after a start.

#![allow(clippy::expect_used, missing_docs, unreachable_pub)]

mod study;

use divan::{Bencher, black_box};
use gait_learner::{Learner, LearnerSettings, Method};
use study::{earlier, page, space, study};

/// Counts allocations: the column "max alloc" is the peak memory of an iteration without the cache.
#[global_allocator]
static ALLOCATOR: divan::AllocProfiler = divan::AllocProfiler::system();

fn main() {
    divan::main();
}

fn warm(bencher: Bencher, settings: &LearnerSettings, comparisons: usize) {
    let space = space();
    let log = study(&space, comparisons);
    let mut learner = Learner::default();
    learner.posterior(&space, &earlier(&log), settings).expect("valid");
    bencher
        .with_inputs(|| learner.clone())
        .bench_local_refs(|learner| black_box(learner.propose(&space, &log, &[], settings, 7).expect("valid").action));
}

#[divan::bench(args = [50, 100, 200, 1000], max_time = 2)]
fn linecospar_warm(bencher: Bencher, comparisons: usize) {
    warm(bencher, &LearnerSettings::of(Method::LineCoSpar), comparisons);
}

#[divan::bench(args = [50, 100, 200], max_time = 2)]
fn eubo_published_warm(bencher: Bencher, comparisons: usize) {
    warm(bencher, &LearnerSettings::published(Method::Eubo), comparisons);
}

#[divan::bench(args = [50, 100, 200, 1000], max_time = 2)]
fn eubo_warm(bencher: Bencher, comparisons: usize) {
    warm(bencher, &LearnerSettings::of(Method::Eubo), comparisons);
}

#[divan::bench(args = [50, 200], max_time = 2)]
fn thompson_warm(bencher: Bencher, comparisons: usize) {
    warm(bencher, &LearnerSettings::of(Method::Thompson), comparisons);
}

#[divan::bench(args = [50, 200], max_time = 2)]
fn eubo_cold(bencher: Bencher, comparisons: usize) {
    let space = space();
    let log = study(&space, comparisons);
    let settings = LearnerSettings::of(Method::Eubo);
    bencher.bench_local(|| black_box(gait_learner::propose(&space, &log, &[], &settings, 7).expect("valid").action));
}

#[divan::bench(args = [50, 200], max_time = 2)]
fn study_page(bencher: Bencher, comparisons: usize) {
    let space = space();
    let log = study(&space, comparisons);
    let posterior = gait_learner::posterior(&space, &log, &LearnerSettings::default()).expect("valid");
    bencher.bench_local(|| page(&posterior));
}
