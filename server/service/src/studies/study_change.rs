//! Changes a study: its name, tags, notes and limits, its number of trials, or a clone of it. For pages and REST.

use super::lifecycle::{self, StudyTransition};
use super::snapshot::has_changed;
use super::study_plan;
use crate::error::{Error, FieldError};
use crate::printable;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::studies::{AnswerSource, Study, StudyLimits, StudyState};
use gaitwright_store::{StudyId, Writer, events, members, now, studies};
use serde::Deserialize;
use serde_json::json;
use utoipa::ToSchema;

/// Changes to a study. Absent fields keep their values.
#[derive(Debug, Clone, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct StudyChange {
    /// Name shown to users.
    #[serde(default)]
    #[schema(min_length = 1, max_length = 120)]
    pub name: Option<String>,
    /// Priority, -10 to 10. Studies with a higher priority run first.
    #[serde(default)]
    #[schema(minimum = -10, maximum = 10)]
    pub priority: Option<i32>,
    /// Number of trials that run in parallel.
    #[serde(default)]
    #[schema(minimum = 1, maximum = 64)]
    pub parallel_trials: Option<u32>,
    /// Tags, at most 10 of at most 40 characters. They replace the present ones.
    #[serde(default)]
    #[schema(max_items = 10)]
    pub tags: Option<Vec<String>>,
    /// Free-text notes.
    #[serde(default)]
    #[schema(max_length = 4000)]
    pub notes: Option<String>,
    /// Whether the study is archived. Lists leave out archived studies unless they are asked for. A study can be
    /// archived before its start and after its end.
    #[serde(default)]
    pub archived: Option<bool>,
}

/// Largest number of tags of a study, and of characters of a tag.
const MOST_TAGS: usize = 10;
const LONGEST_TAG: usize = 40;
/// Maximum length of notes, characters.
const LONGEST_NOTES: usize = 4000;

/// Checks tags: trimmed, without repetitions, in alphabetical order.
///
/// # Errors
/// [`Error::Invalid`] naming the field.
pub(super) fn checked_tags(tags: &[String]) -> Result<Vec<String>, Error> {
    if tags.len() > MOST_TAGS {
        return Err(FieldError::described("tags", &format!("a list of {}", tags.len()), "a list of at most 10").into());
    }
    let mut checked = Vec::new();
    for tag in tags {
        let tag = printable::name("tags", tag, LONGEST_TAG)?;
        if tag.contains(',') {
            return Err(Error::invalid("tags", tag, "without commas, which separate tags"));
        }
        checked.push(tag.to_owned());
    }
    checked.sort();
    checked.dedup();
    Ok(checked)
}

/// Checks tags and notes of an imported study.
///
/// # Errors
/// [`Error::Invalid`] naming the field.
pub(super) fn check_filing(study: &Study) -> Result<(), Error> {
    checked_tags(&study.tags)?;
    printable::note("notes", &study.notes, LONGEST_NOTES)?;
    Ok(())
}

/// Applies changes to a study.
///
/// # Errors
/// [`Error::Invalid`] naming the field, [`Error::NotFound`].
pub async fn change(writer: &mut Writer, actor: &Actor, id: StudyId, change: &StudyChange) -> Result<Study, Error> {
    let study = studies::get(writer, id).await?;
    let name = match change.name.as_deref().map(str::trim) {
        None => study.plan.name.clone(),
        Some(name) => printable::name("name", name, study_plan::LONGEST_NAME)?.to_owned(),
    };
    let limits = StudyLimits {
        name,
        priority: change.priority.unwrap_or(study.plan.priority),
        parallel_trials: change.parallel_trials.unwrap_or(study.plan.parallel_trials),
        number_of_trials: study.plan.number_of_trials,
    };
    study_plan::check_range("priority", i64::from(limits.priority), -10, 10)?;
    study_plan::check_range("parallel_trials", i64::from(limits.parallel_trials), 1, 64)?;
    let tags = match &change.tags {
        None => study.tags.clone(),
        Some(tags) => checked_tags(tags)?,
    };
    let notes = match change.notes.as_deref().map(str::trim) {
        None => study.notes.as_str(),
        Some(notes) => {
            printable::note("notes", notes, LONGEST_NOTES)?;
            notes
        }
    };
    let archived_at = match change.archived {
        Some(true) if study.archived_at.is_none() => {
            if !study.state.has_ended() && study.state != StudyState::NotStarted {
                return Err(Error::conflict("A study that has not ended cannot be archived. Stop it first."));
            }
            Some(now())
        }
        Some(false) => None,
        _ => study.archived_at,
    };
    studies::set_limits(writer, id, &limits).await?;
    studies::set_filing(writer, id, &tags, notes, archived_at).await?;
    let detail = json!({
        "name": limits.name, "priority": limits.priority, "parallel_trials": limits.parallel_trials,
        "tags": tags, "notes": notes, "archived": archived_at.is_some(),
        "before": {
            "name": study.plan.name, "priority": study.plan.priority, "parallel_trials": study.plan.parallel_trials,
            "tags": study.tags, "notes": study.notes, "archived": study.archived_at.is_some(),
        },
    });
    changed(writer, actor, "study.change", &study, study.state, &detail).await
}

