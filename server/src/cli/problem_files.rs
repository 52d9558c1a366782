//! Files that replace parts of the built-in problem: device, settings, reference gait and solver settings.

use super::input_file::{read, read_document};
use clap::Args;
use gait_optimizer::{Device, GaitSettings, NlpSettings, ReferenceGait, SolveOptions};
use gaitwright_service::error::Error;
use gaitwright_service::json_document;
use gaitwright_service::studies::device;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Files that replace parts of the built-in problem.
#[derive(Debug, Clone, Args)]
pub(super) struct ProblemFiles {
    /// JSON device file (default: the built-in AMPRO3).
    #[arg(long, value_name = "FILE")]
    device: Option<PathBuf>,
    /// Settings of the gait problem that differ from the defaults (JSON), as in
    /// {"limits": {"speed_min_m_s": 1.1}, "muscles": {"sol": {"max_force_n": 3500}}}.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Reference gait: `falisse-2019` (one adult), `fukuchi-2018` (median of 24 adults), or a JSON file written by
    /// `gaitwright reference` (default: falisse-2019).
    #[arg(long, value_name = "NAME or FILE")]
    reference: Option<PathBuf>,
    /// Settings of the interior-point method that differ from the defaults (JSON), as in {"bound_push": 0.01,
    /// "linear_solver": "delayed_pivots"}. An unknown name is refused with a list of the known ones.
    #[arg(long, value_name = "FILE")]
    solver_settings: Option<PathBuf>,
}

impl ProblemFiles {
    /// The files that were given.
    pub(super) fn paths(&self) -> impl Iterator<Item = &Path> {
        let Self { device, settings, reference, solver_settings } = self;
        [device, settings, reference, solver_settings].into_iter().flatten().map(PathBuf::as_path)
    }

    pub(super) fn device(&self) -> Result<Device, Error> {
        Ok(match &self.device {
            Some(path) => read_document(path, "a device file", device::check)?,
            None => Device::ampro3()?,
        })
    }

    /// The settings of the gait problem, validated.
    pub(super) fn settings(&self) -> Result<GaitSettings, Error> {
        Ok(match &self.settings {
            Some(path) => read_document(path, "a file of gait settings", |read: &GaitSettings| Ok(read.validate()?))?,
            None => GaitSettings::default(),
        })
    }

    /// The default options, with the given settings of the interior-point method.
    pub(super) fn options(&self) -> Result<SolveOptions, Error> {
        match &self.solver_settings {
            Some(path) => options_with_solver(&read(path)?)
                .map_err(|e| Error::Malformed(format!("{} is not a file of solver settings: {e}", path.display()))),
            None => Ok(SolveOptions::default()),
        }
    }

    pub(super) fn reference(&self) -> Result<ReferenceGait, Error> {
        reference_of(self.reference.as_deref())
    }
}

/// Options with the solver settings of a document.
fn options_with_solver(text: &str) -> Result<SolveOptions, Error> {
    // Parsed alone first, so that errors name the field and its position.
    json_document::read::<NlpSettings>(text.as_bytes())?;
    let solver: Value = json_document::read(text.as_bytes())?;
    let options: SolveOptions =
        serde_json::from_value(json!({ "solver": solver })).map_err(|e| Error::Malformed(format!("{e}.")))?;
    options.validate()?;
    Ok(options)
}

/// The built-in reference gait of this name, or the one in this file; without either the default one.
pub(super) fn reference_of(path: Option<&Path>) -> Result<ReferenceGait, Error> {
    let Some(path) = path else { return Ok(ReferenceGait::builtin()?) };
    if let Some((_, builtin)) = ReferenceGait::all_builtin()?.into_iter().find(|(name, _)| path.as_os_str() == *name) {
        return Ok(builtin);
    }
    if let Err(error) = std::fs::metadata(path)
        && error.kind() == std::io::ErrorKind::NotFound
    {
        let names: Vec<&str> = ReferenceGait::all_builtin()?.into_iter().map(|(name, _)| name).collect();
        return Err(Error::Malformed(format!(
            "There is no reference gait {}. Give the name of a built-in one ({}) or an existing file.",
            path.display(),
            names.join(", ")
        )));
    }
    read_document(path, "a reference gait", |read: &ReferenceGait| Ok(read.validate()?))
}
