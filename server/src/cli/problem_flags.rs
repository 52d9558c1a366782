//! Flags of the gait problem, warm-start files and cancellation, shared by `solve` and `sweep`.

use super::flag_names::of_flags;
use super::flag_numbers::{iterations, number};
use super::lineage::{Lineage, LineageStart, chosen_local_optimum};
use super::subject_flags::{SubjectFlags, Switch};
use clap::Args;
use gait_optimizer::NlpSettings;
use gait_optimizer::{
    Device, GaitProblem, GaitSettings, Mesh, OtherLocalOptimum, ReferenceGait, SolveOptions, SolveOutcome, TunedBounds,
};
use gaitwright_service::error::Error;
use gaitwright_service::json_document;
use gaitwright_service::studies::device;
use serde::Deserialize;
use serde::de::DeserializeOwned;
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
        serde_json::from_value(json!({ "solver": solver })).map_err(|e| Error::Malformed(e.to_string()))?;
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

#[derive(Debug, Clone, Args)]
pub(super) struct ProblemFlags {
    #[command(flatten)]
    body: SubjectFlags,
    /// Whether to solve with muscles.
    #[arg(long, value_enum, default_value = "on")]
    muscles: Switch,
    #[command(flatten)]
    files: ProblemFiles,
    /// Mesh intervals of the domains DS2,DS3,SS2,SS1, as in 4,4,6,6.
    #[arg(long, value_name = "N,N,N,N", value_parser = parse_mesh, allow_hyphen_values = true)]
    mesh: Option<Mesh>,
    /// Warm-start from the gait in a file written by `solve --out`.
    #[arg(long, value_name = "FILE")]
    warm: Option<PathBuf>,
    /// Scaled optimality tolerance (default: 1e-6).
    #[arg(long, value_name = "NUMBER", value_parser = number, allow_negative_numbers = true)]
    tolerance: Option<f64>,
    /// Maximum number of iterations in each phase of a solve (default: 1000). Phases that track the reference gait are
    /// limited to 200.
    #[arg(long, value_name = "NUMBER", value_parser = iterations, allow_negative_numbers = true)]
    max_iterations: Option<usize>,
    /// Time limit of a solve (default: none).
    #[arg(long, value_name = "SECONDS", value_parser = number, allow_negative_numbers = true)]
    time_limit_s: Option<f64>,
}

impl ProblemFlags {
    /// The problem with these bounds, validated.
    pub(super) fn problem(&self, bounds: TunedBounds) -> Result<GaitProblem, Error> {
        let (device, reference) = (self.files.device()?, self.files.reference()?);
        let mut settings = self.files.settings()?;
        settings.mesh = self.mesh.unwrap_or(settings.mesh);
        settings.validate()?;
        let (subject, muscles) = (self.body.subject()?, self.muscles.is_on());
        Ok(GaitProblem { subject, device, bounds, muscles, settings, reference })
    }

    /// The input files.
    pub(super) fn inputs(&self) -> Vec<&Path> {
        let ProblemFiles { device, settings, reference, solver_settings } = &self.files;
        [device, settings, reference, solver_settings, &self.warm].into_iter().flatten().map(PathBuf::as_path).collect()
    }

    pub(super) fn options(&self) -> Result<SolveOptions, Error> {
        let mut options = SolveOptions { time_limit_s: self.time_limit_s, ..self.files.options()? };
        options.tolerance = self.tolerance.unwrap_or(options.tolerance);
        options.max_iterations = self.max_iterations.unwrap_or(options.max_iterations);
        let flags =
            [("tolerance", "--tolerance"), ("max_iterations", "--max-iterations"), ("time_limit_s", "--time-limit-s")];
        options.validate().map_err(|error| of_flags(error, &flags))?;
        Ok(options)
    }

    /// The warm start that was given. `local_optimum` chooses a gait of another local optimum in the file.
    pub(super) fn warm_start(&self, local_optimum: Option<usize>) -> Result<Option<LineageStart>, Error> {
        let Some(path) = &self.warm else { return Ok(None) };
        let what = "a file written by `gaitwright solve --out`";
        let outcome: SolveOutcome = read_document(path, what, |_| Ok(()))?;
        let FileLineage { lineage } = read_document(path, what, |_| Ok(()))?;
        let answers = chosen_local_optimum(&outcome.report);
        let Some(local_optimum) = local_optimum.filter(|local_optimum| Some(*local_optimum) != answers) else {
            return Ok(Some(LineageStart::answer(outcome, lineage)));
        };
        let mut known: Vec<usize> =
            answers.into_iter().chain(outcome.other_local_optima.iter().map(|o| o.local_optimum)).collect();
        known.sort_unstable();
        let other = outcome.other_local_optima.into_iter().find(|other| other.local_optimum == local_optimum);
        let refused = || {
            let known = known.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
            Error::Malformed(format!(
                "{} has no local optimum with the number {local_optimum}. Numbers for --warm-local-optimum: {known}.",
                path.display()
            ))
        };
        let start = |other: OtherLocalOptimum| {
            LineageStart::cold(other.warm_start, (Some(other.local_optimum), other.objective, other.gait_rmse_rad))
        };
        other.map(|other| Some(start(other))).ok_or_else(refused)
    }
}

/// The lineage in a file of `solve --out`, if it has one.
#[derive(Deserialize)]
struct FileLineage {
    #[serde(default)]
    lineage: Option<Lineage>,
}

pub(super) fn read(path: &Path) -> Result<String, Error> {
    let bytes = std::fs::read(path).map_err(|e| Error::Malformed(format!("Cannot read {}: {e}.", path.display())))?;
    String::from_utf8(bytes).map_err(|error| {
        let readable = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = readable.split(|byte| *byte == b'\n').count();
        Error::Malformed(format!("{}, line {line}, is not valid UTF-8. Save the file as UTF-8.", path.display()))
    })
}

/// Reads and checks a JSON file. Errors name the file.
pub(super) fn read_document<T: DeserializeOwned>(
    path: &Path,
    what: &str,
    check: impl Fn(&T) -> Result<(), Error>,
) -> Result<T, Error> {
    let read = json_document::read(read(path)?.as_bytes()).and_then(|read| check(&read).map(|()| read));
    read.map_err(|e| Error::Malformed(format!("{} is not {what}: {e}", path.display())))
}

fn parse_mesh(text: &str) -> Result<Mesh, String> {
    let numbers: Result<Vec<usize>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    match numbers.as_deref() {
        Ok([ds2, ds3, ss2, ss1]) => {
            let mesh = Mesh { ds2: *ds2, ds3: *ds3, ss2: *ss2, ss1: *ss1 };
            mesh.validate().map_err(|e| e.to_string())?;
            Ok(mesh)
        }
        _ => Err("must be four whole numbers for DS2,DS3,SS2,SS1, as in 4,4,6,6".to_owned()),
    }
}
