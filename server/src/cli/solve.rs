//! `gaitwright solve`: one gait.

use super::out_file::OutFile;
use super::output::data;
use super::problem::{ProblemFlags, cancelled_by_signal};
use crate::error::Error;
use clap::Args;
use gait_optimizer::certificate::{Certificate, certify};
use gait_optimizer::{SolveOutcome, SolveReport, SolveStatus, TunedBounds, solve};
use indicatif::ProgressBar;
use serde::Serialize;
use std::path::PathBuf;

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
    /// Write the whole outcome (figures, gait, multipliers) as JSON.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print the figures as one JSON object.
    #[arg(long)]
    json: bool,
    /// Examine a converged gait as `certify` does; with --json the certificate is its member `certificate`.
    #[arg(long)]
    certify: bool,
}

/// The figures of a solve, with the certificate where it was asked for.
#[derive(Serialize)]
struct Figures<'a> {
    #[serde(flatten)]
    report: &'a SolveReport,
    #[serde(skip_serializing_if = "Option::is_none")]
    certificate: Option<&'a Certificate>,
}

impl Solve {
    pub(super) async fn run(self) -> Result<(), Error> {
        let problem = self.flags.problem(TunedBounds::parse(&self.bounds)?)?;
        let (warm, options) = (self.flags.warm_start()?, self.flags.options()?);
        let out = self.out.as_deref().map(OutFile::open).transpose()?;
        let cancel = cancelled_by_signal();
        let bar = ProgressBar::new_spinner();
        let shown = bar.clone();
        let outcome = tokio::task::spawn_blocking(move || {
            let mut observer = |record: &gait_optimizer::IterationRecord| {
                shown.set_message(format!(
                    "iteration {}, objective {:.6}, violation {:.1e}, barrier {:.1e}",
                    record.iteration, record.objective, record.constraint_violation, record.barrier
                ));
                shown.tick();
            };
            solve(&problem, warm.as_ref(), &options, &mut observer, &cancel)
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
            let figures = Figures { report: &outcome.report, certificate: certificate.as_ref() };
            data(&serde_json::to_string_pretty(&figures).map_err(|e| Error::Internal(e.to_string()))?)?;
        } else {
            data(&for_people(&outcome))?;
            if let Some(certificate) = &certificate {
                data(&super::certify::for_people(certificate))?;
            }
        }
        match out {
            Some(out) => out.write(&serde_json::to_string(&outcome).map_err(|e| Error::Internal(e.to_string()))?),
            None => Ok(()),
        }
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

fn for_people(outcome: &SolveOutcome) -> String {
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
    lines.join("\n")
}
