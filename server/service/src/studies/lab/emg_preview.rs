//! A preview of an EMG recording before it is stored: its columns, the raw channels, and the strides that its heel strikes
//! give.

use super::file_format::WHAT;
use super::upload::NewEmg;
use crate::error::Error;
use crate::studies::signal_extremes::extremes;
use gait_optimizer::emg::{CHANNELS, CycleActivity, EmgSettings};
use gait_optimizer::reference::{is_plausible, strides_between};

/// A preview of an EMG recording.
#[derive(Debug)]
pub struct EmgPreview {
    /// Names of the columns of the file.
    pub columns: Vec<String>,
    /// The raw traces of the channels whose column is known.
    pub traces: Vec<Trace>,
    /// The strides between the heel strikes; empty if heel strikes are unknown.
    pub strides: Vec<Stride>,
    /// Mean activity over the gait cycle with the default filters, in the unit of the file. Empty if the file would be refused,
    /// or if these filters do not fit its sampling rate.
    pub cycles: Vec<CycleActivity>,
    /// Why the file would be refused as it is; empty if it would be accepted.
    pub refused: Vec<Error>,
}

/// The raw trace of a channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// Channel.
    pub channel: &'static str,
    /// Its column.
    pub column: String,
    /// Smallest and largest samples of intervals over time, s.
    pub points: Vec<(f64, f64)>,
    /// The samples at the heel strikes.
    pub at_strikes: Vec<(f64, f64)>,
}

/// A stride of the recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stride {
    /// Number from 1.
    pub number: u32,
    /// Right heel strike at its start, s.
    pub start_s: f64,
    /// Right heel strike at its end, s.
    pub end_s: f64,
    /// Whether it lasts as long as strides do. Other strides are never used.
    pub is_plausible: bool,
    /// Whether it was rejected.
    pub rejected: bool,
}

impl NewEmg {
    /// Reads the file and previews it. What is missing for an upload is said in [`EmgPreview::refused`].
    ///
    /// # Errors
    /// [`Error::Invalid`] with line and column if the file cannot be read.
    pub fn preview(&self) -> Result<EmgPreview, Error> {
        let whole = self.reading.whole(WHAT, &self.recording)?;
        let strikes = self.reading.strikes(WHAT, &whole).unwrap_or_default().right_s;
        let column_of = |channel: &str| match self.reading.channels.get(channel) {
            Some(column) => Some(column.clone()),
            None if self.reading.channels.is_empty() => Some(channel.to_owned()),
            None => None,
        };
        let trace = |channel: &'static str| {
            let column = column_of(channel)?;
            let (_, samples) = whole.channels.iter().find(|(name, _)| *name == column)?;
            let time = |sample: usize| whole.start_s + sample as f64 / whole.rate_hz;
            let at = |strike: &f64| {
                let sample = samples.iter().enumerate().find(|(place, _)| time(*place) >= *strike)?;
                Some((*strike, *sample.1))
            };
            Some(Trace {
                channel,
                column,
                points: extremes(samples).into_iter().map(|(place, value)| (time(place), value)).collect(),
                at_strikes: strikes.iter().filter_map(at).collect(),
            })
        };
        let stride = |(number, (start_s, end_s)): (u32, (f64, f64))| Stride {
            number,
            start_s,
            end_s,
            is_plausible: is_plausible((start_s, end_s)),
            rejected: self.reading.rejected_strides.contains(&number),
        };
        let refused = self.reading.faults(&self.recording);
        let cycles = if refused.is_empty() { self.cycles().unwrap_or_default() } else { Vec::new() };
        Ok(EmgPreview {
            cycles,
            traces: CHANNELS.into_iter().filter_map(trace).collect(),
            strides: (1..).zip(strides_between(&strikes)).map(stride).collect(),
            refused,
            columns: whole.channels.into_iter().map(|(name, _)| name).collect(),
        })
    }
}

impl NewEmg {
    /// Mean activity over the gait cycle with the default filters, in the order of the traces.
    fn cycles(&self) -> Result<Vec<CycleActivity>, Error> {
        let (recording, strikes) = self.reading.read(WHAT, &self.recording)?;
        let mut cycles = recording.cycles(&self.reading.kept_strides(&strikes)?, &EmgSettings::default())?;
        cycles.sort_by_key(|cycle| CHANNELS.iter().position(|channel| *channel == cycle.channel));
        Ok(cycles)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::float_cmp)]
    use super::*;
    use crate::studies::lab::EmgReading;
    use crate::studies::signal_extremes::INTERVALS;
    use std::fmt::Write;

    fn recording(strikes: Vec<f64>) -> NewEmg {
        let mut text = String::from("time_s,E1,E2\n");
        for sample in 0..6000 {
            let time = f64::from(sample) / 1000.0;
            let value = (f64::from(sample) * 0.7).sin();
            writeln!(text, "{time},{value},{}", 2.0 * value).unwrap();
        }
        let channels = [("RF_L".to_owned(), "E1".to_owned()), ("TA_L".to_owned(), "E2".to_owned())].into();
        let reading =
            EmgReading { channels, heel_strikes_s: strikes, rejected_strides: vec![2], ..EmgReading::default() };
        NewEmg { walk: 1, recording: text, reading }
    }

    #[test]
    fn preview_has_columns_traces_and_strides() {
        let shown = recording(vec![0.5, 1.6, 2.7, 5.9]).preview().unwrap();
        assert_eq!(shown.columns, ["E1", "E2"]);
        assert_eq!(shown.traces.len(), 2);
        assert!(shown.traces[0].points.len() <= 2 * INTERVALS);
        let largest = shown.traces[1].points.iter().map(|point| point.1).fold(0.0, f64::max);
        assert!(largest > 1.99, "extremes are kept: {largest}");
        assert_eq!(shown.traces[0].at_strikes.len(), 4);
        let states: Vec<_> = shown.strides.iter().map(|stride| (stride.is_plausible, stride.rejected)).collect();
        assert_eq!(states, [(true, false), (true, true), (false, false)]);
    }

    #[test]
    fn preview_without_heel_strikes_asks_for_their_times() {
        let shown = recording(Vec::new()).preview().unwrap();
        assert!(shown.strides.is_empty() && shown.traces.len() == 2);
        let faults: Vec<String> = shown.refused.iter().map(Error::to_string).collect();
        assert!(matches!(&faults[..], [one] if one.contains("at least two heel-strike times")), "{faults:?}");
    }
}
