//! Processor time of one iteration of a study. On a loaded machine it is more reliable than wall time.
//!
//! `cargo bench -p gait-learner --bench processor_time [-- NAME [COMPARISONS]]` prints fastest, median and slowest run,
//! the median wall time, and the load of the machine.

#![allow(clippy::expect_used, missing_docs, unreachable_pub)]

mod study;

use std::hint::black_box;
use std::time::{Duration, Instant};

use gait_learner::{Learner, LearnerSettings, Method};
use rustix::time::{ClockId, clock_gettime};
use study::{earlier, page, space, study};

/// Processor time of this thread so far.
fn used() -> Duration {
    Duration::try_from(clock_gettime(ClockId::ThreadCPUTime)).unwrap_or_default()
}

/// Largest number of runs of a case, and the time after which no further run starts.
const RUNS: usize = 300;
const ENOUGH: Duration = Duration::from_secs(3);

fn quantile(sorted: &[Duration], numerator: usize) -> f64 {
    1e3 * sorted[(sorted.len() - 1) * numerator / 2].as_secs_f64()
}

/// Measures `run`, each time on a new input, and prints a row of the table.
fn measure<T>(name: &str, comparisons: usize, mut input: impl FnMut() -> T, mut run: impl FnMut(&mut T)) {
    let (mut own, mut wall) = (Vec::new(), Vec::new());
    let start = Instant::now();
    while own.len() < RUNS && (own.len() < 5 || start.elapsed() < ENOUGH) {
        let mut input = input();
        let (clock, before) = (Instant::now(), used());
        run(&mut input);
        own.push(used().saturating_sub(before));
        wall.push(clock.elapsed());
    }
    own.sort_unstable();
    wall.sort_unstable();
    let [fastest, median, slowest] = [0, 1, 2].map(|q| quantile(&own, q));
    println!(
        "{name:<20} {comparisons:>5} {fastest:>10.3} {median:>10.3} {slowest:>10.3} {:>10.3} {:>6}",
        quantile(&wall, 1),
        own.len()
    );
}

fn main() {
    let mut arguments = std::env::args().skip(1).filter(|argument| !argument.starts_with('-'));
    let filter = arguments.next().unwrap_or_default();
    let only: Option<usize> = arguments.next().and_then(|count| count.parse().ok());
    if let Ok(load) = std::fs::read_to_string("/proc/loadavg") {
        println!("load averages {}", load.trim());
    }
    println!("milliseconds                     fastest     median    slowest  wall median   runs");
    let space = space();
    for (name, settings) in [
        ("linecospar", LearnerSettings::of(Method::LineCoSpar)),
        ("eubo_published", LearnerSettings::published(Method::Eubo)),
        ("eubo", LearnerSettings::of(Method::Eubo)),
        ("thompson", LearnerSettings::of(Method::Thompson)),
        ("information_gain", LearnerSettings::of(Method::InformationGain)),
    ] {
        if !name.contains(&filter) {
            continue;
        }
        for comparisons in [50, 100, 200, 1000].into_iter().filter(|&count| only.is_none_or(|only| only == count)) {
            let log = study(&space, comparisons);
            let mut learner = Learner::default();
            learner.posterior(&space, &earlier(&log), &settings).expect("valid");
            measure(
                name,
                comparisons,
                || learner.clone(),
                |learner| {
                    black_box(learner.propose(&space, &log, &[], &settings, 7).expect("valid").action);
                },
            );
        }
    }
    if "study_page".contains(&filter) {
        for comparisons in [50, 200].into_iter().filter(|&count| only.is_none_or(|only| only == count)) {
            let log = study(&space, comparisons);
            for (name, method) in [("page, linecospar", Method::LineCoSpar), ("page, eubo", Method::Eubo)] {
                let posterior = gait_learner::posterior(&space, &log, &LearnerSettings::of(method)).expect("valid");
                measure(name, comparisons, || (), |()| page(&posterior));
            }
        }
    }
}
