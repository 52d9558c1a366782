//! Checks an imported archive: every value by the rules that apply when people enter it, and every derived figure by
//! computing it again.

mod answer_changes;
mod answers;
mod context;
mod trial_results;

use super::archive_file::refuse;
use crate::access::Reach;
use crate::error::Error;
use crate::printable;
use crate::studies::lab::EmgResult;
use crate::studies::{device, lab, reference_import, study_change, study_plan, subject};
use context::{Context, at, of_gaits};
use gaitwright_compute::Pool;
use gaitwright_store::archived_row::{Cell, Row};
use gaitwright_store::archived_rows::Definition;
use gaitwright_store::lab_sessions::LabSession;
use gaitwright_store::quarantine::Quarantine;
use gaitwright_store::studies::StudyFilter;
use gaitwright_store::trials::Trial;
use gaitwright_store::{
    Connection, Instant, StudyId, TrialId, archived_rows, devices, lab_sessions, measurement_files, now,
    reference_gaits, studies, subjects, trials,
};
use std::collections::{HashMap, HashSet};
use std::sync::Arc;
use uuid::Uuid;

/// Columns that the modules of their tables parse and check.
const READ_BY_NOUN: [&str; 13] = [
    "definition",
    "gait_settings",
    "solve_options",
    "base_bounds",
    "search_space",
    "learner",
    "simulated_walks",
    "action",
    "report",
    "violations",
    "reading",
    "document",
    "status",
];
/// Maximum length of any other text, characters. Longer than any note.
const MAX_TEXT: usize = 20_000;
/// Tolerance for the difference between the clocks of two machines, s.
const CLOCKS_DIFFER_S: i64 = 600;
/// Checks a row by itself: text is printable, times have passed, identifiers are well-formed.
pub(super) fn cells(table: &str, row: &Row) -> Result<(), Error> {
    for (column, cell) in row.cells() {
        let Cell::Text(text) = cell else { continue };
        let field = format!("{table}.{column}");
        if READ_BY_NOUN.contains(&column) {
            continue;
        }
        printable::note(&field, text, MAX_TEXT).map_err(refuse)?;
        if matches!(column, "author" | "rater") && printable::name(&field, text, 80).map_err(refuse)? != text {
            return Err(refuse(format!("{field} is {text:?}, which has leading or trailing spaces")));
        }
        if column == "id" || column.ends_with("_id") {
            let is_written_so = Uuid::parse_str(text).is_ok_and(|id| id.hyphenated().to_string() == *text);
            if !is_written_so {
                return Err(refuse(format!("{field} is {text:?}, which is not an identifier")));
            }
        } else if column.ends_with("_at") || column.ends_with("_until") {
            let at: Instant = text.parse().map_err(|_| refuse(format!("{field} is {text:?}, which is not a time")))?;
            if at > now().plus_seconds(CLOCKS_DIFFER_S) && column != "lease_until" {
                return Err(refuse(format!(
                    "{field} is {text}, which is in the future. Correct the clock of this machine, or import the archive after \
                     that time"
                )));
            }
        }
    }
    Ok(())
}

/// The result of the checks.
#[derive(Debug, Clone, Copy)]
pub(super) struct CheckedArchive {
    /// The study.
    pub(super) study: StudyId,
    /// Number of trials whose Gait RMSE could not be computed again.
    pub(super) unchecked_rmse: u32,
}

