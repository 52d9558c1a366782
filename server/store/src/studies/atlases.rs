//! The atlas of a gait problem: the study that has the gait of every action.

use super::plan::StudyPlan;
use crate::{Connection, StoreResult, StudyId, json_columns};

/// The newest finished atlas of the problem and the search space of a study. Not an imported one, whose gaits were not solved
/// here, and not one of a subject who withdrew consent.
///
/// # Errors
/// Errors of the database.
pub async fn finished_atlas(db: &mut Connection, plan: &StudyPlan) -> StoreResult<Option<StudyId>> {
    let sql = "select id from studies where atlas = 'make' and state = 'finished' and device_id = ? and reference_gait_id = ? \
         and height_m = ? and body_mass_kg = ? and muscles = ? and gait_settings = ? and solve_options = ? \
         and base_bounds = ? and search_space = ? and id not in (select study_id from imports) \
         and subject_id not in (select subject_id from withdrawn_subjects) order by created_at desc, id desc limit 1";
    Ok(sqlx::query_scalar(sql)
        .bind(plan.device_id)
        .bind(plan.reference_gait_id)
        .bind(plan.body.height_m)
        .bind(plan.body.body_mass_kg)
        .bind(plan.muscles)
        .bind(json_columns::to_text("gait settings", &plan.gait_settings)?)
        .bind(json_columns::to_text("solve options", &plan.solve_options)?)
        .bind(json_columns::to_text("base bounds", &plan.base_bounds)?)
        .bind(json_columns::to_text("search space", &plan.search_space)?)
        .fetch_optional(db)
        .await?)
}
