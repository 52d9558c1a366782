//! An overview of an EMG file before its columns are mapped to muscles: every column as recorded, and the heel strikes.

use super::emg_guesses::{self, HeelStrikeColumn};
use super::file_format::WHAT;
use super::foot_strikes::FootStrikes;
use super::upload::NewEmg;
use crate::error::Error;
use crate::studies::signal_extremes::extremes_in;
use std::collections::BTreeMap;

/// How many intervals the trace of a column has. Each has its smallest and its largest sample.
const INTERVALS: usize = 200;

/// An overview of an EMG file.
#[derive(Debug)]
pub struct EmgOverview {
    /// Every column of the file, without the time.
    pub columns: Vec<ColumnTrace>,
    /// Samples per second.
    pub rate_hz: f64,
    /// Duration of the recording, s.
    pub duration_s: f64,
    /// The column that was taken for right heel strikes, because neither a column nor times were given.
    pub guessed_strikes: Option<HeelStrikeColumn>,
    /// The column of each channel whose name tells its muscle.
    pub guessed_channels: BTreeMap<String, String>,
    /// Right heel strikes, s; empty if they are unknown.
    pub right_strikes_s: Vec<f64>,
    /// Left heel strikes, s; empty if they were not recorded.
    pub left_strikes_s: Vec<f64>,
    /// Why heel strikes are unknown.
    pub refused_strikes: Option<Error>,
}

/// A column over time.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnTrace {
    /// Name of the column.
    pub name: String,
    /// Smallest and largest samples of intervals over time, s.
    pub points: Vec<(f64, f64)>,
}

impl NewEmg {
    /// Reads the file and shows every column of it. With `guesses`, and if neither times nor a column of heel strikes are
    /// given, takes the column that looks like it.
    ///
    /// # Errors
    /// [`Error::Invalid`] with line and column if the file cannot be read.
    pub fn overview(&self, guesses: bool) -> Result<EmgOverview, Error> {
        let whole = self.reading.whole(WHAT, &self.recording)?;
        let is_open = self.reading.heel_strike_column.is_none() && self.reading.heel_strikes_s.is_empty();
        let guessed_strikes = if guesses && is_open { emg_guesses::heel_strikes(&whole) } else { None };
        let mut reading = self.reading.clone();
        if let Some(guess) = &guessed_strikes {
            reading.heel_strike_column = Some(guess.column.clone());
            reading.heel_strike_threshold = guess.threshold;
        }
        let (strikes, refused_strikes) = match reading.strikes(WHAT, &whole) {
            Ok(strikes) => (strikes, None),
            Err(error) => (FootStrikes::default(), Some(error)),
        };
        let time = |sample: usize| whole.start_s + sample as f64 / whole.rate_hz;
        let trace = |(name, samples): &(String, Vec<f64>)| ColumnTrace {
            name: name.clone(),
            points: extremes_in(INTERVALS, samples).into_iter().map(|(place, value)| (time(place), value)).collect(),
        };
        let names: Vec<String> = whole.channels.iter().map(|(name, _)| name.clone()).collect();
        Ok(EmgOverview {
            columns: whole.channels.iter().map(trace).collect(),
            rate_hz: whole.rate_hz,
            duration_s: whole.end_s() - whole.start_s,
            guessed_strikes,
            guessed_channels: emg_guesses::channels(&names),
            right_strikes_s: strikes.right_s,
            left_strikes_s: strikes.left_s.unwrap_or_default(),
            refused_strikes,
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::studies::lab::EmgReading;
    use std::fmt::Write;

    fn recording(reading: EmgReading) -> NewEmg {
        let mut text = String::from("time_s,EMG 1,TA_L,AUX\n");
        for sample in 0..6000 {
            let (time, value) = (f64::from(sample) / 1000.0, (f64::from(sample) * 0.7).sin());
            writeln!(text, "{time},{value},{},{}", 2.0 * value, u8::from(sample % 1100 > 400)).unwrap();
        }
        NewEmg { walk: 1, recording: text, reading }
    }

    #[test]
    fn overview_has_every_column_and_the_strikes_of_the_switch() {
        let shown = recording(EmgReading::default()).overview(true).unwrap();
        let names: Vec<&str> = shown.columns.iter().map(|column| column.name.as_str()).collect();
        assert_eq!(names, ["EMG 1", "TA_L", "AUX"]);
        assert!((shown.rate_hz - 1000.0).abs() < 1e-6 && (shown.duration_s - 5.999).abs() < 1e-9);
        assert!(shown.columns.iter().all(|column| (INTERVALS..=2 * INTERVALS).contains(&column.points.len())));
        let guess = shown.guessed_strikes.unwrap();
        assert_eq!((guess.column.as_str(), guess.threshold), ("AUX", 0.5));
        assert_eq!(shown.right_strikes_s.len(), 6);
        assert!((shown.right_strikes_s[1] - shown.right_strikes_s[0] - 1.1).abs() < 1e-6);
        assert_eq!(shown.guessed_channels, [("TA_L".to_owned(), "TA_L".to_owned())].into());
        assert!(shown.refused_strikes.is_none() && shown.left_strikes_s.is_empty());
    }

    #[test]
    fn given_strikes_are_not_replaced_by_a_guess() {
        let given = EmgReading { heel_strikes_s: vec![0.5, 1.6], ..EmgReading::default() };
        let shown = recording(given).overview(true).unwrap();
        assert_eq!((shown.guessed_strikes, shown.right_strikes_s), (None, vec![0.5, 1.6]));
        let wrong = EmgReading { heel_strike_column: Some("EMG 1".to_owned()), ..EmgReading::default() };
        let shown = recording(wrong).overview(true).unwrap();
        assert!(shown.right_strikes_s.is_empty() && shown.guessed_strikes.is_none());
        let reason = shown.refused_strikes.unwrap().to_string();
        assert!(reason.contains("\"EMG 1\" has no heel strike"), "{reason}");
    }
}
