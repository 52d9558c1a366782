//! `gaitwright emg`: processes EMG recordings to muscle activity over the gait cycle.

use super::flag_choices::{EMG_FORMATS, one_of};
use super::flag_names::of_flags;
use super::flag_numbers::{filter_order, number};
use super::input_file::read;
use super::out_file::OutFile;
use super::output::data;
use clap::Args;
use gait_optimizer::emg::{
    Activity, CYCLE_POINTS, CycleActivity, CycleStart, EmgRecording, EmgSettings, Envelope, LegStrides,
};
use gaitwright_charts::csv_table::{CsvCell, CsvTable};
use gaitwright_service::error::Error;
use gaitwright_service::studies::lab::{EmgReading, FootStrikes, MeasurementFormat};
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(super) struct EmgCommand {
    /// EMG recording: CSV or OpenSim file with a column for each channel (RF_L, TA_L, BF_L, GAS_L, RF_R, BF_R).
    #[arg(value_name = "FILE")]
    recording: PathBuf,
    /// EMG recording of walking without the device, for normalisation and EMG RMSE (default: the recording itself).
    #[arg(long, value_name = "FILE")]
    normal: Option<PathBuf>,
    /// Format of both files.
    #[arg(long, value_parser = one_of::<MeasurementFormat>(EMG_FORMATS), default_value = "csv")]
    format: MeasurementFormat,
    /// Sampling rate of a CSV file without a time_s column, 100 to 20000.
    #[arg(long, value_name = "HZ", value_parser = number, allow_negative_numbers = true)]
    rate_hz: Option<f64>,
    /// Columns of the channels, as in TA_L=EMG2,BF_L=EMG3; other channels are ignored (default: columns with the
    /// names of the channels).
    #[arg(long, value_name = "CHANNEL=COLUMN,...", value_delimiter = ',', value_parser = channel)]
    channels: Vec<(String, String)>,
    /// Column of right heel strikes in both files: a switch under the heel, or the vertical force under the foot.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["heel_strikes_s", "normal_heel_strikes_s"])]
    heel_strike_column: Option<String>,
    /// Value in the columns of heel strikes above which a foot is on the ground, in the unit of these columns.
    #[arg(long, value_name = "NUMBER", default_value = "0.5", value_parser = number, allow_negative_numbers = true)]
    heel_strike_threshold: f64,
    /// Times of right heel strikes in the recording, as in 0.41,1.52,2.63.
    #[arg(long, value_name = "SECONDS,...", value_delimiter = ',', value_parser = number, allow_negative_numbers = true)]
    heel_strikes_s: Vec<f64>,
    /// Column of left heel strikes in both files. The cycle of the left leg begins with them (default: the left foot is
    /// taken to strike half a stride after the right one).
    #[arg(long, value_name = "NAME", conflicts_with = "left_heel_strikes_s")]
    left_heel_strike_column: Option<String>,
    /// Times of left heel strikes in the recording.
    #[arg(long, value_name = "SECONDS,...", value_delimiter = ',', value_parser = number, allow_negative_numbers = true)]
    left_heel_strikes_s: Vec<f64>,
    /// Times of left heel strikes in the recording without the device.
    #[arg(long, value_name = "SECONDS,...", value_delimiter = ',', requires = "normal", value_parser = number, allow_negative_numbers = true)]
    normal_left_heel_strikes_s: Vec<f64>,
    /// Times of right heel strikes in the recording without the device.
    #[arg(long, value_name = "SECONDS,...", value_delimiter = ',', requires = "normal", value_parser = number, allow_negative_numbers = true)]
    normal_heel_strikes_s: Vec<f64>,
    #[command(flatten)]
    filters: Filters,
    /// Print the results as one JSON object.
    #[arg(long)]
    json: bool,
    /// Output file for the mean cycles: percentage of the gait cycle, then mean and standard deviation of each channel,
    /// relative to the peak without the device.
    #[arg(long, value_name = "FILE.csv")]
    cycles: Option<PathBuf>,
    /// Output file for the envelopes: time, then each channel in the unit of the recording.
    #[arg(long, value_name = "FILE.csv")]
    envelopes: Option<PathBuf>,
}

