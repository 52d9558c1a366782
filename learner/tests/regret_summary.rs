//! The statistics of the regret benchmark match known values.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, missing_docs, unreachable_pub, dead_code)]

#[path = "../examples/regret/problems.rs"]
mod problems;
#[path = "../examples/regret/summary.rs"]
mod summary;

use std::collections::BTreeMap;
use std::fmt::Write;

use summary::{Curves, median_interval, paired, quantile, report};

fn by_seed(values: &[f64]) -> BTreeMap<u64, f64> {
    (0..).zip(values.iter().copied()).collect()
}

#[test]
fn paired_tests_match_known_values() {
    // Differences -8 .. -3 and 1, 2: ranks 1 and 2 are positive.
    let first = [-8.0, -7.0, -6.0, -5.0, -4.0, -3.0, 1.0, 2.0, 0.0];
    let result = paired(&by_seed(&first), &by_seed(&[0.0; 9]));
    assert_eq!((result.lower, result.higher), (6, 2));
    // 2 (1 + 8 + 28) / 256
    assert!((result.sign - 74.0 / 256.0).abs() < 1e-12, "{result:?}");
    // W = 3, mean 18, variance 51: z = 2.1004
    assert!((result.wilcoxon - 0.035_692).abs() < 1e-4, "{result:?}");
    let same = paired(&by_seed(&first), &by_seed(&first));
    assert_eq!((same.lower, same.higher, same.sign, same.wilcoxon), (0, 0, 1.0, 1.0));
    // Ties share their ranks: two of 1.5 and two of 3.5.
    let tied = paired(&by_seed(&[1.0, 1.0, -2.0, -2.0]), &by_seed(&[0.0; 4]));
    let z = 2.0 / (4.0_f64 * 5.0 * 9.0 / 24.0 - 12.0 / 48.0).sqrt();
    assert!((tied.wilcoxon - libm::erfc(z / 2.0_f64.sqrt())).abs() < 1e-12, "{tied:?}");
}

#[test]
fn median_interval_matches_the_binomial_distribution() {
    let sorted: Vec<f64> = (0..101).map(f64::from).collect();
    assert_eq!([0.25, 0.5, 0.75].map(|share| quantile(&sorted, share)), [25.0, 50.0, 75.0]);
    assert_eq!(quantile(&[1.0, 2.0], 0.5), 1.5);
    assert_eq!(quantile(&[], 0.5), 0.0);
    // By the binomial distribution the interval runs from the 41st to the 61st of 101.
    let [low, high] = median_interval(&sorted);
    assert!((low - 40.0).abs() <= 2.0 && (high - 60.0).abs() <= 2.0, "{low} {high}");
    assert_eq!(median_interval(&sorted), [low, high]);
}

#[test]
fn rows_are_summarised_and_malformed_rows_rejected() {
    let rows = |offset: f64| {
        let mut text = String::from("method,seed,k,regret\n");
        for seed in 200..210 {
            for k in 0..=20 {
                writeln!(text, "m,{seed},{k},{}", offset + f64::from(seed - 200) / 100.0).unwrap();
            }
        }
        text
    };
    let files =
        [(0.1, "slow"), (0.0, "fast")].map(|(offset, name)| (name.into(), Curves::read(&rows(offset)).unwrap()));
    let text = report(&files);
    assert!(text.contains("slow: k = 20, 10 seeds, median 0.145"), "{text}");
    assert!(text.contains("fast against slow: k = 10, better 10, worse 0, sign test p = 2.0e-3"), "{text}");
    for wrong in ["", "seed,k\n1,2\n", "method,seed,k,regret\nm,1,2\n", "method,seed,k,regret\nm,1,2,NaN\n"] {
        assert!(Curves::read(wrong).is_err(), "{wrong:?}");
    }
    assert!(Curves::read("method,seed,k,regret\nm,1,2,0.5\nm,1,2,0.5\n").unwrap_err().contains("two rows"));
}
