//! Changes a study: its name, tags, notes and limits. For pages and REST.

use super::tags::checked_tags;
use super::{study_name, study_plan};
use crate::access::Reach;
use crate::error::Error;
use crate::printable;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::studies::{Study, StudyLimits, StudyState};
use gaitwright_store::{Connection, Instant, StudyId, Writer, events, now, studies};
use serde::Deserialize;
use serde_json::json;
use utoipa::ToSchema;

/// Changes to a study. Absent fields keep their values.
#[derive(Debug, Clone, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct StudyChange {
    /// Name shown to users, which must differ from the names of all other studies that you can see.
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

/// Maximum length of notes, characters.
const MAX_NOTES: usize = 4000;

/// Checks tags and notes of an imported study.
///
/// # Errors
/// [`Error::Invalid`] naming the field.
pub(super) fn check_filing(study: &Study) -> Result<(), Error> {
    checked_tags(&study.tags)?;
    printable::note("notes", &study.notes, MAX_NOTES)?;
    Ok(())
}

/// A study before and after a change.
struct ChangedStudy {
    before: Study,
    limits: StudyLimits,
    tags: Vec<String>,
    notes: String,
    archived_at: Option<Instant>,
}

/// Checks changes to a study as [`change`] does, without writing.
///
/// # Errors
/// As [`change`].
pub async fn check(db: &mut Connection, reach: Reach, id: StudyId, change: &StudyChange) -> Result<(), Error> {
    checked(db, reach, id, change).await.map(drop)
}

async fn checked(db: &mut Connection, reach: Reach, id: StudyId, change: &StudyChange) -> Result<ChangedStudy, Error> {
    let study = studies::get(db, id).await?;
    let name = match change.name.as_deref().map(str::trim) {
        Some(name) if name != study.plan.name => study_name::checked(db, reach, name, Some(id)).await?,
        _ => study.plan.name.clone(),
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
        None => study.notes.clone(),
        Some(notes) => {
            printable::note("notes", notes, MAX_NOTES)?;
            notes.to_owned()
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
    Ok(ChangedStudy { before: study, limits, tags, notes, archived_at })
}

/// Applies changes to a study. `reach` has the studies whose names are taken.
///
/// # Errors
/// [`Error::Invalid`] naming the field, [`Error::NotFound`].
pub async fn change(
    writer: &mut Writer,
    actor: &Actor,
    reach: Reach,
    id: StudyId,
    change: &StudyChange,
) -> Result<Study, Error> {
    let ChangedStudy { before: study, limits, tags, notes, archived_at } = checked(writer, reach, id, change).await?;
    studies::set_limits(writer, id, &limits).await?;
    studies::set_filing(writer, id, &tags, &notes, archived_at).await?;
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

/// Writes the event and the entry of the audit trail of a change.
pub(super) async fn changed(
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