/// Filter settings.
#[derive(Debug, Args)]
struct Filters {
    /// Lower cut-off frequency of the band-pass filter (default: 20).
    #[arg(long, value_name = "HZ", value_parser = number, allow_negative_numbers = true)]
    band_low_hz: Option<f64>,
    /// Upper cut-off frequency of the band-pass filter, below half the sampling rate (default: 450).
    #[arg(long, value_name = "HZ", value_parser = number, allow_negative_numbers = true)]
    band_high_hz: Option<f64>,
    /// Cut-off frequency of the low-pass filter for the envelope (default: 6).
    #[arg(long, value_name = "HZ", value_parser = number, allow_negative_numbers = true)]
    envelope_hz: Option<f64>,
    /// Order of both filters: 2, 4, 6 or 8 (default: 4).
    #[arg(long, value_name = "NUMBER", value_parser = filter_order, allow_negative_numbers = true)]
    order: Option<usize>,
}

impl Filters {
    fn settings(&self) -> EmgSettings {
        let usual = EmgSettings::default();
        EmgSettings {
            band_low_hz: self.band_low_hz.unwrap_or(usual.band_low_hz),
            band_high_hz: self.band_high_hz.unwrap_or(usual.band_high_hz),
            envelope_hz: self.envelope_hz.unwrap_or(usual.envelope_hz),
            order: self.order.unwrap_or(usual.order),
        }
    }
}

fn channel(text: &str) -> Result<(String, String), String> {
    let (channel, column) = text.split_once('=').ok_or("must be CHANNEL=COLUMN, as in TA_L=EMG2")?;
    Ok((channel.trim().to_owned(), column.trim().to_owned()))
}

/// The results and the settings of the filters.
#[derive(Serialize)]
struct EmgResults {
    settings: EmgSettings,
    heel_strikes_s: Vec<f64>,
    /// Absent if they were not recorded.
    #[serde(skip_serializing_if = "Option::is_none")]
    left_heel_strikes_s: Option<Vec<f64>>,
    #[serde(flatten)]
    activity: Activity,
}

/// Times of heel strikes that were given, s, with their flags.
struct GivenStrikes<'a> {
    right_s: (&'a [f64], &'static str),
    left_s: (&'a [f64], &'static str),
}

impl EmgCommand {
    pub(super) fn run(self) -> Result<(), Error> {
        let settings = self.filters.settings();
        let given = GivenStrikes {
            right_s: (&self.heel_strikes_s, "--heel-strikes-s"),
            left_s: (&self.left_heel_strikes_s, "--left-heel-strikes-s"),
        };
        let (recording, strikes, strides) = self.read(&self.recording, &given)?;
        let filters = [
            ("emg.band_low_hz", "--band-low-hz"),
            ("emg.band_high_hz", "--band-high-hz"),
            ("emg.envelope_hz", "--envelope-hz"),
            ("emg.order", "--order"),
        ];
        let envelopes = recording.envelopes(&settings).map_err(|error| of_flags(error, &filters))?;
        let measured = recording.cycles(&strides, &settings)?;
        let activity = match &self.normal {
            Some(path) => {
                let given = GivenStrikes {
                    right_s: (&self.normal_heel_strikes_s, "--normal-heel-strikes-s"),
                    left_s: (&self.normal_left_heel_strikes_s, "--normal-left-heel-strikes-s"),
                };
                let (normal, _, strides) = self.read(path, &given)?;
                if normal == recording {
                    let allowed = "a recording other than the one being processed";
                    return Err(Error::invalid("--normal", path.display().to_string(), allowed));
                }
                Activity::of_gait(&measured, &normal.cycles(&strides, &settings)?)?
            }
            None => Activity::of_normal_walking(&measured)?,
        };
        let inputs: Vec<&Path> =
            [Some(&self.recording), self.normal.as_ref()].into_iter().flatten().map(PathBuf::as_path).collect();
        let open = |path: &Option<PathBuf>| path.as_deref().map(|path| OutFile::open(path, &inputs)).transpose();
        let (cycles, envelope_file) = (open(&self.cycles)?, open(&self.envelopes)?);
        if let Some(out) = cycles {
            out.write(&cycles_csv(&activity.channels))?;
        }
        if let Some(out) = envelope_file {
            out.write(&envelopes_csv(&recording, envelopes))?;
        }
        let found =
            EmgResults { settings, heel_strikes_s: strikes.right_s, left_heel_strikes_s: strikes.left_s, activity };
        if self.json {
            data(&serde_json::to_string_pretty(&found).map_err(|e| Error::Internal(e.to_string()))?)
        } else {
            data(&for_people(&found))
        }
    }

