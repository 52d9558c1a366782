//! Reads stored documents of earlier versions: brings former names, which records and archives keep, to those of today.

use super::{StoreError, StoreResult, json_columns};
use gait_learner::LearnerSettings;
use gait_optimizer::explanation::Explanation;
use gait_optimizer::{GaitSettings, IterationRecord, SolveOptions, SolveReport};
use serde::de::DeserializeOwned;
use serde_json::Value;

/// Solver settings of earlier versions whose value is now part of the method.
const FORMER_SOLVER_SETTINGS: [&str; 23] = [
    "dual_tolerance",
    "divergence_limit",
    "mu_warm",
    "kappa_epsilon",
    "kappa_mu",
    "theta_mu",
    "tau_min",
    "bound_fraction",
    "warm_bound_fraction",
    "warm_multiplier_push",
    "multiplier_limit",
    "hessian_regularisation_min",
    "hessian_regularisation_max",
    "dual_regularisation",
    "dual_regularisation_value",
    "residual_target",
    "residual_limit",
    "max_refinements",
    "watchdog_trigger",
    "watchdog_trials",
    "max_soft_steps",
    "elastic_weight",
    "max_restoration_phases",
];

/// Learner settings of earlier versions, each with the test for a value without effect.
const FORMER_LEARNER_SETTINGS: [(&str, fn(&Value) -> bool); 6] = [
    ("additive_share", |value| value.as_f64() == Some(0.0)),
    ("pairwise_share", |value| value.as_f64() == Some(0.0)),
    ("feasibility_additive_share", |value| value.as_f64() == Some(0.0)),
    // The lengthscale of the parts with these shares.
    ("broad_lengthscale", Value::is_number),
    ("feasibility_lengthscale_factor", |value| value.as_f64() == Some(1.0)),
    ("learn_every", Value::is_null),
];

/// Settings of the learner of a study. Settings that the learner no longer has are skipped if they had no effect.
///
/// # Errors
/// [`StoreError::FormerSetting`] if they had one; [`StoreError::Damaged`].
pub(super) fn learner_settings(study: &str, text: &str) -> StoreResult<LearnerSettings> {
    let mut document: Value = json_columns::from_text("learner", text)?;
    if let Some(settings) = document.as_object_mut() {
        for (setting, has_no_effect) in FORMER_LEARNER_SETTINGS {
            let Some(value) = settings.remove(setting) else { continue };
            if !has_no_effect(&value) {
                let (study, value) = (study.to_owned(), value.to_string());
                return Err(StoreError::FormerSetting { study, setting, value });
            }
        }
    }
    parsed("learner", document)
}

/// Options of solves, without settings that the solver no longer has.
pub(super) fn solve_options(text: &str) -> StoreResult<SolveOptions> {
    read("solve_options", text, |options| {
        rename(options, "cold_guesses", "initial_guesses");
        rename(options, "basin_choice", "local_optimum_choice");
        if let Some(solver) = options.get_mut("solver").and_then(Value::as_object_mut) {
            solver.retain(|name, _| !FORMER_SOLVER_SETTINGS.contains(&name.as_str()));
        }
    })
}

/// The report of a solve. Only former ones are read as values first, because a study has one for each trial.
pub(super) fn solve_report(text: &str) -> StoreResult<SolveReport> {
    if !text.contains("\"basin\":") {
        return json_columns::from_text("report", text);
    }
    read("report", text, |report| {
        for attempt in each(report.get_mut("attempts")) {
            rename(attempt, "basin", "local_optimum");
        }
    })
}

/// Settings of a gait problem. Without a weight on the curvature of activations they mean 0, while new studies without
/// it get the default.
pub(super) fn gait_settings(text: &str) -> StoreResult<GaitSettings> {
    read("gait_settings", text, |settings| {
        if let Some(weights) = settings.get_mut("regularisation").and_then(Value::as_object_mut) {
            weights.entry("activation_bend").or_insert_with(|| 0.0.into());
        }
    })
}

/// Iterations of a solve. In the text, because a column of many iterations would take several times its length as values.
pub(super) fn iterations(what: &'static str, text: &str) -> StoreResult<Vec<IterationRecord>> {
    let (former, today) = ("\"between_points\"", "\"inter_node\"");
    if text.contains(former) {
        return json_columns::from_text(what, &text.replace(former, today));
    }
    json_columns::from_text(what, text)
}

