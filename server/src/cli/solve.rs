//! `gaitwright solve`: one gait.

use super::Ended;
use super::out_file::OutFile;
use super::output::data;
use super::problem::{ProblemFlags, cancelled_by_signal, read_document};
use crate::error::Error;
use crate::studies::solve_input::SolveInput;
use clap::Args;
use gait_optimizer::certificate::{Certificate, certify};
use gait_optimizer::explanation::{self, Explanation};
use gait_optimizer::{SolveError, SolveOutcome, SolveReport, SolveStatus, TunedBounds, solve};
use indicatif::ProgressBar;
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(super) struct Solve {
    #[command(flatten)]
    flags: ProblemFlags,
    /// Bounds that differ from the loosest of Table I, as in a1=20,a5=0.013.
    #[arg(
        long,
        value_name = "NAME=VALUE,...",
        default_value = "",
        hide_default_value = true,
        allow_hyphen_values = true
    )]
    bounds: String,
    /// What a trial of the service solved, as its page gives it: in place of every flag that says what to solve and from where.
    #[arg(
        long,
        value_name = "FILE",
        conflicts_with_all = [
            "subject", "height_m", "mass_kg", "muscles", "device", "settings", "reference", "mesh", "warm", "tolerance",
            "max_iterations", "time_limit_s", "bounds"
        ]
    )]
    problem: Option<PathBuf>,
    /// Write the whole outcome (figures, gait, multipliers) as JSON.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print the figures as one JSON object.
    #[arg(long)]
    json: bool,
    /// Where no gait is found: say why, and which bound, relaxed alone, gives one. Solves up to eight times per bound.
    #[arg(long)]
    explain: bool,
    /// Examine a converged gait as `certify` does; with --json the certificate is its member `certificate`.
    #[arg(long)]
    certify: bool,
}

/// The figures; where it was asked for, the certificate of the gait, or why there is none.
#[derive(Debug, Serialize)]
struct Figures<'a> {
    #[serde(flatten)]
    report: &'a SolveReport,
    #[serde(skip_serializing_if = "Option::is_none")]
    certificate: Option<&'a Certificate>,
    #[serde(skip_serializing_if = "Option::is_none")]
    explanation: Option<&'a Explanation>,
}

impl Solve {
    fn input(&self) -> Result<SolveInput, Error> {
        if let Some(path) = &self.problem {
            return read_document(path, "what a trial solved", SolveInput::check);
        }
        Ok(SolveInput {
            problem: self.flags.problem(TunedBounds::parse(&self.bounds)?)?,
            options: self.flags.options()?,
            warm_start: self.flags.warm_start()?,
        })
    }

    pub(super) async fn run(self) -> Result<Ended, Error> {
        let SolveInput { problem, options, warm_start: warm } = self.input()?;
        let inputs: Vec<&Path> = self.flags.inputs().into_iter().chain(self.problem.as_deref()).collect();
        let out = self.out.as_deref().map(|out| OutFile::open(out, &inputs)).transpose()?;
        let cancel = cancelled_by_signal();
        let bar = ProgressBar::new_spinner();
        let shown = bar.clone();
        let explain = self.explain;
        let (outcome, explanation) = tokio::task::spawn_blocking(move || {
            let mut observer = |record: &gait_optimizer::IterationRecord| {
                shown.set_message(format!(
                    "iteration {}, objective {:.6}, violation {:.1e}, barrier {:.1e}",
                    record.iteration, record.objective, record.constraint_violation, record.barrier
                ));
                shown.tick();
            };
            let outcome = solve(&problem, warm.as_ref(), &options, &mut observer, &cancel)?;
            let explanation = if explain {
                let mut progress = |bound: &str| shown.set_message(format!("what if {bound} gave way?"));
                explanation::explain(&problem, (&outcome).into(), &options, &mut progress, &cancel)?
            } else {
                None
            };
            Ok::<_, SolveError>((outcome, explanation))
        })
        .await
        .map_err(|e| Error::Internal(e.to_string()))??;
        bar.finish_and_clear();
        let converged = outcome.report.status == SolveStatus::Converged;
        let certificate = if self.certify && converged {
            let gait = outcome.gait.clone();
            let examined = tokio::task::spawn_blocking(move || certify(&gait)).await;
            Some(examined.map_err(|e| Error::Internal(e.to_string()))??)
        } else {
            None
        };
        // The figures first: whatever becomes of the file, they are not lost.
        if self.json {
            let figures = Figures {
                report: &outcome.report,
                certificate: certificate.as_ref(),
                explanation: explanation.as_ref(),
            };
            data(&serde_json::to_string_pretty(&figures).map_err(|e| Error::Internal(e.to_string()))?)?;
        } else {
            data(&for_people(&outcome, explanation.as_ref()))?;
            if let Some(certificate) = &certificate {
                data(&super::certify::for_people(certificate))?;
            }
        }
        if outcome.report.status == SolveStatus::Cancelled {
            return Ok(Ended::Interrupted);
        }
        if let Some(out) = out {
            out.write(&serde_json::to_string(&outcome).map_err(|e| Error::Internal(e.to_string()))?)?;
        }
        Ok(Ended::Done)
    }
}

/// A status as in JSON.
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

fn for_people(outcome: &SolveOutcome, explanation: Option<&Explanation>) -> String {
    let r = &outcome.report;
    let mut lines = vec![
        format!("{} after {} iterations, {:.2} s", status_word(r.status), r.iterations, r.seconds_total),
        format!("  cost of transport  {:.5}   objective {:.5}", r.cost_of_transport, r.objective),
        format!("  Gait RMSE          {:.4} rad", r.gait_rmse_rad),
        format!("  speed              {:.3} m/s   stride {:.3} m", r.speed_m_s, r.stride_length_m),
        format!("  largest violation  {:.1e}", r.max_violation),
        format!(
            "  problem            {} variables, {} equalities, {} inequalities",
            r.variables, r.equalities, r.inequalities
        ),
    ];
    for violation in outcome.violations.iter().take(10) {
        lines.push(format!("  not met: {} by {:.3e} {}", violation.row, violation.amount, violation.unit));
    }
    if let Some(explanation) = explanation {
        lines.extend(explanation.sentences().iter().map(|sentence| format!("  {sentence}")));
    }
    lines.join("\n")
}
