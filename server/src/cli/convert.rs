//! `gaitwright convert`: a gait for other programs.

use super::gait_file::read_gait_and_status;
use super::out_file::OutFile;
use super::output::{data, tell};
use crate::error::Error;
use crate::gait_table::gait_csv;
use crate::plots::Figure;
use clap::{Args, ValueEnum};
use gait_optimizer::certificate::certify;
use gait_optimizer::export::{ControllerFile, motion_file};
use gait_optimizer::walking::stick_figure::stick_figures;
use gait_optimizer::{Gait, SolveStatus};
use std::path::PathBuf;

/// What a gait is converted to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Form {
    /// Table of the mesh points (CSV): angles, velocities, torques, forces, activations in SI units.
    Csv,
    /// OpenSim motion file (.mot), degrees, OpenSim's signs.
    Mot,
    /// Controller file for the device: curves, phase, set points of the prosthetic joints; explains its fields.
    Controller,
    /// The stride as a row of stick figures (SVG).
    Tiles,
}

#[derive(Debug, Args)]
pub(super) struct Convert {
    /// A file of `solve --out`, or a gait as the service gives it.
    #[arg(value_name = "GAIT.json")]
    gait: PathBuf,
    /// What to convert to.
    #[arg(long, value_enum)]
    to: Form,
    /// Samples per second of `mot` and `controller`, 10 to 5000.
    #[arg(long, value_name = "HZ", default_value = "200", allow_negative_numbers = true)]
    rate_hz: f64,
    /// Where to write it; default: stdout.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

impl Convert {
    pub(super) fn run(self) -> Result<(), Error> {
        let (gait, status) = read_gait_and_status(&self.gait)?;
        // What a device executes keeps every constraint; a curve to look at need not.
        if let (Form::Controller, Some(status)) = (&self.to, status)
            && status != SolveStatus::Converged
        {
            let file = self.gait.display();
            let reason =
                format!("{file}: its solve ended as {status:?}; a controller file is made of a converged gait only");
            return Err(Error::conflict(reason));
        }
        let out = self.out.as_deref().map(|out| OutFile::open(out, &[&self.gait])).transpose()?;
        let text = match self.to {
            Form::Csv => gait_csv(&gait),
            Form::Mot => motion_file(&gait, self.rate_hz)?,
            Form::Controller => controller_file(&gait, self.rate_hz)?,
            Form::Tiles => Figure::tiles("The stride", stick_figures(&gait)?).svg(),
        };
        match out {
            Some(out) => out.write(&text),
            None => data(text.trim_end()),
        }
    }
}

/// The controller file of a gait that no record knows: it is certified here, and whoever runs the command is told.
fn controller_file(gait: &Gait, rate_hz: f64) -> Result<String, Error> {
    let file = ControllerFile::new(gait, rate_hz)?;
    let certificate = certify(gait)?;
    if certificate.passed {
        tell("the gait passed its certificate");
    } else {
        tell(&format!("the gait FAILED its certificate: {}", certificate.objections.join("; ")));
    }
    tell("a file on its own does not know of safety reports: the service gives out no gait that was reported unsafe");
    let file = ControllerFile { certificate_passed: Some(certificate.passed), ..file };
    serde_json::to_string_pretty(&file).map_err(|e| Error::Internal(e.to_string()))
}
