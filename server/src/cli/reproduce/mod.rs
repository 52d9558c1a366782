//! `gaitwright reproduce`: repeats the paper's comparison of gaits with and without muscles, unattended.

mod report_page;
mod statements;
mod variants;

use super::command_end::{self, CommandEnd};
use super::flag_numbers::{seed, trials, whole};
use super::out_file::OutFile;
use super::output::{data, tell};
use super::problem_files::reference_of;
use super::resumed_study;
use super::unattended_study::{self, Lines};
use clap::{Args, ValueEnum};
use gait_optimizer::{ReferenceGait, Subject};
use gaitwright_compute::OnPool;
use gaitwright_service::access::Reach;
use gaitwright_service::error::Error;
use gaitwright_service::studies::analysis::Analyses;
use gaitwright_service::studies::built_in_entries;
use gaitwright_service::studies::certified_best::BestCertification;
use gaitwright_service::studies::history;
use gaitwright_service::studies::recommended_trial::best_trial;
use gaitwright_service::studies::snapshot::StudySnapshot;
use gaitwright_service::studies::study_plan::{self, NewStudy};
use gaitwright_store::studies::{self, Study, StudyFilter, StudyState};
use gaitwright_store::{Store, commit, gaits, reference_gaits};
use std::path::PathBuf;
use std::sync::Arc;
use variants::ReproducedStudy;

/// Subjects from the paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Subjects {
    /// Female, 1.727 m, 65.7 kg.
    #[value(name = "1")]
    First,
    /// Male, 1.803 m, 75 kg.
    #[value(name = "2")]
    Second,
    /// Both subjects.
    Both,
}

impl Subjects {
    fn numbers(self) -> &'static [u32] {
        match self {
            Self::First => &[1],
            Self::Second => &[2],
            Self::Both => &[1, 2],
        }
    }
}

fn seeds(text: &str) -> Result<u64, String> {
    whole(text, 1, 100)
}

#[derive(Debug, Args)]
pub(super) struct ReproduceCommand {
    /// Subjects from the paper.
    #[arg(long, value_enum, default_value = "both")]
    subject: Subjects,
    /// Number of trials in each study.
    #[arg(long, default_value = "30", value_name = "NUMBER", value_parser = trials, allow_negative_numbers = true)]
    trials: u32,
    /// First seed. The two studies of a comparison, with and without muscles, use the same seed.
    #[arg(long, default_value = "1", value_name = "NUMBER", value_parser = seed, allow_negative_numbers = true)]
    seed: u64,
    /// Number of consecutive seeds. Several are needed, because local optima can tip the comparison either way.
    #[arg(long, default_value = "3", value_name = "NUMBER", value_parser = seeds, allow_negative_numbers = true)]
    seeds: u64,
    /// Reference gait: a name or file, as for `solve --reference` (default: falisse-2019).
    #[arg(long, value_name = "NAME or FILE")]
    reference: Option<PathBuf>,
    /// Folder for the database, the report and the tables. Finished studies in it are not repeated.
    #[arg(long, default_value = "reproduction", value_name = "FOLDER")]
    folder: PathBuf,
}

impl ReproduceCommand {
    /// Runs two studies for each subject and seed, one trial at a time, so that results are reproducible bit for bit.
    pub(super) async fn run(self) -> Result<CommandEnd, Error> {
        let reference = reference_of(self.reference.as_deref())?;
        let cannot = |e: std::io::Error| Error::Malformed(format!("Cannot create {}: {e}.", self.folder.display()));
        std::fs::create_dir_all(&self.folder).map_err(cannot)?;
        let files = ["report.html", "iterations.csv", "studies.csv", "angles.csv"];
        let files: Vec<OutFile> =
            files.iter().map(|name| OutFile::open(&self.folder.join(name), &[])).collect::<Result<_, _>>()?;
        let mut store = Store::open(&self.folder.join("studies.db")).await?;
        let outcomes = Box::pin(self.studies(&mut store, &reference)).await;
        store.close().await;
        let Some((outcomes, failures)) = outcomes? else {
            tell("interrupted; run the same command again to continue");
            return Ok(CommandEnd::Interrupted);
        };
        let texts = [
            report_page::html(&outcomes, self.trials)?,
            variants::iterations_csv(&outcomes),
            variants::studies_csv(&outcomes),
            variants::angles_csv(&outcomes),
        ];
        for (file, text) in files.into_iter().zip(texts) {
            file.write(&text)?;
        }
        for comparison in variants::pair_comparisons(&outcomes) {
            data(&comparison.sentence())?;
        }
        data(&variants::conclusion(&variants::pair_comparisons(&outcomes)))?;
        tell(&format!("report: {}", self.folder.join("report.html").display()));
        for failure in &failures {
            tell(&format!("gaitwright: {failure}"));
        }
        Ok(if failures.is_empty() { CommandEnd::Done } else { CommandEnd::Failed })
    }

