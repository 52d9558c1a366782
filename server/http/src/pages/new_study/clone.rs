//! A clone of a study with changes: the form for a new study, filled in with the set-up of another one.

use super::fields::{KEPT_LEARNER, LEARNERS, NewStudyFields, learner};
use crate::accessible::Named;
use crate::bound_entries::BoundField;
use gait_optimizer::{LocalOptimumChoice, TunedBounds};
use gaitwright_service::access::Reach;
use gaitwright_service::error::Error;
use gaitwright_store::studies::{self, AtlasRole, Study, StudyPlan, WarmStartFrom};
use gaitwright_store::{Connection, consents};
use std::collections::BTreeMap;

impl NewStudyFields {
    /// The set-up of a study, for a clone that can be changed. A restricted study has restricted clones by default.
    pub(super) fn of_clone(study: &Study, restricted: bool) -> Self {
        let plan = &study.plan;
        let ticked = |yes: bool| yes.then(|| "on".to_owned());
        let known = LEARNERS.iter().find(|(name, ..)| learner(name).is_some_and(|known| known == plan.learner));
        Self {
            like: study.id.to_string(),
            name: String::new(),
            subject: plan.subject_id.to_string(),
            restricted: ticked(restricted),
            device: plan.device_id.to_string(),
            reference_gait: plan.reference_gait_id.to_string(),
            muscles: if plan.muscles { "on" } else { "off" }.to_owned(),
            answer_source: plan.answer_source.as_str().to_owned(),
            learner: known.map_or(KEPT_LEARNER, |(name, ..)| name).to_owned(),
            number_of_trials: plan.number_of_trials.to_string(),
            unchanged_limit: plan.unchanged_limit.map_or_else(String::new, |limit| limit.to_string()),
            parallel_trials: plan.parallel_trials.to_string(),
            seed: plan.seed.to_string(),
            repeat_results: ticked(plan.repeat_results),
            warm_start_from_root: ticked(plan.warm_start_from == WarmStartFrom::Root),
            use_atlas: ticked(plan.atlas == AtlasRole::Use),
            simulated_walks_effect: plan.simulated_walks.effect.as_str().to_owned(),
            number_of_simulated_walks: plan.simulated_walks.number_of_simulated_walks.to_string(),
            gait_rmse_tolerance_rad: plan.simulated_walks.gait_rmse_tolerance_rad.to_string(),
            least_mean_strides: plan.simulated_walks.least_mean_strides.to_string(),
            nearest_within_percent: match plan.solve_options.local_optimum_choice {
                LocalOptimumChoice::NearestToReference { within_percent } => within_percent.to_string(),
                LocalOptimumChoice::LowestObjective | LocalOptimumChoice::Numbered { .. } => String::new(),
            },
            local_optimum: match plan.solve_options.local_optimum_choice {
                LocalOptimumChoice::Numbered { number } => number.to_string(),
                LocalOptimumChoice::LowestObjective | LocalOptimumChoice::NearestToReference { .. } => String::new(),
            },
            initial_guesses: plan.solve_options.initial_guesses.to_string(),
            space: space_of(plan),
            ..Self::default()
        }
    }

    /// Relaxes bounds, written as `a5=0.03,a7=20`: a tuned bound keeps those of its values that are as loose.
    pub(super) fn relax(&mut self, relaxed: &str) -> Result<(), Error> {
        let all = TunedBounds::parse(relaxed)?.to_array();
        let named = |name: &str| relaxed.split(',').any(|item| item.split('=').next().map(str::trim) == Some(name));
        for (place, name) in TunedBounds::NAMES.into_iter().enumerate().filter(|(_, name)| named(name)) {
            let to = all[place];
            let as_loose = |value: &f64| if TunedBounds::IS_LOWER[place] { *value < to } else { *value > to };
            let values = self.space.get(&format!("values_{name}")).map_or("", String::as_str);
            let field = BoundField::of_values(name);
            let values = field.read_list(values).unwrap_or_default();
            let mut kept: Vec<f64> = values.into_iter().filter(as_loose).collect();
            kept.push(to);
            kept.sort_by(f64::total_cmp);
            self.space.insert(format!("fixed_{name}"), field.entry(to));
            if kept.len() < 2 {
                self.space.remove(&format!("tuned_{name}"));
            } else {
                self.space.insert(format!("values_{name}"), field.list(&kept));
            }
        }
        self.relaxed = true;
        Ok(())
    }
}

/// The study to clone, if the caller can access it and its subject has not withdrawn consent.
pub(super) async fn cloned(db: &mut Connection, reach: Reach, fields: &NewStudyFields) -> Result<Option<Study>, Error> {
    let Some(named) = fields.cloned()? else { return Ok(None) };
    let id = Named::from(named).accessible(db, reach).await?;
    consents::may_be_shown(db, id).await?;
    Ok(Some(studies::get(db, id).await?))
}

/// The entries of the editor for the search space of a study.
fn space_of(plan: &StudyPlan) -> BTreeMap<String, String> {
    let fixed = plan.base_bounds.to_array();
    let mut space = BTreeMap::new();
    for (place, name) in TunedBounds::NAMES.into_iter().enumerate() {
        let field = BoundField::of_values(name);
        space.insert(format!("fixed_{name}"), field.entry(fixed[place]));
        if let Some(dimension) = plan.search_space.dimensions().iter().find(|dimension| dimension.name == name) {
            space.insert(format!("tuned_{name}"), "on".to_owned());
            space.insert(format!("values_{name}"), field.list(&dimension.values));
            space.insert(format!("lengthscale_{name}"), BoundField::of_differences(name).entry(dimension.lengthscale));
        }
    }
    space
}