/// How to read a measurement file.
pub(super) fn reading<T: DeserializeOwned>(text: &str) -> StoreResult<T> {
    read("reading", text, |reading| rename(reading, "form", "format"))
}

/// A result of EMG processing.
pub(super) fn emg_result<T: DeserializeOwned>(text: &str) -> StoreResult<T> {
    read("EMG result", text, |result| {
        for walk in each(result.get_mut("walks")) {
            rename(walk, "recording_id", "measurement_file_id");
            if let Some(rmse) = walk.get_mut("emg_rmse") {
                rename(rmse, "remarks", "warnings");
            }
        }
    })
}

/// An infeasibility explanation.
pub(super) fn explanation(text: &str) -> StoreResult<Explanation> {
    read("explanation", text, |explanation| {
        for conflict in each(explanation.get_mut("conflicts")) {
            rename(conflict, "wishes", "naturalness_terms");
        }
    })
}

/// Parses a document after `bring` has changed it.
fn read<T: DeserializeOwned>(what: &'static str, text: &str, bring: impl FnOnce(&mut Value)) -> StoreResult<T> {
    let mut document: Value = json_columns::from_text(what, text)?;
    bring(&mut document);
    parsed(what, document)
}

fn parsed<T: DeserializeOwned>(what: &'static str, document: Value) -> StoreResult<T> {
    serde_json::from_value(document).map_err(|e| StoreError::Damaged { what, reason: e.to_string() })
}

/// The elements of an array.
fn each(array: Option<&mut Value>) -> impl Iterator<Item = &mut Value> {
    array.and_then(Value::as_array_mut).into_iter().flatten()
}

