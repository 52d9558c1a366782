//! `gaitwright atlas`: the gait of every action of Table I, from one root gait.

use super::atlas_table;
use super::command_end::CommandEnd;
use super::cores::cores_or;
use super::flag_numbers::workers;
use super::interruption::cancelled_by_signal;
use super::multi_start_flags::MultiStartFlags;
use super::out_file::OutFile;
use super::output::tell;
use super::problem_flags::ProblemFlags;
use clap::Args;
use gait_optimizer::TunedBounds;
use gaitwright_compute::Pool;
use gaitwright_service::error::Error;
use gaitwright_service::studies::atlas;
use indicatif::ProgressBar;
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
        let progress_path = progress_path(&self.out);
        let workers = cores_or(self.workers);
        tell(&format!("solves so far: {}", progress_path.display()));
        let pool = Pool::new(1);
        let made = pool.run(move |pool| {
            let bar = ProgressBar::no_length();
            let mut show = |map: &atlas::GaitMap| {
                bar.set_length(map.actions());
                bar.set_position(map.assigned());
            };
            let made = atlas::make(pool, (problem, options, start), &progress_path, workers, &mut show, &cancel);
            bar.finish_and_clear();
            made
        });
        let Some(finished) = made.await?? else {
            tell("stopped; run the same command again to continue");
            return Ok(CommandEnd::Interrupted);
        };
        out.append(&atlas_table::text(&finished.map))?;
        let path = out.path().display().to_string();
        out.finish()?;
        tell(&format!("{}; written to {path}", finished.map.in_words()));
        if let Err(e) = finished.forget_progress() {
            tell(&format!("gaitwright: cannot remove the progress file: {e}"));
        }
        Ok(CommandEnd::Done)
    }
}

fn progress_path(out: &Path) -> PathBuf {
    let mut name = out.as_os_str().to_owned();
    name.push(".progress");
    name.into()
}
