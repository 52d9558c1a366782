//! `gaitwright atlas`: the gait of every action of Table I, from one root gait.

use super::atlas_table;
use super::certify;
use super::command_end::CommandEnd;
use super::cores::cores_or;
use super::flag_numbers::workers;
use super::interruption::cancelled_by_signal;
use super::lineage::Lineage;
use super::multi_start_flags::MultiStartFlags;
use super::out_file::OutFile;
use super::output::tell;
use super::problem_flags::ProblemFlags;
use super::solve_file;
use clap::Args;
use gait_optimizer::TunedBounds;
use gaitwright_compute::Pool;
use gaitwright_service::error::Error;
use gaitwright_service::studies::atlas::{self, BestCertifiedGaitSearch};
use indicatif::{ProgressBar, ProgressStyle};
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(super) struct AtlasCommand {
    #[command(flatten)]
    flags: ProblemFlags,
    #[command(flatten)]
    multi_start: MultiStartFlags,
    /// Output file with one row for each action. Until it is complete, the solves so far are in FILE.csv.progress; if
    /// the process is killed, run the same command again to continue.
    #[arg(long, value_name = "FILE.csv")]
    out: PathBuf,
    /// When the atlas is complete, certify its gaits, the lowest Gait RMSE first, until one passes, and write that gait to
    /// this file (JSON), as `solve --out` does.
    #[arg(long, value_name = "FILE.json")]
    best: Option<PathBuf>,
    /// When the atlas is complete, write the joint angles of each different gait to this file.
    #[arg(long, value_name = "FILE.csv")]
    joint_angles: Option<PathBuf>,
    /// Number of solves that run in parallel (default: number of cores). The result does not depend on it.
    #[arg(long, value_name = "NUMBER", value_parser = workers, allow_negative_numbers = true)]
    workers: Option<usize>,
}

impl AtlasCommand {
    pub(super) async fn run(self) -> Result<CommandEnd, Error> {
        let problem = self.flags.problem(TunedBounds::default())?;
        let options = self.multi_start.applied_to(self.flags.options()?)?;
        let start = self.flags.warm_start(None)?.map(|start| start.point);
        let cancel = cancelled_by_signal();
        let mut out = OutFile::open(&self.out, &self.flags.inputs())?;
        let best = self.best.as_deref().map(|best| OutFile::open(best, &self.flags.inputs())).transpose()?;
        let angles = self.joint_angles.as_deref();
        let angles = angles.map(|path| OutFile::open(path, &self.flags.inputs())).transpose()?;
        let stopped = cancel.clone();
        let progress_path = progress_path(&self.out);
        let workers = cores_or(self.workers);
        tell(&format!("partial results: {}", progress_path.display()));
        let pool = Pool::new(1);
        let made = pool.run(move |pool| {
            let bar = progress_bar();
            let mut show = |map: &atlas::GaitMap| {
                bar.set_length(map.actions());
                bar.set_position(map.assigned());
            };
            let made = atlas::make(pool, (problem, options, start), &progress_path, workers, &mut show, &cancel);
            bar.finish_and_clear();
            made
        });
        let Some(finished) = made.await?? else {
            tell("interrupted; run the same command again to continue");
            return Ok(CommandEnd::Interrupted);
        };
        out.append(&atlas_table::text(&finished.map))?;
        let path = out.path().display().to_string();
        out.finish()?;
        tell(&format!("{}; written to {path}", finished.map.in_words()));
        if let Some(file) = angles {
            file.write(&atlas_table::joint_angles(&finished.map))?;
        }
        let finished = match best {
            None => finished,
            Some(file) => {
                let mut observer = |number| tell(&format!("certifying gait {number}"));
                let search = pool.run(move |pool| {
                    let found = finished.best_certified_gait(pool, &mut observer, &stopped);
                    found.map(|found| (finished, found))
                });
                let (finished, found) = search.await??;
                if matches!(found, BestCertifiedGaitSearch::Cancelled) {
                    tell("interrupted; run the same command again to continue");
                    return Ok(CommandEnd::Interrupted);
                }
                write_best(found, file)?;
                finished
            }
        };
        if let Err(e) = finished.forget_progress() {
            tell(&format!("gaitwright: cannot remove the progress file: {e}"));
        }
        Ok(CommandEnd::Done)
    }
}

fn write_best(found: BestCertifiedGaitSearch, file: OutFile) -> Result<(), Error> {
    let BestCertifiedGaitSearch::Found { best, failed } = found else {
        return Err(Error::Malformed("No gait of the atlas passed certification.".to_owned()));
    };
    let path = file.path().display().to_string();
    file.write(&solve_file::text(&best.outcome, &Lineage::of(&best.outcome, None))?)?;
    let (number, rmse) = (best.number, best.outcome.report.gait_rmse_rad);
    tell(&format!("best certified gait: gait {number}, Gait RMSE {rmse:.4} rad; written to {path}"));
    if failed > 0 {
        tell(&format!("gaits with a lower Gait RMSE that failed certification: {failed}"));
    }
    tell(&certify::for_people(&best.certificate));
    Ok(())
}

/// A bar over actions. The time left assumes that further solves serve as many actions as those so far.
fn progress_bar() -> ProgressBar {
    let bar = ProgressBar::no_length();
    if let Ok(style) = ProgressStyle::with_template(
        "{elapsed_precise} [{bar:30}] {pos} of {len} actions have a result, about {eta} left",
    ) {
        bar.set_style(style.progress_chars("=> "));
    }
    bar
}

fn progress_path(out: &Path) -> PathBuf {
    let mut name = out.as_os_str().to_owned();
    name.push(".progress");
    name.into()
}
