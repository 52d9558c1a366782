//! Guesses about the columns of an EMG file that a person confirms: the muscle of a column by its name, and the column of
//! right heel strikes by its name and its signal.

use super::file_format::WHAT;
use crate::studies::column_names::{ColumnName, NamedSide};
use gait_optimizer::emg::{CHANNELS, EmgRecording};
use gait_optimizer::reference::{is_plausible, strides_between};
use std::collections::BTreeMap;

/// Abbreviations and words for the muscles of the channels.
const MUSCLES: [(&str, &[&str], &[&str]); 4] = [
    ("RF", &["rf", "recfem"], &["rectus"]),
    ("TA", &["ta", "tib"], &["tibialis", "tibant"]),
    ("BF", &["bf", "bic"], &["biceps", "hamstring"]),
    ("GAS", &["gas", "gast", "gm", "gl", "mg", "lg"], &["gastroc"]),
];
/// Words in the names of foot switches and vertical forces.
const CONTACTS: [&str; 10] =
    ["heel", "switch", "fsr", "footsw", "strike", "contact", "grf", "force", "fz", "ground_force_vy"];
/// Largest value of a signal from which it is taken to be a force in N.
const MIN_FORCE_N: f64 = 50.0;
/// Vertical force above which the foot is in contact, N.
const CONTACT_FORCE_N: f64 = 20.0;
/// Fewest strides that a signal without a telling name must give to be taken for heel strikes.
const MIN_STRIDES: usize = 2;

/// The column of right heel strikes, and its threshold.
#[derive(Debug, Clone, PartialEq)]
pub struct HeelStrikeColumn {
    /// The column.
    pub column: String,
    /// The value above which the foot is on the ground.
    pub threshold: f64,
}

/// The column of each channel whose muscle and side the name of a column tells.
pub(super) fn channels(columns: &[String]) -> BTreeMap<String, String> {
    let named = |channel: &str, column: &str| column == channel || is_named(channel, column);
    let mut found: BTreeMap<String, String> = BTreeMap::new();
    for channel in CHANNELS {
        let exact = columns.iter().find(|column| column.as_str() == channel);
        let column = exact.or_else(|| {
            columns.iter().find(|column| named(channel, column) && found.values().all(|taken| taken != *column))
        });
        found.extend(column.map(|column| (channel.to_owned(), column.clone())));
    }
    found
}

fn is_named(channel: &str, column: &str) -> bool {
    let Some((muscle, side)) = channel.split_once('_') else { return false };
    let side = if side == "L" { NamedSide::Left } else { NamedSide::Right };
    let name = ColumnName::read(column);
    let known = MUSCLES.iter().find(|(known, ..)| *known == muscle);
    known.is_some_and(|(_, short, words)| {
        let abbreviated = short.iter().any(|short| name.abbreviates(short) && name.side_with(short) == Some(side));
        abbreviated || words.iter().any(|word| name.contains(word) && name.side == Some(side))
    })
}

/// The column of right heel strikes: first those whose names tell so, then signals with two values.
pub(super) fn heel_strikes(whole: &EmgRecording) -> Option<HeelStrikeColumn> {
    let side = |name: &str| {
        let name = ColumnName::read(name);
        CONTACTS.iter().find_map(|word| name.side_with(word))
    };
    let named = |name: &str| {
        let read = ColumnName::read(name);
        side(name) != Some(NamedSide::Left) && CONTACTS.iter().any(|word| read.contains(word))
    };
    let mut likely: Vec<_> = whole.channels.iter().filter(|(name, _)| named(name)).collect();
    likely.sort_by_key(|(name, _)| side(name) != Some(NamedSide::Right));
    let by_name = likely.into_iter().find_map(|(name, samples)| with_strides(whole, name, samples, 1));
    let by_signal = || {
        let switches = whole
            .channels
            .iter()
            .filter(|(name, samples)| side(name) != Some(NamedSide::Left) && has_two_values(samples));
        switches.into_iter().find_map(|(name, samples)| with_strides(whole, name, samples, MIN_STRIDES))
    };
    by_name.or_else(by_signal)
}

/// The column with its threshold, if it gives this number of strides.
fn with_strides(whole: &EmgRecording, name: &str, samples: &[f64], fewest: usize) -> Option<HeelStrikeColumn> {
    let (low, high) = range(samples);
    let threshold = if high > MIN_FORCE_N { CONTACT_FORCE_N } else { 0.5 * (low + high) };
    let strikes = whole.strikes_of_column(WHAT, name, threshold).ok()?;
    let strides = strides_between(&strikes).into_iter().filter(|stride| is_plausible(*stride)).count();
    (strides >= fewest).then(|| HeelStrikeColumn { column: name.to_owned(), threshold })
}

fn range(samples: &[f64]) -> (f64, f64) {
    let of = |start: f64, pick: fn(f64, f64) -> f64| samples.iter().copied().fold(start, pick);
    (of(f64::INFINITY, f64::min), of(f64::NEG_INFINITY, f64::max))
}

/// Whether a signal is at its smallest or its largest value all the time.
#[allow(clippy::float_cmp)] // a switch repeats its values exactly
fn has_two_values(samples: &[f64]) -> bool {
    let (low, high) = range(samples);
    low < high && samples.iter().all(|sample| *sample == low || *sample == high)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn muscles_are_found_by_usual_names() {
        let columns = ["EMG 1", "L_RF", "Left Tibialis Anterior", "BICEPS_FEM_L", "LGAS", "RRF", "bf_r", "stance_L"];
        let found = channels(&columns.map(str::to_owned));
        let expected = [
            ("BF_L", "BICEPS_FEM_L"),
            ("BF_R", "bf_r"),
            ("GAS_L", "LGAS"),
            ("RF_L", "L_RF"),
            ("RF_R", "RRF"),
            ("TA_L", "Left Tibialis Anterior"),
        ];
        assert!(found.iter().map(|(channel, column)| (channel.as_str(), column.as_str())).eq(expected), "{found:?}");
        assert!(channels(&["EMG 1".to_owned(), "EMG 2".to_owned()]).is_empty());
    }

    /// Six seconds at 100 Hz with contacts every 1.1 s, of this height.
    fn contacts(height: f64) -> Vec<f64> {
        (0..600).map(|sample| if sample % 110 > 40 { height } else { 0.0 }).collect()
    }

    fn guessed(channels: Vec<(&str, Vec<f64>)>) -> Option<HeelStrikeColumn> {
        let channels = channels.into_iter().map(|(name, samples)| (name.to_owned(), samples)).collect();
        heel_strikes(&EmgRecording { start_s: 0.0, rate_hz: 100.0, channels })
    }

    #[test]
    fn heel_strikes_are_found_by_name_then_by_signal() {
        let muscle = || ("EMG 1", (0..600).map(|k| (f64::from(k) * 1.3).sin()).collect::<Vec<f64>>());
        let of = |column: &str, threshold: f64| Some(HeelStrikeColumn { column: column.to_owned(), threshold });
        assert_eq!(guessed(vec![muscle(), ("heel_L", contacts(1.0)), ("heel_R", contacts(5.0))]), of("heel_R", 2.5));
        assert_eq!(guessed(vec![("ground_force_vy", contacts(700.0)), muscle()]), of("ground_force_vy", 20.0));
        assert_eq!(guessed(vec![muscle(), ("AUX 2", contacts(1.0))]), of("AUX 2", 0.5));
        assert_eq!(guessed(vec![muscle()]), None);
        assert_eq!(guessed(vec![("heel", vec![0.0; 600])]), None, "a switch that never closes");
    }
}