    /// Runs every study in order. Returns the results and the engineering failures, or `None` if a person stopped the
    /// command.
    async fn studies(
        &self,
        store: &mut Store,
        reference: &ReferenceGait,
    ) -> Result<Option<(Vec<ReproducedStudy>, Vec<String>)>, Error> {
        let (mut outcomes, mut failures) = (Vec::new(), Vec::new());
        for seed in self.seed..self.seed + self.seeds {
            for &subject in self.subject.numbers() {
                for muscles in [false, true] {
                    let words = if muscles { "with" } else { "without" };
                    let title = format!("subject {subject}, {words} muscles, seed {seed}");
                    tell(&title);
                    let (study, finished) = Box::pin(self.study(store, subject, muscles, seed, reference)).await?;
                    let (snapshot, analyses) = if finished {
                        (StudySnapshot::read(&mut *store.read().await?, study).await?, Arc::default())
                    } else {
                        let ran = unattended_study::run(store, &study, 1, Lines::Progress).await?;
                        if ran.interrupted {
                            return Ok(None);
                        }
                        if ran.snapshot.study.state != StudyState::Finished {
                            let why = command_end::without_result(&ran.snapshot).unwrap_or_default();
                            let why = why.trim_end_matches('.');
                            return Err(Error::Internal(format!("{title}: {why}. The comparison was stopped.")));
                        }
                        (ran.snapshot, ran.analyses)
                    };
                    failures
                        .extend(command_end::without_result(&snapshot).map(|failure| format!("{title}: {failure}")));
                    let certification = unattended_study::certified(store, &snapshot, &analyses).await?;
                    outcomes.push(
                        outcome(store, subject, muscles, seed, &snapshot, &analyses, certification, reference).await?,
                    );
                }
            }
        }
        Ok(Some((outcomes, failures)))
    }

    /// The study in the folder, and whether it is finished.
    async fn study(
        &self,
        store: &Store,
        subject: u32,
        muscles: bool,
        seed: u64,
        reference: &ReferenceGait,
    ) -> Result<(Study, bool), Error> {
        let mut writer = store.write().await?;
        built_in_entries::ensure(&mut writer).await?;
        let reference = reference_gaits::ensure(&mut writer, reference).await?.0.id;
        let person = built_in_entries::subject_with(&mut writer, Subject::builtin(subject)?).await?;
        let new = NewStudy {
            muscles,
            number_of_trials: self.trials,
            seed,
            parallel_trials: 1,
            repeat_results: Some(true),
            reference_gait_id: Some(reference),
            ..NewStudy::of(person.id)
        };
        let wanted = study_plan::checked(&mut writer, Reach::Every, new.clone()).await?;
        // A folder has at most two subjects, two variants and a hundred seeds.
        let known = studies::page(&mut writer, Reach::Every, &StudyFilter::newest(1000)).await?;
        commit(writer).await?;
        let same = known
            .into_iter()
            .find(|study| study.state == StudyState::Finished && study.plan.has_same_trials_as(&wanted));
        match same {
            Some(study) => Ok((study, true)),
            None => Ok((Box::pin(resumed_study::resumed_or_new(store, new)).await?, false)),
        }
    }
}

/// The results of a study.
#[allow(clippy::too_many_arguments)] // what is compared, and where from
async fn outcome(
    store: &mut Store,
    subject: u32,
    muscles: bool,
    seed: u64,
    snapshot: &StudySnapshot,
    analyses: &Arc<Analyses>,
    certification: BestCertification,
    reference: &ReferenceGait,
) -> Result<ReproducedStudy, Error> {
    let (there, analyses) = (snapshot.clone(), Arc::clone(analyses));
    let choose = move |pool: &OnPool| best_trial(&there, &*analyses.posterior(pool, &there)?);
    let best = store.compute(choose).await?.map_err(Error::Learner)?;
    let milestones = history::of(snapshot, best);
    let best = best.and_then(|id| snapshot.trial(id));
    let gait = match best {
        Some(trial) => {
            let gait = gaits::get(&mut *store.read().await?, trial.id).await?;
            Some(store.compute(move |pool| gait.unpack(pool)).await??)
        }
        None => None,
    };
    Ok(ReproducedStudy {
        subject,
        muscles,
        seed,
        trials: snapshot.trials.len(),
        converged: snapshot.trials.iter().filter(|trial| trial.gait_rmse_rad.is_some()).count(),
        // `sum` of nothing is -0.0.
        solve_seconds: snapshot.trials.iter().filter_map(|trial| trial.seconds_total).fold(0.0, |all, own| all + own),
        wall_seconds: wall_seconds(snapshot),
        by_iteration: variants::by_iteration(&milestones, history::results(snapshot).len()),
        best_trial: best.map(|trial| trial.number),
        best_rmse_rad: best.and_then(|trial| trial.gait_rmse_rad),
        best_cost_of_transport: best.and_then(|trial| trial.cost_of_transport),
        certificate: certification.certificate,
        failures: certification.failures,
        passing: certification.passing.and_then(|id| snapshot.trial(id)).map(|t| (t.number, t.gait_rmse_rad)),
        best_bounds: best.map(|trial| unattended_study::action_line(&trial.action)),
        gait,
        reference: reference.clone(),
    })
}

/// Time from the start of the first trial to the end of the last one.
fn wall_seconds(snapshot: &StudySnapshot) -> f64 {
    let begun = snapshot.trials.iter().filter_map(|trial| trial.started_at).min();
    let ended = snapshot.trials.iter().filter_map(|trial| trial.finished_at).max();
    begun.zip(ended).map_or(0.0, |(begun, ended)| ended.seconds_since(begun))
}
