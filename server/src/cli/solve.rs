//! `gaitwright solve`: optimises one gait.

use super::command_end::CommandEnd;
use super::cores::cores_or;
use super::flag_numbers::local_optimum;
use super::input_file::read_document;
use super::interruption::cancelled_by_signal;
use super::lineage::{Lineage, LineageStart, chosen_local_optimum};
use super::multi_start_flags::MultiStartFlags;
use super::out_file::OutFile;
use super::output::{data, tell};
use super::problem_flags::ProblemFlags;
use super::reference_comparison;
use super::solve_file;
use clap::Args;
use gait_optimizer::certificate::{Certificate, certify};
use gait_optimizer::explanation::{self, Explanation};
use gait_optimizer::reference_comparison::{ReferenceComparison, compare_with_references};
use gait_optimizer::sensitivity::{GaitSensitivities, sensitivities};
use gait_optimizer::{
    DisplayAngleUnit, GaitProblem, SolveError, SolveOptions, SolveOutcome, SolveReport, SolveStatus, StartedFrom,
    TunedBounds, solve,
};
use gaitwright_compute::Pool;
use gaitwright_service::error::Error;
use gaitwright_service::studies::problem_file::SolveInput;
use gaitwright_service::studies::sensitivities::refusal;
use indicatif::ProgressBar;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Maximum number of threads of a solve.
const MAX_THREADS: usize = 16;

#[derive(Debug, Args)]
pub(super) struct SolveCommand {
    #[command(flatten)]
    flags: ProblemFlags,
    /// Bounds that differ from the loosest values in Table I of the paper, as in a1=20,a5=0.013.
    #[arg(
        long,
        value_name = "NAME=VALUE,...",
        default_value = "",
        hide_default_value = true,
        allow_hyphen_values = true
    )]
    bounds: String,
    /// Problem file (problem.json) of a trial, downloaded from the service. Replaces all flags that define the problem
    /// or the warm start.
    #[arg(
        long,
        value_name = "FILE",
        conflicts_with_all = [
            "subject", "height_m", "body_mass_kg", "muscles", "device", "settings", "reference", "mesh", "warm", "tolerance",
            "max_iterations", "time_limit_s", "solver_settings", "bounds", "initial_guesses", "nearest_within"
        ]
    )]
    problem: Option<PathBuf>,
    /// Local optimum in the --warm file to start from (default: that of the gait in the file). Local optima are numbered
    /// from 1, in the order of the initial guesses that reached them; `solve` lists them if there are several.
    #[arg(long, value_name = "NUMBER", requires = "warm", value_parser = local_optimum, allow_negative_numbers = true)]
    warm_local_optimum: Option<usize>,
    #[command(flatten)]
    multi_start: MultiStartFlags,
    /// Output file (JSON) for the results, the gait, its multipliers, the gaits that it was warm-started from, and the
    /// gaits of other local optima.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print the results as one JSON object.
    #[arg(long)]
    json: bool,
    /// If no gait is found, explain which bounds conflict, and whether relaxing any one of them, or a few together, gives
    /// a gait. Takes dozens of solves. Ctrl-C stops the explanation; the conflicts and relaxations found so far are printed.
    #[arg(long)]
    explain: bool,
    /// Certify a converged gait, as `certify` does. With --json, adds the member `certificate`.
    #[arg(long)]
    certify: bool,
    /// For a converged gait, print for each of the bounds a1 to a8 how the results change with it (to first order),
    /// where it is active, and how far it can move before the set of active constraints changes. With --json, adds the
    /// member `sensitivities`.
    #[arg(long)]
    sensitivities: bool,
}

/// The printed result, with the certificate or the explanation if requested.
#[derive(Debug, Serialize)]
struct PrintedSolve<'a> {
    #[serde(flatten)]
    report: &'a SolveReport,
    lineage: &'a Lineage,
    /// Gait RMSE of a converged gait against the reference gait of the problem and against the built-in ones.
    reference_gaits: &'a [ReferenceComparison],
    #[serde(skip_serializing_if = "Option::is_none")]
    certificate: Option<&'a Certificate>,
    #[serde(skip_serializing_if = "Option::is_none")]
    explanation: Option<&'a Explanation>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sensitivities: Option<&'a GaitSensitivities>,
}

