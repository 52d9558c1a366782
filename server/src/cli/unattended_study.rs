//! Runs an unattended study from the command line: finds or creates it, shows progress, certifies its best gait.

use super::interruption::interrupted;
use super::output::{data, tell};
use gait_optimizer::TunedBounds;
use gaitwright_service::error::Error;
use gaitwright_service::studies::analysis::Analyses;
use gaitwright_service::studies::atlas;
use gaitwright_service::studies::certified_best::{self, BestCertification};
use gaitwright_service::studies::requested_reports;
use gaitwright_service::studies::scheduler::Scheduler;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_service::studies::summary;
use gaitwright_service::workers::{GaitSolver, InProcess};
use gaitwright_store::audit::Actor;
use gaitwright_store::studies::{Study, StudyPlan, StudyState};
use gaitwright_store::trials::Trial;
use gaitwright_store::{Store, studies, trials as trial_rows};
use indicatif::{ProgressBar, ProgressStyle};
use std::fmt::Write;
use std::sync::Arc;

/// Where to print a line for each trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Lines {
    /// To stdout, as the result.
    Data,
    /// To stderr, as progress.
    Progress,
    /// Nowhere: only the bar is shown, over the actions of an atlas.
    Atlas,
}

/// A study after its run.
#[derive(Debug)]
pub(super) struct Run {
    /// Its snapshot.
    pub(super) snapshot: StudySnapshot,
    /// Whether a person stopped it.
    pub(super) interrupted: bool,
    /// The cached posteriors.
    pub(super) analyses: Arc<Analyses>,
}

/// Runs a study until it ends or a person stops it.
pub(super) async fn run(store: &Store, study: &Study, workers: usize, lines: Lines) -> Result<Run, Error> {
    let engine = InProcess::new(workers, Arc::new(GaitSolver));
    let scheduler = Scheduler::new(store, Arc::new(engine), Some(study.id), None);
    let work = tokio::spawn({
        let scheduler = scheduler.clone();
        async move { Box::pin(scheduler.run()).await }
    });
    let ended = tokio::select! {
        ended = follow(&scheduler, study, lines) => Some(ended),
        () = interrupted() => None,
    };
    scheduler.stop();
    work.await.map_err(|e| Error::Internal(e.to_string()))??;
    let mut reader = store.read().await?;
    let study = studies::get(&mut reader, study.id).await?;
    let snapshot = StudySnapshot::read(&mut reader, study).await?;
    let interrupted = ended.is_none();
    if let Some(ended) = ended {
        ended?;
    }
    Ok(Run { snapshot, interrupted, analyses: Arc::clone(scheduler.analyses()) })
}

/// Runs a study and certifies its best gaits, unless a person stops it.
pub(super) async fn run_and_certify(
    store: &mut Store,
    study: &Study,
    workers: usize,
    lines: Lines,
) -> Result<(Run, BestCertification), Error> {
    let ran = run(store, study, workers, lines).await?;
    if ran.interrupted {
        return Ok((ran, BestCertification::default()));
    }
    let certification = certified(store, &ran.snapshot, &ran.analyses).await?;
    // The requests stay on record, so a service makes the reports that this command does not.
    let requested = requested_reports::carry_out(store, study.id, workers, |number| {
        tell(&format!("simulating walks with the gait of trial {number}"));
    });
    tokio::select! {
        done = requested => done?,
        () = interrupted() => {}
    }
    Ok((ran, certification))
}

/// Certifies the best gaits of a study.
pub(super) async fn certified(
    store: &mut Store,
    snapshot: &StudySnapshot,
    analyses: &Arc<Analyses>,
) -> Result<BestCertification, Error> {
    tell("certifying the best gait");
    certified_best::certify(store, &Actor::terminal(), snapshot.clone(), Arc::clone(analyses)).await
}

/// Shows progress until the study ends.
async fn follow(scheduler: &Scheduler, study: &Study, lines: Lines) -> Result<(), Error> {
    let bar = ProgressBar::new(u64::from(study.plan.number_of_trials));
    let style = match lines {
        Lines::Atlas => "{elapsed_precise} [{bar:30}] atlas: {pos} of {len} actions have a result  {msg}",
        Lines::Data | Lines::Progress => "{elapsed_precise} [{bar:30}] {pos}/{len} trials  {msg}",
    };
    if let Ok(style) = ProgressStyle::with_template(style) {
        bar.set_style(style.progress_chars("=> "));
    }
    let mut pulse = scheduler.pulse();
    let mut progress = scheduler.running_solves().listen();
    let mut shown = std::collections::HashSet::new();
    loop {
        let mut reader = scheduler.store().read().await?;
        let present = studies::get(&mut reader, study.id).await?;
        let rows = trial_rows::of_study(&mut reader, study.id).await?;
        drop(reader);
        for trial in rows.iter().filter(|trial| !trial.state.is_open()) {
            if shown.insert(trial.id) {
                let line = trial_line(trial, &rows);
                bar.suspend(|| match lines {
                    Lines::Data => data(&line),
                    Lines::Progress => {
                        tell(&line);
                        Ok(())
                    }
                    Lines::Atlas => Ok(()),
                })?;
            }
        }
        if lines == Lines::Atlas {
            show_atlas(&bar, scheduler.store(), present.plan.clone(), rows).await?;
        } else {
            bar.set_position(shown.len() as u64);
        }
        // No person can answer or resume here.
        if present.state != StudyState::Running {
            bar.finish_and_clear();
            return Ok(());
        }
        loop {
            tokio::select! {
                changed = pulse.changed() => {
                    changed.map_err(|e| Error::Internal(e.to_string()))?;
                    break;
                }
                iteration = progress.recv() => if let (Ok(p), true) = (iteration, lines != Lines::Atlas) {
                    bar.set_message(format!(
                        "trial {}: iteration {}, objective {:.4}, violation {:.1e}",
                        p.number, p.record.iteration, p.record.objective, p.record.constraint_violation
                    ));
                },
            }
        }
    }
}

/// Shows how far an atlas is.
async fn show_atlas(bar: &ProgressBar, store: &Store, plan: StudyPlan, trials: Vec<Trial>) -> Result<(), Error> {
    let mut store = store.clone();
    let progress = store.compute(move |pool| atlas::progress(pool, &plan, &trials)).await?;
    bar.set_length(progress.actions);
    bar.set_position(progress.with_result);
    bar.set_message(format!("{} gaits, about {} solves left", progress.gaits, progress.solves_left));
    Ok(())
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
    if let Some(strides) = trial.mean_strides {
        write!(line, "  {strides:>5.2} strides")?;
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

/// An action in the format of `--bounds`.
pub(super) fn action_line(action: &TunedBounds) -> String {
    let parts: Vec<String> =
        TunedBounds::NAMES.iter().zip(action.to_array()).map(|(name, value)| format!("{name}={value}")).collect();
    parts.join(" ")
}
