//! `gaitwright tune`: runs an unattended study.

use super::atlas_study;
use super::command_end::{self, CommandEnd};
use super::cores::cores_or;
use super::flag_choices::{WARM_STARTS, one_of};
use super::flag_numbers::{seed, trials, workers};
use super::multi_start_flags::MultiStartFlags;
use super::output::{data, tell};
use super::problem_files::ProblemFiles;
use super::resumed_study;
use super::settings::{AnchoredFlags, Settings};
use super::simulated_walks_flags::SimulatedWalksFlags;
use super::subject_flags::{SubjectFlags, Switch};
use super::unattended_study::{self, Lines, Run, action_line};
use clap::Args;
use gaitwright_compute::OnPool;
use gaitwright_service::error::Error;
use gaitwright_service::studies::certified_best::{BestCertification, CertificateState};
use gaitwright_service::studies::execution;
use gaitwright_service::studies::recommended_trial::best_trial;
use gaitwright_service::studies::study_plan::NewStudy;
use gaitwright_service::studies::summary::{self, SimulatedWalksSummary, Summary};
use gaitwright_service::studies::{built_in_entries, device, reference_import};
use gaitwright_store::audit::Actor;
use gaitwright_store::studies::{AtlasRole, WarmStartFrom};
use gaitwright_store::{Store, commit};
use std::sync::Arc;

#[derive(Debug, Args)]
pub(super) struct TuneCommand {
    #[command(flatten)]
    body: SubjectFlags,
    /// Whether to solve with muscles.
    #[arg(long, value_enum, default_value = "on")]
    muscles: Switch,
    #[command(flatten)]
    files: ProblemFiles,
    #[command(flatten)]
    multi_start: MultiStartFlags,
    /// Number of trials.
    #[arg(long, default_value = "15", value_name = "NUMBER", value_parser = trials, allow_negative_numbers = true)]
    trials: u32,
    /// Seed for all random draws.
    #[arg(long, default_value = "1", value_name = "NUMBER", value_parser = seed, allow_negative_numbers = true)]
    seed: u64,
    /// Number of trials that run in parallel (default: number of cores). A study is reproducible bit for bit only with
    /// 1.
    #[arg(long, value_name = "NUMBER", value_parser = workers, allow_negative_numbers = true)]
    workers: Option<usize>,
    /// Also try actions whose gait is known from another trial, as the paper does.
    #[arg(long)]
    repeat_results: bool,
    /// The gait from which trials are warm-started (default: incumbent).
    #[arg(long, default_value_if("atlas", "true", "root"), default_value = "incumbent", hide_default_value = true, value_parser = one_of::<WarmStartFrom>(WARM_STARTS))]
    warm_start_from: WarmStartFrom,
    /// Take every gait from an atlas of the problem, which the record keeps: the first run makes it, with all workers; later
    /// studies of the same problem take their gaits at once. Needs the root gait as warm start, which is then the default.
    #[arg(long, conflicts_with = "repeat_results")]
    atlas: bool,
    #[command(flatten)]
    simulated_walks: SimulatedWalksFlags,
    #[command(flatten)]
    pub(super) record: AnchoredFlags,
    /// Print one JSON object at the end, and one line for each trial to stderr.
    #[arg(long)]
    json: bool,
}