impl SolveCommand {
    fn input(&self) -> Result<(GaitProblem, SolveOptions, Option<LineageStart>), Error> {
        if let Some(path) = &self.problem {
            let SolveInput { problem, options, warm_start } =
                read_document(path, "a problem file of a trial", SolveInput::check)?;
            return Ok((problem, options, warm_start.map(LineageStart::unknown)));
        }
        let problem = self.flags.problem(TunedBounds::parse(&self.bounds)?)?;
        let options = self.multi_start.applied_to(self.flags.options()?)?;
        Ok((problem, options, self.flags.warm_start(self.warm_local_optimum)?))
    }

    pub(super) async fn run(self) -> Result<CommandEnd, Error> {
        let (problem, mut options, start) = self.input()?;
        let warm = start.as_ref().map(|start| start.point.clone());
        // The result does not depend on the number of threads.
        options.threads = cores_or(None).min(MAX_THREADS);
        // Before the output file is created, so that a signal cannot leave it behind.
        let cancel = cancelled_by_signal();
        let stopped = cancel.clone();
        let inputs: Vec<&Path> = self.flags.inputs().into_iter().chain(self.problem.as_deref()).collect();
        let out = self.out.as_deref().map(|out| OutFile::open(out, &inputs)).transpose()?;
        let bar = ProgressBar::new_spinner();
        let shown = bar.clone();
        let explain = self.explain;
        let (reference, solved_problem) = (problem.reference.clone(), problem.clone());
        let pool = Pool::new(1);
        let solved = pool.run(move |_| {
            let mut observer = |record: &gait_optimizer::IterationRecord| {
                shown.set_message(format!(
                    "iteration {}, objective {:.6}, violation {:.1e}, barrier parameter {:.1e}",
                    record.iteration, record.objective, record.constraint_violation, record.barrier
                ));
                shown.tick();
            };
            let outcome = solve(&problem, warm.as_ref(), &options, &mut observer, &cancel)?;
            let explanation = if explain {
                let mut progress = |question: &str| {
                    shown.suspend(|| tell(question));
                    shown.set_message(question.to_owned());
                };
                let found = explanation::explain(&problem, (&outcome).into(), &options, &mut progress, &cancel)?;
                if found.is_none() && cancel.is_cancelled() {
                    tell("The explanation was stopped before it had found a conflict.");
                }
                found
            } else {
                None
            };
            Ok::<_, SolveError>((outcome, explanation))
        });
        let (outcome, explanation) = solved.await??;
        bar.finish_and_clear();
        let lineage = Lineage::of(&outcome, start.as_ref());
        let converged = outcome.report.status == SolveStatus::Converged;
        let comparisons = if converged { compare_with_references(&outcome.gait, &reference)? } else { Vec::new() };
        let certificate = if self.certify && converged {
            let gait = outcome.gait.clone();
            Some(pool.run(move |_| certify(&gait)).await??)
        } else {
            None
        };
        let sensitivities = if self.sensitivities && converged {
            let (problem, warm_start) = (solved_problem, outcome.warm_start.clone());
            Some(pool.run(move |_| sensitivities(&problem, &warm_start, &options)).await?.map_err(refusal)?)
        } else {
            None
        };
        // Print the result first, so that it is not lost if the file cannot be written.
        if self.json {
            let printed = PrintedSolve {
                report: &outcome.report,
                lineage: &lineage,
                reference_gaits: &comparisons,
                certificate: certificate.as_ref(),
                explanation: explanation.as_ref(),
                sensitivities: sensitivities.as_ref(),
            };
            data(&serde_json::to_string_pretty(&printed).map_err(|e| Error::Internal(e.to_string()))?)?;
        } else {
            data(&for_people(&outcome, &comparisons, &lineage, start.as_ref(), explanation.as_ref()))?;
            if let Some(certificate) = &certificate {
                data(&super::certify::for_people(certificate))?;
            }
            if let Some(sensitivities) = &sensitivities {
                data(&sensitivities.sentences(DisplayAngleUnit::Radian).join("\n"))?;
            }
        }
        if outcome.report.status == SolveStatus::Cancelled {
            return Ok(CommandEnd::Interrupted);
        }
        if let Some(out) = out {
            out.write(&solve_file::text(&outcome, &lineage)?)?;
        }
        let was_stopped = explain && !converged && stopped.is_cancelled();
        Ok(if was_stopped { CommandEnd::Interrupted } else { CommandEnd::Done })
    }
}

/// The status as in JSON and CSV.
pub(super) fn status_word(status: SolveStatus) -> &'static str {
    match status {
        SolveStatus::Converged => "converged",
        SolveStatus::Infeasible => "infeasible",
        SolveStatus::Stalled => "stalled",
        SolveStatus::IterationLimit => "iteration_limit",
        SolveStatus::TimeLimit => "time_limit",
        SolveStatus::Cancelled => "cancelled",
    }
}

