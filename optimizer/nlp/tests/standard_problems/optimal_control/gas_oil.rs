//! Catalytic cracking of gas oil: reaction rates that fit measured concentrations, by collocation at Gauss points. It
//! has no elimination blocks.

use super::super::sparse::{Sparse, Term};
use super::super::{Dual, INF};

/// Times of the measurements.
const TIMES: [f64; 21] = [
    0.0, 0.025, 0.05, 0.075, 0.10, 0.125, 0.150, 0.175, 0.20, 0.225, 0.250, 0.30, 0.35, 0.40, 0.45, 0.50, 0.55, 0.65,
    0.75, 0.85, 0.95,
];
/// Measured concentrations of both substances.
#[allow(clippy::approx_constant, reason = "measurements")]
const MEASURED: [[f64; 21]; 2] = [
    [
        1.0, 0.8105, 0.6208, 0.5258, 0.4345, 0.3903, 0.3342, 0.3034, 0.2735, 0.2405, 0.2283, 0.2071, 0.1669, 0.1530,
        0.1339, 0.1265, 0.1200, 0.0990, 0.0870, 0.0770, 0.0690,
    ],
    [
        0.0, 0.2, 0.2886, 0.3010, 0.3215, 0.3123, 0.2716, 0.2551, 0.2258, 0.1959, 0.1789, 0.1457, 0.1198, 0.0909,
        0.0719, 0.0561, 0.0460, 0.0280, 0.0190, 0.0140, 0.0100,
    ],
];
/// Points of Gauss in the unit interval.
const GAUSS: [f64; STAGES] = [0.069_431_844_202_97, 0.330_009_478_207_57, 0.669_990_521_792_43, 0.930_568_155_797_03];
const STAGES: usize = 4;
/// Variables of a substance in an interval: its concentration at the start and the coefficients of its polynomial.
const OF_SUBSTANCE: usize = 1 + STAGES;
const OF_INTERVAL: usize = 2 * OF_SUBSTANCE;

/// Concentration at a time after the start of its interval of length h: v + sum w_k t^k / (k! h^(k-1)).
fn concentration(s: &[Dual], share: f64, h: f64) -> Dual {
    let mut power = h;
    let mut sum = s[0];
    for (k, w) in s[1..OF_SUBSTANCE].iter().enumerate() {
        power *= share / (k + 1) as f64;
        sum = sum + *w * power;
    }
    sum
}

/// Its derivative.
fn rate(s: &[Dual], share: f64) -> Dual {
    let mut power = 1.0;
    let mut sum = s[1];
    for (k, w) in s[2..OF_SUBSTANCE].iter().enumerate() {
        power *= share / (k + 1) as f64;
        sum = sum + *w * power;
    }
    sum
}

/// Values at the collocation points are substituted; the published model has them as variables.
pub fn program(intervals: usize) -> Sparse {
    let last = TIMES[TIMES.len() - 1];
    let h = last / intervals as f64;
    let of = |interval: usize, substance: usize| {
        let first = OF_INTERVAL * interval + OF_SUBSTANCE * substance;
        first..first + OF_SUBSTANCE
    };
    let rates = OF_INTERVAL * intervals;
    let interval_of = |time: f64| ((time / h).floor() as usize).min(intervals - 1);

    let mut start = vec![0.0; rates + 3];
    for k in 0..intervals {
        // The next measurement.
        let next = (0..TIMES.len()).find(|&m| interval_of(TIMES[m]) >= k).unwrap_or(TIMES.len() - 1);
        for substance in 0..2 {
            start[of(k, substance).start] = MEASURED[substance][next];
        }
    }
    let mut rows = Vec::new();
    for k in 0..intervals {
        let both: Vec<usize> = of(k, 0).chain(of(k, 1)).collect();
        for share in GAUSS {
            let mut first: Vec<usize> = of(k, 0).collect();
            first.extend([rates, rates + 2]);
            rows.push(Term::new(first, move |s| {
                let oil = concentration(s, share, h);
                rate(s, share) + (s[OF_SUBSTANCE] + s[OF_SUBSTANCE + 1]) * oil * oil
            }));
            let mut second = both.clone();
            second.extend([rates, rates + 1]);
            rows.push(Term::new(second, move |s| {
                let oil = concentration(s, share, h);
                let gasoline = concentration(&s[OF_SUBSTANCE..], share, h);
                rate(&s[OF_SUBSTANCE..], share) - s[OF_INTERVAL] * oil * oil + s[OF_INTERVAL + 1] * gasoline
            }));
        }
        if k + 1 < intervals {
            for substance in 0..2 {
                let mut variables: Vec<usize> = of(k, substance).collect();
                variables.push(of(k + 1, substance).start);
                rows.push(Term::new(variables, move |s| concentration(s, 1.0, h) - s[OF_SUBSTANCE]));
            }
        }
    }
    let mut objective = Vec::new();
    for substance in 0..2 {
        for (time, measured) in TIMES.iter().zip(MEASURED[substance]) {
            let interval = interval_of(*time);
            let share = time / h - interval as f64;
            objective.push(Term::new(of(interval, substance).collect(), move |s| {
                let error = concentration(s, share, h) - Dual::constant(measured);
                error * error
            }));
        }
    }
    let bounds = vec![(0.0, 0.0); rows.len()];
    let mut program = Sparse::new(start, objective, rows, bounds);
    for (substance, value) in [(0, 1.0), (1, 0.0)] {
        let j = of(0, substance).start;
        (program.lower[j], program.upper[j]) = (value, value);
    }
    for j in rates..rates + 3 {
        (program.lower[j], program.upper[j]) = (0.0, INF);
    }
    program
}