/// A larger number of trials.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct StudyExtension {
    /// Number of trials. Must exceed the current number.
    #[schema(minimum = 2, maximum = 10000)]
    pub number_of_trials: u32,
}

/// Raises the number of trials of a study. If the study has ended, it resumes.
///
/// # Errors
/// [`Error::Invalid`] if the number of trials would not increase, [`Error::NotFound`].
pub async fn extend(writer: &mut Writer, actor: &Actor, id: StudyId, more: &StudyExtension) -> Result<Study, Error> {
    let study = studies::get(writer, id).await?;
    let least = i64::from(study.plan.number_of_trials) + 1;
    study_plan::check_range("number_of_trials", i64::from(more.number_of_trials), least, 10_000)?;
    let state = match study.state {
        ended @ (StudyState::Finished | StudyState::Stopped) => lifecycle::after(ended, StudyTransition::Extend)?,
        other => other,
    };
    raise_number_of_trials(writer, &study, more.number_of_trials, state).await?;
    let detail = json!({ "from": study.plan.number_of_trials, "to": more.number_of_trials, "state": state });
    changed(writer, actor, "study.extend", &study, state, &detail).await
}

/// Sets the number of trials of a study, and the state in which it continues. The caller writes event and audit trail.
///
/// # Errors
/// [`Error::Invalid`] for too many trials, [`Error::Conflict`] if the study has changed; errors of the database.
pub(super) async fn raise_number_of_trials(
    writer: &mut Writer,
    study: &Study,
    number_of_trials: u32,
    state: StudyState,
) -> Result<(), Error> {
    study_plan::check_range("number_of_trials", i64::from(number_of_trials), 1, 10_000)?;
    let limits = StudyLimits {
        name: study.plan.name.clone(),
        priority: study.plan.priority,
        parallel_trials: study.plan.parallel_trials,
        number_of_trials,
    };
    studies::set_limits(writer, study.id, &limits).await?;
    if state != study.state && !studies::set_state(writer, study, state, "The study was extended.").await? {
        return Err(has_changed());
    }
    Ok(())
}

/// A new study with the set-up of another one. Absent fields are copied.
#[derive(Debug, Clone, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct StudyClone {
    /// Name shown to users.
    #[serde(default)]
    pub name: Option<String>,
    /// Seed for all random draws except allocations.
    #[serde(default)]
    pub seed: Option<u64>,
    /// Number of trials.
    #[serde(default)]
    pub number_of_trials: Option<u32>,
    /// Whether to solve with muscles.
    #[serde(default)]
    pub muscles: Option<bool>,
    /// Who answers comparisons.
    #[serde(default)]
    pub answer_source: Option<AnswerSource>,
    /// Whether to start the study immediately.
    #[serde(default)]
    pub start: bool,
}

/// Creates a study with the set-up of another one, without its trials.
///
/// # Errors
/// [`Error::Invalid`] naming the field, [`Error::NotFound`].
pub async fn clone_study(writer: &mut Writer, actor: &Actor, id: StudyId, clone: &StudyClone) -> Result<Study, Error> {
    let from = studies::get(writer, id).await?;
    let mut new = study_plan::NewStudy::like(&from.plan);
    new.name = Some(clone.name.clone().unwrap_or_else(|| clone_name(&from.plan.name)));
    new.seed = clone.seed.unwrap_or(new.seed);
    new.number_of_trials = clone.number_of_trials.unwrap_or(new.number_of_trials);
    new.muscles = clone.muscles.unwrap_or(new.muscles);
    new.answer_source = clone.answer_source.unwrap_or(new.answer_source);
    new.start = clone.start;
    let made = study_plan::create_from(writer, actor, new, Some(id)).await?;
    // The set-up of a restricted study stays visible to its members only.
    members::inherit(writer, id, made.id, actor.as_str()).await?;
    Ok(made)
}

/// The default name of a clone: that of the study, shortened if it would be too long.
fn clone_name(name: &str) -> String {
    const MARK: &str = " (clone)";
    let kept: String = name.chars().take(study_plan::LONGEST_NAME - MARK.len()).collect();
    format!("{}{MARK}", kept.trim_end())
}

async fn changed(
    writer: &mut Writer,
    actor: &Actor,
    action: &str,
    before: &Study,
    state: StudyState,
    detail: &serde_json::Value,
) -> Result<Study, Error> {
    events::append(writer, before.id, "study_changed", &json!({ "state": state, "reason": action })).await?;
    audit::append(writer, actor, action, &format!("study {}", before.id), detail).await?;
    Ok(studies::get(writer, before.id).await?)
}