/// Gives a field its name of today, unless the document has both.
fn rename(document: &mut Value, former: &str, today: &str) {
    if let Some(fields) = document.as_object_mut()
        && !fields.contains_key(today)
        && let Some(value) = fields.remove(former)
    {
        fields.insert(today.to_owned(), value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gait_learner::Method;
    use gait_optimizer::LocalOptimumChoice;
    use gait_optimizer::solve::SolvePhase;
    use serde_json::json;

    #[test]
    fn former_solver_settings_are_skipped_and_unknown_ones_are_damage() {
        let with = |solver: &str| solve_options(&format!(r#"{{"solver": {{"required_reduction": 0.5, {solver}}}}}"#));
        let mut kept = SolveOptions::default();
        kept.solver.required_reduction = 0.5;
        assert_eq!(with(r#""watchdog_trials": 4, "dual_regularisation": "adaptive""#).unwrap(), kept);
        assert!(matches!(with(r#""watchdog": 4"#), Err(StoreError::Damaged { .. })));
    }

    #[test]
    fn report_with_numbers_of_basins_has_those_of_local_optima() {
        let report = |name: &str| {
            let text = format!(
                r#"{{"status": "converged", "started_from": "cold", "iterations": 3, "objective": 0.06,
                "cost_of_transport": 0.05, "gait_rmse_rad": 0.5, "gait_rmse_parts_rad": [0.1, 0.1, 0.1, 0.1, 0.1],
                "max_violation": 1e-9, "seconds_total": 1.0, "seconds_evaluation": 0.1, "seconds_linear_algebra": 0.8,
                "variables": 8, "equalities": 4, "inequalities": 2, "speed_m_s": 1.0, "stride_length_m": 1.1,
                "durations_s": [0.1, 0.1, 0.3, 0.1, 0.1, 0.1, 0.3, 0.1], "vhip_m_s": [1.0, 1.0, 1.0, 1.0],
                "attempts": [{{"strategy": "natural", "status": "converged", "iterations": 3, "seconds": 1.0,
                    "objective": 0.06, "gait_rmse_rad": 0.5, "{name}":2, "chosen": true}}]}}"#
            );
            solve_report(&text).unwrap()
        };
        assert_eq!(report("basin").attempts[0].local_optimum, Some(2));
        assert_eq!(report("basin"), report("local_optimum"));
    }

    #[test]
    fn former_learner_settings_without_effect_are_skipped_and_others_are_refused() {
        let neutral = json!({"method": "eubo", "lengthscale_factor": 2.0, "additive_share": 0.0, "pairwise_share": 0,
            "broad_lengthscale": 2.5, "feasibility_lengthscale_factor": 1.0, "feasibility_additive_share": 0.0, "learn_every": null});
        let today = LearnerSettings { lengthscale_factor: 2.0, ..LearnerSettings::of(Method::Eubo) };
        assert_eq!(learner_settings("a", &neutral.to_string()).unwrap(), today);
        for (name, value) in [
            ("additive_share", json!(0.3)),
            ("pairwise_share", json!(1)),
            ("broad_lengthscale", json!(null)),
            ("feasibility_lengthscale_factor", json!(2.0)),
            ("feasibility_additive_share", json!("0")),
            ("learn_every", json!(10)),
        ] {
            let mut changed = neutral.clone();
            changed[name] = value.clone();
            let refused = learner_settings("Knee study", &changed.to_string()).unwrap_err();
            let StoreError::FormerSetting { study, setting, value: found } = &refused else { panic!("{refused:?}") };
            assert_eq!((study.as_str(), *setting, found), ("Knee study", name, &value.to_string()));
            let text = refused.to_string();
            assert!(text.contains("Knee study") && text.contains(&format!("{name} = {value}")), "{text}");
        }
        assert!(matches!(learner_settings("a", r#"{"nose": 1}"#), Err(StoreError::Damaged { .. })));
    }

    #[test]
    fn older_settings_without_curvature_weight_mean_zero() {
        let old = r#"{"mesh": {"ds2": 4, "ds3": 4, "ss2": 6, "ss1": 6}, "regularisation": {"power_smoothing_w": 1,
            "torque": 0.003, "acceleration": 0.0001, "contact_force": 0.0001, "activation": 0.003, "fibre_velocity": 0.01}}"#;
        assert_eq!(gait_settings(old).unwrap(), GaitSettings::reference_problem());
        let new = serde_json::to_string(&GaitSettings::default()).unwrap();
        assert_eq!(gait_settings(&new).unwrap(), GaitSettings::default());
    }

    #[test]
    fn former_names_are_read_as_those_of_today() {
        let options = solve_options(r#"{"cold_guesses": 3}"#).unwrap();
        assert_eq!(options, SolveOptions { initial_guesses: 3, ..SolveOptions::default() });
        assert!(solve_options(r#"{"cold_guesses": 3, "initial_guesses": 3}"#).is_err(), "not both");
        let nearest = LocalOptimumChoice::NearestToReference { within_percent: 3.0 };
        let options = solve_options(r#"{"basin_choice": {"nearest_to_reference": {"within_percent": 3}}}"#).unwrap();
        assert_eq!(options, SolveOptions { local_optimum_choice: nearest, ..SolveOptions::default() });
        let phase = |name: &str| {
            let record = format!(
                r#"[{{"guess": 0, "phase": "{name}", "iteration": 1, "objective": 0.5, "constraint_violation": 0.1,
                "dual_infeasibility": 0.1, "barrier": 0.1, "step": 1.0}}]"#
            );
            iterations("iterations", &record).unwrap()[0].phase
        };
        assert_eq!((phase("between_points"), phase("cost")), (SolvePhase::InterNode, SolvePhase::Cost));
        let reading: Value = reading(r#"{"form": "opensim", "rate_hz": 1000}"#).unwrap();
        assert_eq!(reading, json!({"format": "opensim", "rate_hz": 1000}));
        let result = json!({"walks": [{"recording_id": "r", "emg_rmse": {"total": 1.5, "remarks": ["weak"]}}, {"emg_rmse": null}]});
        let today = json!({"walks": [{"measurement_file_id": "r", "emg_rmse": {"total": 1.5, "warnings": ["weak"]}}, {"emg_rmse": null}]});
        assert_eq!(emg_result::<Value>(&result.to_string()).unwrap(), today);
        assert_eq!(emg_result::<Value>(&today.to_string()).unwrap(), today);
        let conflict =
            json!({"bounds": [], "wishes": ["smooth torque"], "violations": [], "starts": 3, "undecided": false});
        let explained = json!({"status": "infeasible", "violations": [], "conflicts": [conflict], "at_limit": [], "relaxations": []});
        let found = explanation(&explained.to_string()).unwrap();
        assert_eq!(found.conflicts[0].naturalness_terms, ["smooth torque"]);
    }
}