/// The status as text.
fn status_in_words(status: SolveStatus) -> &'static str {
    match status {
        SolveStatus::IterationLimit => "iteration limit reached",
        SolveStatus::TimeLimit => "time limit reached",
        SolveStatus::Converged | SolveStatus::Infeasible | SolveStatus::Stalled | SolveStatus::Cancelled => {
            status_word(status)
        }
    }
}

fn for_people(
    outcome: &SolveOutcome,
    comparisons: &[ReferenceComparison],
    lineage: &Lineage,
    start: Option<&LineageStart>,
    explanation: Option<&Explanation>,
) -> String {
    let r = &outcome.report;
    let mut lines = vec![
        format!("{} after {} iterations, {:.2} s", status_in_words(r.status), r.iterations, r.seconds_total),
        format!("  cost of transport  {:.5}   objective {:.5}", r.cost_of_transport, r.objective),
        format!("  speed              {:.3} m/s   stride {:.3} m", r.speed_m_s, r.stride_length_m),
        format!("  largest violation  {:.1e}", r.max_violation),
        format!(
            "  problem            {} variables, {} equalities, {} inequalities",
            r.variables, r.equalities, r.inequalities
        ),
    ];
    if comparisons.is_empty() {
        lines.insert(2, format!("  Gait RMSE          {:.4} rad", r.gait_rmse_rad));
    } else {
        lines.splice(2..2, reference_comparison::in_words(comparisons));
    }
    lines.extend(linear_algebra_in_words(r));
    lines.extend(lineage_in_words(r, lineage, start));
    lines.extend(local_optima_in_words(r));
    for violation in outcome.violations.iter().take(10) {
        lines.push(format!("  violated: {} by {}", violation.row, violation.amount_in_words()));
    }
    if let Some(explanation) = explanation {
        lines.extend(explanation.sentences().iter().map(|sentence| format!("  {sentence}")));
    }
    lines.join("\n")
}

/// The time of all runs by task.
fn linear_algebra_in_words(report: &SolveReport) -> Vec<String> {
    let Some(algebra) = &report.linear_algebra else { return Vec::new() };
    let fallbacks = match algebra.fallbacks {
        0 => "no fallback".to_owned(),
        1 => "1 fallback".to_owned(),
        many => format!("{many} fallbacks"),
    };
    vec![
        format!(
            "  time               evaluation {:.2} s, factorisation {:.2} s, substitutions {:.2} s, analysis {:.2} s",
            report.seconds_evaluation, algebra.seconds_factorisation, algebra.seconds_solves, algebra.seconds_analysis
        ),
        format!(
            "  linear algebra     {} factorisations, {} substitutions, {fallbacks}",
            algebra.factorisations, algebra.substitutions
        ),
    ]
}

/// The gait and its ancestors.
fn lineage_in_words(report: &SolveReport, lineage: &Lineage, start: Option<&LineageStart>) -> Vec<String> {
    let local_optimum = lineage.local_optimum.map_or_else(String::new, |number| format!(" (local optimum {number})"));
    let mut lines = vec![format!("  gait               {}{local_optimum}", lineage.id)];
    let given = start.map(|start| &start.gait);
    if let (StartedFrom::ColdAfterWarm, Some(given)) = (report.started_from, given) {
        lines.push(format!(
            "  started from       initial guesses: the warm start from {} did not converge",
            given.in_words()
        ));
    }
    for (generation, ancestor) in lineage.ancestors.iter().enumerate() {
        let which = if generation == 0 { "started from" } else { "which came from" };
        lines.push(format!("  {which:<19}{}", ancestor.in_words()));
    }
    lines
}

/// The local optima, if there are several, each as found by its first run.
fn local_optima_in_words(report: &SolveReport) -> Vec<String> {
    let answer = chosen_local_optimum(report);
    let mut lines: Vec<String> = Vec::new();
    for run in &report.solver_runs {
        let Some(local_optimum) = run.local_optimum.filter(|local_optimum| *local_optimum > lines.len()) else {
            continue;
        };
        let chosen = if run.local_optimum == answer { ", chosen" } else { "" };
        lines.push(format!(
            "  local optimum {local_optimum:<5}objective {:.5}   Gait RMSE {:.4} rad{chosen}",
            run.objective, run.gait_rmse_rad
        ));
    }
    if lines.len() > 1 { lines } else { Vec::new() }
}
