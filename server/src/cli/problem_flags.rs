//! Flags of the gait problem, warm-start files and cancellation, shared by `solve` and `sweep`.

use super::flag_names::of_flags;
use super::flag_numbers::{iterations, number};
use super::input_file::read_document;
use super::lineage::{Lineage, LineageStart, chosen_local_optimum};
use super::problem_files::ProblemFiles;
use super::subject_flags::{SubjectFlags, Switch};
use clap::Args;
use gait_optimizer::{GaitProblem, Mesh, OtherLocalOptimum, SolveOptions, SolveOutcome, TunedBounds};
use gaitwright_service::error::Error;
use serde::Deserialize;
use std::path::{Path, PathBuf};

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
        self.files.paths().chain(self.warm.as_deref()).collect()
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
