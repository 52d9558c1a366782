//! `gaitwright convert`: converts a gait for other programs. Not to controller files: only the record knows safety
//! reports.

use super::flag_names::of_flags;
use super::flag_numbers::number;
use super::gait_file::read_gait_file;
use super::out_file::OutFile;
use super::output::data;
use clap::{Args, ValueEnum};
use gait_optimizer::export::motion_file;
use gait_optimizer::gait::stick_figure::stick_figures;
use gaitwright_charts::gait_table::gait_csv;
use gaitwright_charts::{Figure, GaitWalker, gait_charts};
use gaitwright_service::error::Error;
use std::path::PathBuf;

/// A target format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum TargetFormat {
    /// Table of the nodes (CSV) with angles, velocities, torques, forces and activations in SI units.
    Csv,
    /// OpenSim motion file (.mot) in degrees, with OpenSim's sign conventions.
    Mot,
    /// The stride as a row of pictures (SVG).
    Tiles,
    /// Looping animation of the walker (SVG).
    Animation,
}

#[derive(Debug, Args)]
pub(super) struct ConvertCommand {
    /// File written by `solve --out`, or a gait downloaded from the service.
    #[arg(value_name = "GAIT.json")]
    gait: PathBuf,
    /// Target format.
    #[arg(long, value_enum, value_name = "FORMAT")]
    to: TargetFormat,
    /// Sampling rate of the `mot` file, Hz, 10 to 5000.
    #[arg(long, value_name = "HZ", default_value = "200", value_parser = number, allow_negative_numbers = true)]
    rate_hz: f64,
    /// Output file (default: standard output).
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

impl ConvertCommand {
    pub(super) fn run(self) -> Result<(), Error> {
        let gait = read_gait_file(&self.gait)?.gait;
        let out = OutFile::instead_of_stdout(self.out.as_deref(), &[&self.gait])?;
        let text = match self.to {
            TargetFormat::Csv => gait_csv(&gait),
            TargetFormat::Mot => {
                motion_file(&gait, self.rate_hz).map_err(|error| of_flags(error, &[("rate_hz", "--rate-hz")]))?
            }
            TargetFormat::Tiles => Figure::tiles("The stride", stick_figures(&gait)?).svg(),
            TargetFormat::Animation => gait_charts::animation(GaitWalker::new(&gait)?).svg(),
        };
        match out {
            Some(out) => out.write(&text),
            None => data(text.trim_end()),
        }
    }
}