    fn read(&self, path: &Path, given: &GivenStrikes<'_>) -> Result<(EmgRecording, FootStrikes, LegStrides), Error> {
        let ((right_s, right_flag), (left_s, left_flag)) = (given.right_s, given.left_s);
        let reading = EmgReading {
            format: self.format,
            rate_hz: self.rate_hz,
            channels: self.channels.iter().cloned().collect(),
            heel_strikes_s: right_s.to_vec(),
            heel_strike_column: self.heel_strike_column.clone(),
            left_heel_strikes_s: left_s.to_vec(),
            left_heel_strike_column: self.left_heel_strike_column.clone(),
            heel_strike_threshold: self.heel_strike_threshold,
            ..EmgReading::default()
        };
        let flags = [
            ("rate_hz", "--rate-hz"),
            ("reading.rate_hz", "--rate-hz"),
            ("reading.channels", "--channels"),
            ("heel_strikes_s", right_flag),
            ("reading.heel_strikes_s", right_flag),
            ("reading.left_heel_strikes_s", left_flag),
            ("reading.left_heel_strike_column", "--left-heel-strike-column"),
        ];
        let found = reading.read(&path.display().to_string(), &read(path)?);
        let (recording, strikes) = found.map_err(|error| of_flags(error, &flags))?;
        recording.check_channels()?;
        let strides = reading.kept_strides(&strikes)?;
        Ok((recording, strikes, strides))
    }
}

fn for_people(found: &EmgResults) -> String {
    let EmgSettings { band_low_hz, band_high_hz, envelope_hz, order } = found.settings;
    let mut lines = vec![format!(
        "band-pass {band_low_hz} to {band_high_hz} Hz, low-pass {envelope_hz} Hz, order {order}, zero-phase; values relative \
        to the peak without the device"
    )];
    let Activity { channels, averages, emg_rmse } = &found.activity;
    for (place, (channel, average)) in channels.iter().zip(averages).enumerate() {
        let part = emg_rmse.as_ref().and_then(|rmse| rmse.parts.get(place));
        let distance = part.map_or_else(String::new, |part| format!(", EMG RMSE {part:.4}"));
        let (name, peak) = (&channel.channel, channel.peak());
        let strides = if channel.strides == 1 { "1 stride".to_owned() } else { format!("{} strides", channel.strides) };
        lines.push(format!("{name}: average {average:.4}, peak {peak:.4}{distance} ({strides})"));
    }
    if channels.iter().any(|channel| channel.begins_at == CycleStart::AssumedLeftHeelStrike) {
        lines.push("left heel strikes are taken to be half a stride after the right ones".to_owned());
    }
    lines.extend(emg_rmse.as_ref().map(|rmse| format!("total EMG RMSE: {:.4}", rmse.total)));
    lines.extend(emg_rmse.iter().flat_map(|rmse| rmse.warnings.iter().cloned()));
    lines.join("\n")
}

fn cycles_csv(channels: &[CycleActivity]) -> String {
    let percent = (0..CYCLE_POINTS).map(|point| point as f64).collect();
    let mut columns = vec![("percent".to_owned(), percent)];
    for channel in channels {
        columns.push((channel.channel.clone(), channel.mean.clone()));
        columns.push((format!("{}_standard_deviation", channel.channel), channel.standard_deviation.clone()));
    }
    csv(&columns)
}

fn envelopes_csv(recording: &EmgRecording, envelopes: Vec<Envelope>) -> String {
    let samples = envelopes.first().map_or(0, |envelope| envelope.values.len());
    let times = (0..samples).map(|sample| recording.start_s + sample as f64 / recording.rate_hz).collect();
    let mut columns = vec![("time_s".to_owned(), times)];
    columns.extend(envelopes.into_iter().map(|envelope| (envelope.channel, envelope.values)));
    csv(&columns)
}

/// Columns of the same length, by name.
fn csv(columns: &[(String, Vec<f64>)]) -> String {
    let mut table = CsvTable::new(columns.iter().map(|(name, _)| name));
    for row in 0..columns.first().map_or(0, |(_, values)| values.len()) {
        table.row(columns.iter().map(|(_, values)| CsvCell::from(values.get(row))));
    }
    table.into_text()
}
