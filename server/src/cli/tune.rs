//! `gaitwright tune`: an unattended study from the command line.

use super::Ended;
use super::body::{Body, Switch};
use super::numbers::{seed, trials, workers};
use super::output::{data, tell};
use super::serve::{cores_or, interrupted};
use crate::error::Error;
use crate::store::audit::Actor;
use crate::store::studies::{Study, StudyState};
use crate::store::trials::Trial;
use crate::store::{Store, commit, studies, trials as trial_rows};
use crate::studies::catalogue;
use crate::studies::director::Director;
use crate::studies::plan::{self, NewStudy};
use crate::studies::standing::Standing;
use crate::studies::summary::{self, Summary};
use crate::workers::{GaitSolver, InProcess};
use clap::Args;
use gait_optimizer::TunedBounds;
use indicatif::{ProgressBar, ProgressStyle};
use std::fmt::Write;
use std::path::PathBuf;
use std::sync::Arc;

#[derive(Debug, Args)]
pub(super) struct Tune {
    #[command(flatten)]
    body: Body,
    /// With muscles (C1-C12) or without (C1-C4).
    #[arg(long, value_enum, default_value = "on")]
    muscles: Switch,
    /// How many trials.
    #[arg(long, default_value = "10", value_name = "NUMBER", value_parser = trials, allow_negative_numbers = true)]
    trials: u32,
    /// Every random draw derives from it.
    #[arg(long, default_value = "1", value_name = "NUMBER", value_parser = seed, allow_negative_numbers = true)]
    seed: u64,
    /// How many trials at the same time; default: the number of cores. 1 is reproducible bit for bit.
    #[arg(long, value_name = "NUMBER", value_parser = workers, allow_negative_numbers = true)]
    workers: Option<usize>,
    /// The SQLite file; made if it does not exist. An unfinished study of the same kind in it goes on.
    #[arg(long, env = "GAITWRIGHT_DATABASE", default_value = "gaitwright.db", value_name = "FILE")]
    database: PathBuf,
    /// Print one JSON object at the end instead of lines.
    #[arg(long)]
    json: bool,
}

impl Tune {
    pub(super) async fn run(self) -> Result<Ended, Error> {
        let subject = self.body.subject()?;
        let workers = cores_or(self.workers);
        let store = Store::open(&self.database).await?;
        let study = self.study(&store, subject, workers).await?;

        let engine = InProcess::new(workers, Arc::new(GaitSolver));
        let director = Director::new(store.clone(), Arc::new(engine), Some(study.id));
        let work = tokio::spawn({
            let director = director.clone();
            async move { director.run().await }
        });
        let ended = tokio::select! {
            ended = follow(&director, &study, self.json) => Some(ended),
            () = interrupted() => None,
        };
        director.stop();
        work.await.map_err(|e| Error::Internal(e.to_string()))??;
        let mut reader = store.read().await?;
        let study = studies::get(&mut reader, study.id).await?;
        let standing = Standing::read(&mut reader, study).await?;
        drop(reader);
        store.close().await;
        let interrupted = ended.is_none();
        if let Some(ended) = ended {
            ended?;
        }
        self.print(&summary::of(&standing).map_err(Error::Learner)?)?;
        if interrupted {
            let done = standing.trials.len() - standing.open();
            tell(&format!("interrupted after {done} of {} trials; the same command goes on from there", self.trials));
            return Ok(Ended::Interrupted);
        }
        Ok(Ended::Done)
    }

    /// The unfinished study of the same kind in the database, or a new one.
    async fn study(&self, store: &Store, body: gait_optimizer::Subject, workers: usize) -> Result<Study, Error> {
        let mut writer = store.write().await?;
        catalogue::ensure(&mut writer).await?;
        let subject = catalogue::subject_with(&mut writer, body).await?;
        let new = NewStudy {
            muscles: self.muscles.is_on(),
            trial_budget: self.trials,
            parallel_trials: u32::try_from(workers).unwrap_or(1),
            seed: self.seed,
            ..NewStudy::of(subject.id)
        };
        let wanted = plan::checked(&mut writer, new.clone()).await?;
        let unfinished =
            studies::active(&mut writer).await?.into_iter().find(|study| study.plan.tries_the_same_as(&wanted));
        let study = if let Some(study) = unfinished {
            let done = trial_rows::counts(&mut writer, study.id).await?;
            let ended = done.total - done.open;
            tell(&format!("going on with study {}: {ended} of {} trials", study.id, self.trials));
            study
        } else {
            plan::create(&mut writer, &Actor::terminal(), new).await?
        };
        commit(writer).await?;
        Ok(study)
    }