impl TuneCommand {
    pub(super) async fn run(self, settings: &Settings) -> Result<CommandEnd, Error> {
        let subject = self.body.subject()?;
        let (device, reference, gait_settings) =
            (self.files.device()?, self.files.reference()?, self.files.settings()?);
        let solve_options = self.multi_start.applied_to(self.files.options()?)?;
        let workers = cores_or(self.workers);
        let mut store = settings.open_record().await?;
        let mut writer = store.write().await?;
        built_in_entries::ensure(&mut writer).await?;
        let subject = built_in_entries::subject_with(&mut writer, subject).await?;
        let (device, _) = device::add(&mut writer, &Actor::terminal(), &device).await?;
        let (reference, _) = reference_import::add(&mut writer, &Actor::terminal(), &reference).await?;
        commit(writer).await?;
        let new = NewStudy {
            device_id: Some(device.id),
            reference_gait_id: Some(reference.id),
            gait_settings: Box::new(gait_settings),
            solve_options,
            muscles: self.muscles.is_on(),
            number_of_trials: self.trials,
            parallel_trials: u32::try_from(workers).unwrap_or(1),
            seed: self.seed,
            repeat_results: Some(self.repeat_results),
            warm_start_from: self.warm_start_from,
            atlas: if self.atlas { AtlasRole::Use } else { AtlasRole::None },
            simulated_walks: self.simulated_walks.setting(),
            ..NewStudy::of(subject.id)
        };
        if self.atlas && Box::pin(atlas_study::complete(&store, new.clone(), workers)).await?.is_none() {
            store.close().await;
            return Ok(CommandEnd::Interrupted);
        }
        let study = Box::pin(resumed_study::resumed_or_new(&store, new)).await?;
        let lines = if self.json { Lines::Progress } else { Lines::Data };
        let ran = Box::pin(unattended_study::run_and_certify(&mut store, &study, workers, lines)).await;
        let found = match ran {
            Ok((ran, certification)) => Box::pin(findings(&mut store, ran, certification)).await,
            Err(error) => Err(error),
        };
        store.close().await;
        let (ran, summary) = found?;
        self.print(&summary)?;
        if !self.json {
            tell(&format!("to view the study: gaitwright serve --database {}", settings.database().display()));
        }
        if ran.interrupted {
            let done = ran.snapshot.trials.len() - ran.snapshot.open();
            tell(&format!(
                "interrupted after {done} of {} trials; run the same command again to continue",
                self.trials
            ));
            return Ok(CommandEnd::Interrupted);
        }
        match command_end::without_result(&ran.snapshot) {
            None => Ok(CommandEnd::Done),
            Some(failure) => {
                tell(&format!("gaitwright: {failure}"));
                Ok(CommandEnd::Failed)
            }
        }
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
                if let Some(walks) = &summary.best_simulated_walks {
                    data(&format!("  simulated walks   {}", walks_line(walks)))?;
                }
                certificate_lines(summary).iter().try_for_each(|line| data(line))?;
            }
            _ => data("no trial found a gait")?,
        }
        if !summary.never_active.is_empty() {
            data(&format!("bounds that were not active in any gait: {}", summary.never_active.join(", ")))?;
        }
        Ok(())
    }
}

/// The summary of a study after its run.
async fn findings(store: &mut Store, ran: Run, certification: BestCertification) -> Result<(Run, Summary), Error> {
    let (snapshot, analyses) = (ran.snapshot.clone(), Arc::clone(&ran.analyses));
    let choose = move |pool: &OnPool| best_trial(&snapshot, &*analyses.posterior(pool, &snapshot)?);
    let best = store.compute(choose).await?.map_err(Error::Learner)?;
    let report = match best {
        Some(best) => execution::newest(&mut *store.read().await?, best).await?,
        None => None,
    };
    let summary = summary::of(&ran.snapshot, best, certification, report.map(|kept| kept.reported.report).as_ref());
    Ok((ran, summary))
}

fn walks_line(walks: &SimulatedWalksSummary) -> String {
    let SimulatedWalksSummary { completed, number_of_simulated_walks, mean_strides, .. } = walks;
    format!("{completed} of {number_of_simulated_walks} complete, {mean_strides:.2} strides on average")
}

/// The certificate of the best gait, and the alternative if it failed.
fn certificate_lines(summary: &Summary) -> Vec<String> {
    let mut lines = vec![format!("  certificate       {}", summary.best_certificate.as_str().replace('_', " "))];
    lines.extend(summary.best_failures.iter().map(|failure| format!("    {failure}")));
    if summary.best_certificate != CertificateState::Failed {
        return lines;
    }
    match &summary.passing {
        Some(trial) => {
            let rmse = trial.gait_rmse_rad.map_or_else(String::new, |rmse| format!(": Gait RMSE {rmse:.4} rad"));
            lines.push(format!("best gait that passed certification: trial {}{rmse}", trial.number));
            lines.push(format!("  action            {}", action_line(&trial.action)));
        }
        None => lines.push("none of the gaits that were checked passed certification".to_owned()),
    }
    lines.push("a finer mesh often gives a gait that passes: gaitwright solve --mesh 8,8,12,12 --certify".to_owned());
    lines
}