/// Checks everything in quarantine.
pub(super) async fn study(quarantine: &mut Quarantine, pool: &Pool) -> Result<CheckedArchive, Error> {
    if let Some(parent) = quarantine.cloned_from() {
        at("studies.cloned_from", parent.parse::<StudyId>().map_err(|_| format!("{parent:?} is not an identifier")))?;
    }
    let db = quarantine.db();
    let found = at("studies", studies::page(db, Reach::Every, &StudyFilter::newest(2)).await)?;
    let [study] = &found[..] else { return Err(refuse(format!("it has {} studies instead of one", found.len()))) };
    let study = study.clone();
    at(format!("study {}", study.id), study_plan::check_plan(&study.plan))?;
    at(format!("study {}", study.id), study_change::check_filing(&study))?;

    let subject = at("subject", subjects::get(db, study.plan.subject_id).await)?;
    if at("subjects", subjects::all(db).await)?.len() != 1 {
        return Err(refuse("it has subjects that do not belong to its study"));
    }
    at(
        format!("subject {}", subject.id),
        subject::check(&subject.pseudonym, subject.height_m, subject.body_mass_kg, &subject.notes),
    )?;
    let device = at("device", devices::get(db, study.plan.device_id).await)?.definition;
    at("device", device::check(&device))?;
    of_definition("devices", &device.name, &at("devices", archived_rows::definition(db, "devices").await)?)?;
    let reference = at("reference gait", reference_gaits::get(db, study.plan.reference_gait_id).await)?.definition;
    at("reference gait", reference_import::check(&reference))?;
    let written = at("reference_gaits", archived_rows::definition(db, "reference_gaits").await)?;
    of_definition("reference_gaits", &reference.name, &written)?;

    let id = study.id;
    let body = study.plan.body;
    let context = Arc::new(Context { study, body, device, reference });
    let trials = at("trials", trials::of_study(db, id).await)?;
    let mut unchecked_rmse = 0;
    let mut earlier = HashSet::new();
    for (place, trial) in trials.iter().enumerate() {
        let what = format!("trial {} ({})", trial.number, trial.id);
        if trial.number as usize != place + 1 {
            return Err(refuse(format!("{what} should have number {}", place + 1)));
        }
        for (column, other) in [("best_before", trial.best_before), ("warm_started_from", trial.warm_started_from)] {
            if other.is_some_and(|other| !earlier.contains(&other)) {
                return Err(refuse(format!("{what}: {column} is not an earlier trial")));
            }
        }
        earlier.insert(trial.id);
        at(&what, trial_results::values(trial, &context.study.plan))?;
        let has_gait = at(&what, trial_results::gait(db, pool, trial, &context).await)?;
        unchecked_rmse += u32::from(trial.gait_rmse_rad.is_some() && !has_gait);
        at(&what, trial_results::check_results(db, trial).await)?;
    }
    if let Some(number) = at("solve_jobs", archived_rows::trial_unlike_its_solve_job(db).await)? {
        return Err(refuse(format!("trial {number}: its state contradicts its job")));
    }
    let by_id: HashMap<TrialId, &Trial> = trials.iter().map(|trial| (trial.id, trial)).collect();
    let sessions = lab(db, pool, id, &by_id).await?;
    answers::answers(db, &context.study, &by_id, (subject.pseudonym.as_str(), &sessions[..])).await?;
    Ok(CheckedArchive { study: id, unchecked_rmse })
}

/// Checks a definition against its stored name and hash.
fn of_definition(table: &str, name: &str, written: &Definition) -> Result<(), Error> {
    if written.name != name || written.sha256 != gaitwright_store::sha256(written.text.as_bytes()) {
        return Err(refuse(format!("{table}: name, definition and hash do not match")));
    }
    Ok(())
}

/// Checks lab sessions and their measurement files.
async fn lab(
    db: &mut Connection,
    pool: &Pool,
    study: StudyId,
    trials: &HashMap<TrialId, &Trial>,
) -> Result<Vec<LabSession>, Error> {
    let sessions = at("lab_sessions", lab_sessions::of_study(db, study).await)?;
    for session in &sessions {
        at(format!("lab session {}", session.id), of_gaits(trials, [session.trial_a, session.trial_b]))?;
        for found in at("measurement_files", measurement_files::of_session(db, session.id).await)? {
            at(format!("measurement file {}", found.id), lab::check_kept(db, pool, &found).await)?;
        }
        let results = measurement_files::results::<EmgResult>(db, session.id).await;
        at(format!("EMG results of lab session {}", session.id), results)?;
    }
    Ok(sessions)
}