    fn print(&self, summary: &Summary) -> Result<(), Error> {
        if self.json {
            let text = serde_json::to_string_pretty(summary).map_err(|e| Error::Internal(e.to_string()))?;
            return data(&text);
        }
        match (summary.best_trial, summary.best_action, summary.best_gait_rmse_rad) {
            (Some(number), Some(action), Some(rmse)) => {
                data(&format!("best: trial {number} of {}", summary.trials.len()))?;
                data(&format!("  action            {}", action_line(&action)))?;
                data(&format!("  Gait RMSE         {rmse:.4} rad"))?;
                if let Some(cost) = summary.best_cost_of_transport {
                    data(&format!("  cost of transport {cost:.4}"))?;
                }
            }
            _ => data("no trial gave a gait")?,
        }
        tell(&format!("look at it: gaitwright serve --database {}", self.database.display()));
        Ok(())
    }
}

/// Shows progress until the study ends.
async fn follow(director: &Director, study: &Study, json: bool) -> Result<(), Error> {
    let bar = ProgressBar::new(u64::from(study.plan.trial_budget));
    let style = "{elapsed_precise} [{bar:30}] {pos}/{len} trials  {msg}";
    if let Ok(style) = ProgressStyle::with_template(style) {
        bar.set_style(style.progress_chars("=> "));
    }
    let mut pulse = director.pulse();
    let mut progress = director.board().listen();
    let mut shown = std::collections::HashSet::new();
    loop {
        let mut reader = director.store().read().await?;
        let present = studies::get(&mut reader, study.id).await?;
        let rows = trial_rows::of_study(&mut reader, study.id).await?;
        drop(reader);
        for trial in rows.iter().filter(|trial| !trial.state.is_open()) {
            if shown.insert(trial.id) {
                let line = trial_line(trial, &rows);
                bar.suspend(|| {
                    if json {
                        tell(&line);
                        return Ok(());
                    }
                    data(&line)
                })?;
            }
        }
        bar.set_position(shown.len() as u64);
        match present.state {
            StudyState::Running => {}
            StudyState::Finished => {
                bar.finish_and_clear();
                return Ok(());
            }
            // Nobody answers or starts anything here.
            StudyState::Draft | StudyState::Waiting | StudyState::Paused | StudyState::Stopped => {
                bar.finish_and_clear();
                return Err(Error::conflict(format!(
                    "the study is {}: {}",
                    present.state.as_str(),
                    present.state_reason
                )));
            }
        }
        loop {
            tokio::select! {
                changed = pulse.changed() => {
                    changed.map_err(|e| Error::Internal(e.to_string()))?;
                    break;
                }
                iteration = progress.recv() => if let Ok(p) = iteration {
                    bar.set_message(format!(
                        "trial {}: iteration {}, objective {:.4}, violation {:.1e}",
                        p.number, p.record.iteration, p.record.objective, p.record.constraint_violation
                    ));
                },
            }
        }
    }
}

fn trial_line(trial: &Trial, all: &[Trial]) -> String {
    let mut line = format!("{:>4}  {:<13}", trial.number, trial.state.as_str());
    // Writing to a String cannot fail.
    let _ = describe(&mut line, trial, all);
    line
}

fn describe(line: &mut String, trial: &Trial, all: &[Trial]) -> std::fmt::Result {
    if let (Some(rmse), Some(cost)) = (trial.gait_rmse_rad, trial.cost_of_transport) {
        write!(line, "  RMSE {rmse:.4} rad  cost {cost:.4}")?;
    }
    if let (Some(iterations), Some(seconds)) = (trial.iterations, trial.seconds_total) {
        write!(line, "  {iterations:>4} iterations {seconds:>6.1} s")?;
    }
    match summary::number_of(trial.warm_started_from, all) {
        Some(from) => write!(line, "  from {from:<4}")?,
        None => line.push_str("  cold     "),
    }
    write!(line, "  {}", action_line(&trial.action))?;
    if !trial.message.is_empty() {
        write!(line, "\n      {}", trial.message)?;
    }
    Ok(())
}

fn action_line(action: &TunedBounds) -> String {
    let parts: Vec<String> =
        TunedBounds::NAMES.iter().zip(action.to_array()).map(|(name, value)| format!("{name}={value}")).collect();
    parts.join(" ")
}
