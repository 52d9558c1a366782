//! Clones a study: a new one with the same set-up. For pages and REST.

use super::{atlas, study_name, study_plan};
use crate::access::Reach;
use crate::error::Error;
use gaitwright_store::audit::Actor;
use gaitwright_store::studies::{AnswerSource, AtlasRole, Study, WarmStartFrom};
use gaitwright_store::{StudyId, Writer, members, studies};
use serde::Deserialize;
use utoipa::ToSchema;

/// A new study with the set-up of another one. Absent fields are copied.
#[derive(Debug, Clone, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct StudyClone {
    /// Name shown to users, which must differ from the names of all studies that you can see. By default, it is the name
    /// of the parent with "(clone)" appended.
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
    /// Source of the answers.
    #[serde(default)]
    pub answer_source: Option<AnswerSource>,
    /// Role of the study with an atlas. `make` gives the study that makes the atlas of this problem, in which everything
    /// that does not affect gaits has its own values, and `use` one that takes its gaits from there. Both start every solve
    /// from one root gait and repeat no results.
    #[serde(default)]
    pub atlas: Option<AtlasRole>,
    /// Whether to start the study immediately.
    #[serde(default)]
    pub start: bool,
}

/// Creates a study with the set-up of another one, without its trials.
///
/// # Errors
/// [`Error::Invalid`] naming the field, [`Error::NotFound`].
pub async fn clone_study(
    writer: &mut Writer,
    actor: &Actor,
    reach: Reach,
    id: StudyId,
    clone: &StudyClone,
) -> Result<Study, Error> {
    let from = studies::get(writer, id).await?;
    let mut new = study_plan::NewStudy::like(&from.plan);
    match clone.atlas {
        None => {}
        Some(AtlasRole::None) => new.atlas = AtlasRole::None,
        Some(AtlasRole::Make) => new = atlas::atlas_of(new),
        Some(AtlasRole::Use) => {
            (new.atlas, new.warm_start_from, new.repeat_results) = (AtlasRole::Use, WarmStartFrom::Root, Some(false));
        }
    }
    new.name = Some(match &clone.name {
        Some(name) => name.clone(),
        None if clone.atlas == Some(AtlasRole::Make) => {
            study_name::free(writer, reach, &study_name::marked(&from.plan.name, " (atlas)")).await?
        }
        None => study_name::free(writer, reach, &study_name::marked(&from.plan.name, " (clone)")).await?,
    });
    new.seed = clone.seed.unwrap_or(new.seed);
    new.number_of_trials = clone.number_of_trials.unwrap_or(new.number_of_trials);
    new.muscles = clone.muscles.unwrap_or(new.muscles);
    new.answer_source = clone.answer_source.unwrap_or(new.answer_source);
    new.start = clone.start;
    let made = study_plan::create_from(writer, actor, reach, new, Some(id)).await?;
    // The set-up of a restricted study stays visible to its members only.
    members::inherit(writer, id, made.id, actor.as_str()).await?;
    Ok(made)
}
