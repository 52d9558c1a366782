//! Axes of charts: a range with round ticks.

use gait_optimizer::number_format::grouped;
use std::fmt::Display;

/// A range of values with round ticks.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ChartAxis {
    /// Smallest value shown.
    pub(super) from: f64,
    /// Largest value shown.
    pub(super) to: f64,
    /// Values of the ticks.
    pub(super) ticks: Vec<f64>,
    decimals: usize,
}

/// Fraction of the tick distance that is too small to see.
const INVISIBLE_TICK_SHARE: f64 = 0.05;

impl ChartAxis {
    /// An axis over all values, widened to whole ticks unless `exact`; about `count` ticks.
    pub(super) fn over(values: impl Iterator<Item = f64>, count: usize, exact: bool) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values.filter(|value| value.is_finite()) {
            low = low.min(value);
            high = high.max(value);
        }
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        if high - low < 1e-12 * low.abs().max(1e-9) {
            let half = if low == 0.0 { 0.5 } else { low.abs() * 0.1 };
            (low, high) = (low - half, high + half);
        }
        let step = round_step((high - low) / count as f64);
        // A value that is barely beyond a tick does not need another tick.
        let (first, last) = ((low / step + INVISIBLE_TICK_SHARE).floor(), (high / step - INVISIBLE_TICK_SHARE).ceil());
        let (from, to) = if exact { (low, high) } else { ((first * step).min(low), (last * step).max(high)) };
        let mut ticks = Vec::new();
        let mut index = first;
        while index <= last {
            let tick = index * step;
            if tick >= from - 1e-9 * step && tick <= to + 1e-9 * step {
                // Avoid a tick labelled -0.
                ticks.push(if tick.abs() < step * 1e-9 { 0.0 } else { tick });
            }
            index += 1.0;
        }
        Self { from, to, ticks, decimals: decimals_of(step) }
    }

    /// Removes ticks between whole numbers.
    pub(super) fn keep_whole_ticks(&mut self) {
        self.ticks.retain(|tick| tick.fract() == 0.0);
        self.decimals = 0;
    }

    /// Sets the ticks to these values, with enough decimals to distinguish them. The range is widened to hold them, with a margin
    /// for the dots at its ends.
    pub(super) fn set_ticks(&mut self, ticks: &[f64]) {
        let (low, high) =
            ticks.iter().fold((self.from, self.to), |(low, high), tick| (low.min(*tick), high.max(*tick)));
        let margin = 0.04 * (high - low);
        (self.from, self.to) = (low - margin, high + margin);
        let decimals = |tick: &f64| tick.to_string().split_once('.').map_or(0, |(_, decimals)| decimals.len());
        self.decimals = ticks.iter().map(decimals).max().unwrap_or(0).min(6);
        self.ticks = ticks.to_vec();
    }

    /// Position of a value between the ends, 0 to 1.
    pub(super) fn place(&self, value: f64) -> f64 {
        (value - self.from) / (self.to - self.from)
    }

    /// The text of a tick. All ticks have the same number of decimals.
    pub(super) fn text(&self, tick: f64) -> String {
        grouped(&format!("{tick:.*}", self.decimals)).replace('-', "\u{2212}")
    }
}

/// `10⁻³`.
pub fn power_of_ten(exponent: impl Display) -> String {
    let raised = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        // The other superscripts are contiguous.
        digit => char::from_u32(0x2070 + digit.to_digit(10).unwrap_or(0)).unwrap_or(digit),
    };
    format!("10{}", exponent.to_string().chars().map(raised).collect::<String>())
}

/// 1, 2 or 5 times a power of ten, not smaller than `raw`.
fn round_step(raw: f64) -> f64 {
    let power = 10_f64.powf(raw.log10().floor());
    let scaled = raw / power;
    let round = if scaled <= 1.0 {
        1.0
    } else if scaled <= 2.0 {
        2.0
    } else if scaled <= 5.0 {
        5.0
    } else {
        10.0
    };
    round * power
}

/// Number of decimals that distinguishes neighbouring ticks.
fn decimals_of(step: f64) -> usize {
    let mut decimals = 0;
    let mut scaled = step;
    while scaled < 0.999 && decimals < 12 {
        scaled *= 10.0;
        decimals += 1;
    }
    decimals
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn range_holds_every_tick_that_is_set() {
        let mut axis = ChartAxis::over([0.1, 0.3].into_iter(), 8, true);
        axis.set_ticks(&[0.0, 0.1, 0.2, 0.3, 0.4, 0.5]);
        assert!(axis.ticks.iter().all(|tick| (0.0..=1.0).contains(&axis.place(*tick))), "{axis:?}");
    }

    #[test]
    fn ticks_are_round() {
        let axis = ChartAxis::over([0.03, 0.41].into_iter(), 5, false);
        assert_eq!(
            axis.ticks.iter().map(|t| axis.text(*t)).collect::<Vec<_>>(),
            ["0.0", "0.1", "0.2", "0.3", "0.4", "0.5"]
        );
        let axis = ChartAxis::over([-40.0, 60.0].into_iter(), 5, false);
        assert_eq!(axis.ticks.iter().map(|t| axis.text(*t)).collect::<Vec<_>>(), ["−40", "−20", "0", "20", "40", "60"]);
    }

    #[test]
    fn value_barely_below_a_tick_needs_no_further_tick() {
        let axis = ChartAxis::over([-0.01, 1.02].into_iter(), 5, false);
        assert_eq!((axis.from, axis.to, axis.ticks[0]), (-0.01, 1.02, 0.0));
    }

    #[test]
    fn powers_of_ten_have_superscripts() {
        assert_eq!([-12, 0, 3].map(power_of_ten), ["10⁻¹²", "10⁰", "10³"]);
    }

    proptest! {
        #[test]
        fn every_value_lies_on_the_axis(values in proptest::collection::vec(-1e6_f64..1e6, 1..20), count in 2_usize..10) {
            let axis = ChartAxis::over(values.iter().copied(), count, false);
            prop_assert!(axis.ticks.len() >= 2 && axis.ticks.len() <= count + 3);
            for value in values {
                let place = axis.place(value);
                prop_assert!((-1e-9..=1.0 + 1e-9).contains(&place));
            }
        }
    }

    #[test]
    fn empty_and_non_finite_values_still_give_an_axis() {
        for values in [vec![], vec![f64::NAN], vec![3.0], vec![0.0, 0.0]] {
            let axis = ChartAxis::over(values.into_iter(), 5, false);
            assert!(axis.from < axis.to && axis.ticks.len() >= 2, "{axis:?}");
        }
    }
}
