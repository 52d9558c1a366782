//! Medians with confidence intervals, and paired comparisons of methods, from the rows of runs.

use std::collections::{BTreeMap, BTreeSet};

use crate::problems::SplitMix64;

/// Regret of each seed after each number of comparisons.
#[derive(Debug, Default, PartialEq)]
pub struct Curves(pub BTreeMap<u64, BTreeMap<usize, f64>>);

impl Curves {
    /// Reads rows `method,seed,k,regret` with their header. The error names the first invalid line and the reason.
    pub fn read(text: &str) -> Result<Self, String> {
        let mut curves = Self::default();
        let mut lines = text.lines().enumerate();
        if lines.next().is_none_or(|(_, header)| header.trim() != "method,seed,k,regret") {
            return Err("line 1: the header is not method,seed,k,regret".into());
        }
        for (number, line) in lines {
            let fields: Vec<&str> = line.split(',').collect();
            let row = match fields[..] {
                [_, seed, k, regret] => seed.parse().ok().zip(k.parse().ok()).zip(regret.parse::<f64>().ok()),
                _ => None,
            };
            let Some(((seed, k), regret)) = row.filter(|(_, regret)| regret.is_finite()) else {
                return Err(format!("line {}: {line:?} is not method,seed,k,regret", number + 1));
            };
            if curves.0.entry(seed).or_default().insert(k, regret).is_some() {
                return Err(format!("line {}: seed {seed} has two rows for k = {k}", number + 1));
            }
        }
        Ok(curves)
    }

    /// Regret after `k` comparisons, by seed.
    pub fn at(&self, k: usize) -> BTreeMap<u64, f64> {
        self.0.iter().filter_map(|(&seed, curve)| curve.get(&k).map(|&regret| (seed, regret))).collect()
    }

    /// The reported numbers of comparisons that the rows have.
    pub fn milestones(&self) -> BTreeSet<usize> {
        [10, 20, 30, 50, 75, 100].into_iter().filter(|&k| !self.at(k).is_empty()).collect()
    }
}

/// A quantile by linear interpolation; 0 for an empty slice.
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return 0.0 };
    let at = share * last as f64;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and the last")]
    let i = at.floor() as usize;
    sorted[i] + at.fract() * (sorted[(i + 1).min(last)] - sorted[i])
}

/// Number of bootstrap resamples.
const RESAMPLES: usize = 4000;

/// 95 % confidence interval of the median, by the percentile bootstrap with a fixed seed.
pub fn median_interval(values: &[f64]) -> [f64; 2] {
    let mut random = SplitMix64(20220314);
    let mut medians: Vec<f64> = (0..RESAMPLES)
        .map(|_| {
            let mut drawn: Vec<f64> = values.iter().map(|_| values[random.below(values.len())]).collect();
            drawn.sort_by(f64::total_cmp);
            quantile(&drawn, 0.5)
        })
        .collect();
    medians.sort_by(f64::total_cmp);
    [quantile(&medians, 0.025), quantile(&medians, 0.975)]
}

/// A paired comparison: numbers of seeds with a lower and a higher first value, and two-sided p-values.
#[derive(Debug, PartialEq)]
pub struct Paired {
    pub lower: usize,
    pub higher: usize,
    /// Exact sign test.
    pub sign: f64,
    /// Wilcoxon's signed-rank test: normal approximation with ties, without equal pairs.
    pub wilcoxon: f64,
}

/// Compares two methods on their common seeds.
pub fn paired(first: &BTreeMap<u64, f64>, second: &BTreeMap<u64, f64>) -> Paired {
    let differences: Vec<f64> = first
        .iter()
        .filter_map(|(seed, a)| second.get(seed).map(|b| a - b))
        .filter(|difference| *difference != 0.0)
        .collect();
    let lower = differences.iter().filter(|d| **d < 0.0).count();
    let higher = differences.len() - lower;
    Paired { lower, higher, sign: sign_test(lower, higher), wilcoxon: signed_ranks(&differences) }
}

/// Two-sided p-value of the exact sign test.
fn sign_test(lower: usize, higher: usize) -> f64 {
    let n = lower + higher;
    // Logarithm of the binomial coefficient, updated from k = 0.
    let mut ln_choose = 0.0;
    let mut tail = 0.0;
    for k in 0..=lower.min(higher) {
        if k > 0 {
            ln_choose += ((n + 1 - k) as f64 / k as f64).ln();
        }
        tail += (ln_choose - n as f64 * std::f64::consts::LN_2).exp();
    }
    (2.0 * tail).min(1.0)
}

fn signed_ranks(differences: &[f64]) -> f64 {
    let mut sorted = differences.to_vec();
    sorted.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    let n = sorted.len() as f64;
    let (mut positive, mut tied, mut start) = (0.0, 0.0, 0);
    while start < sorted.len() {
        let alike = sorted[start..].iter().take_while(|d| d.abs() == sorted[start].abs()).count();
        let rank = start as f64 + 0.5 * (alike + 1) as f64;
        positive += rank * sorted[start..start + alike].iter().filter(|d| **d > 0.0).count() as f64;
        tied += (alike as f64).powi(3) - alike as f64;
        start += alike;
    }
    let variance = n * (n + 1.0) * (2.0 * n + 1.0) / 24.0 - tied / 48.0;
    if variance <= 0.0 {
        return 1.0;
    }
    let z = (positive - n * (n + 1.0) / 4.0).abs() / variance.sqrt();
    libm::erfc(z * std::f64::consts::FRAC_1_SQRT_2)
}

/// The summary of some files; the first one is the reference of the comparisons.
pub fn report(files: &[(String, Curves)]) -> String {
    use std::fmt::Write;
    let mut text = String::new();
    let milestones: BTreeSet<usize> = files.iter().flat_map(|(_, curves)| curves.milestones()).collect();
    for (name, curves) in files {
        for &k in &milestones {
            let mut values: Vec<f64> = curves.at(k).into_values().collect();
            if values.is_empty() {
                continue;
            }
            values.sort_by(f64::total_cmp);
            let [low, high] = median_interval(&values);
            let [lower, median, upper] = [0.25, 0.5, 0.75].map(|share| quantile(&values, share));
            let _ = writeln!(
                text,
                "{name}: k = {k}, {} seeds, median {median:.3} (95 % {low:.3} to {high:.3}), quartiles {lower:.3} {upper:.3}",
                values.len()
            );
        }
    }
    if let Some(((reference, first), others)) = files.split_first() {
        for (name, curves) in others {
            for &k in &milestones {
                let (ours, theirs) = (curves.at(k), first.at(k));
                if ours.keys().any(|seed| theirs.contains_key(seed)) {
                    let Paired { lower, higher, sign, wilcoxon } = paired(&ours, &theirs);
                    let _ = writeln!(
                        text,
                        "{name} against {reference}: k = {k}, better {lower}, worse {higher}, sign test p = {sign:.1e}, Wilcoxon p = {wilcoxon:.1e}"
                    );
                }
            }
        }
    }
    text
}
