//! The settings of the interior-point solver that a caller can choose for gait problems.
//!
//! The phases of a solve determine the others from the options and the initial guess: tolerances, limits, barrier
//! parameter and strategy, distance of the first point from its bounds, threshold of the curvature, and threads.

use crate::model_error::ModelError;
use interior_point::{BoundMultiplierStart, NlpSettings};
use serde::de::Error as _;
use serde::ser::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Map, Value};

/// Fields that the phases determine.
const DECIDED_BY_PHASES: [&str; 11] = [
    "tolerance",
    "violation_tolerance",
    "complementarity_tolerance",
    "max_iterations",
    "max_seconds",
    "barrier_strategy",
    "mu_initial",
    "warm_bound_push",
    "gradient_scaling",
    "curvature_from_violation",
    "threads",
];

/// Defaults for gait problems. Cold starts keep a distance from their bounds, and bound multipliers start on the
/// central path. After a wrong inertia the unregularised matrix is not tried again immediately, and an unsuccessful
/// second-order correction is not repeated.
pub(super) fn default() -> NlpSettings {
    NlpSettings {
        bound_push: 0.1,
        bound_multiplier_start: BoundMultiplierStart::Centred,
        regularisation_memory: 4,
        max_second_order_corrections: 1,
        ..NlpSettings::default()
    }
}

pub(super) fn are_default(settings: &NlpSettings) -> bool {
    *settings == default()
}

fn fields(settings: &NlpSettings) -> Result<Map<String, Value>, String> {
    match serde_json::to_value(settings).map_err(|error| error.to_string())? {
        Value::Object(fields) => Ok(fields),
        other => Err(format!("not an object: {other}")),
    }
}

fn decided(field: &str) -> String {
    format!("{field} cannot be set here, because each phase of a solve sets its own value; omit it")
}

/// Checks all ranges, and that no field is set that the phases determine.
pub(super) fn validate(settings: &NlpSettings) -> Result<(), ModelError> {
    let invalid = |reason: String| ModelError::Malformed { what: "solver".to_owned(), reason };
    settings.validate().map_err(|error| invalid(error.to_string()))?;
    let (own, usual) = (fields(settings).map_err(invalid)?, fields(&default()).map_err(invalid)?);
    match DECIDED_BY_PHASES.into_iter().find(|&field| own.get(field) != usual.get(field)) {
        Some(field) => Err(invalid(decided(field))),
        None => Ok(()),
    }
}

/// Serialises the fields that differ from the defaults.
pub(super) fn serialize<S: Serializer>(settings: &NlpSettings, serializer: S) -> Result<S::Ok, S::Error> {
    let usual = fields(&default()).map_err(S::Error::custom)?;
    let mut own = fields(settings).map_err(S::Error::custom)?;
    own.retain(|field, value| usual.get(field) != Some(value));
    own.serialize(serializer)
}

/// Deserialises settings. Missing fields have the defaults for gait problems; fields that the phases determine must
/// be missing.
pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<NlpSettings, D::Error> {
    let mut all = fields(&default()).map_err(D::Error::custom)?;
    let given = Map::deserialize(deserializer)?;
    if let Some(field) = DECIDED_BY_PHASES.into_iter().find(|&field| given.contains_key(field)) {
        return Err(D::Error::custom(decided(field)));
    }
    let mut settings = default();
    for (field, value) in given {
        all.insert(field.clone(), value);
        // Field by field, so that errors have its name.
        settings = serde_json::from_value(Value::Object(all.clone()))
            .map_err(|error| D::Error::custom(format!("solver.{field}: {error}")))?;
    }
    Ok(settings)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use crate::solve::SolveOptions;

    fn options(text: &str) -> Result<SolveOptions, String> {
        let options: SolveOptions = serde_json::from_str(text).map_err(|error| error.to_string())?;
        options.validate().map(|()| options).map_err(|error| error.to_string())
    }

    #[test]
    fn missing_fields_have_the_defaults_for_gait_problems() {
        let given = options(r#"{"solver": {"required_reduction": 0.8}}"#).unwrap();
        let mut expected = SolveOptions::default();
        expected.solver.required_reduction = 0.8;
        assert_eq!(given, expected);
        let written = serde_json::to_string(&given).unwrap();
        assert_eq!(options(&written).unwrap(), given);
    }

    #[test]
    fn default_settings_serialise_to_an_empty_object() {
        assert!(!serde_json::to_string(&SolveOptions::default()).unwrap().contains("solver"));
    }

    #[test]
    fn invalid_settings_are_rejected_by_name() {
        for (text, expected) in [
            (r#"{"solver": {"required_reduction": 1.5}}"#, "required_reduction"),
            (r#"{"solver": {"bound_psuh": 0.1}}"#, "unknown field `bound_psuh`"),
            (r#"{"solver": {"bound_push": "high"}}"#, "solver.bound_push: invalid type: string"),
            (r#"{"solver": {"bound_push": 0.2, "linear_solver": "ma57"}}"#, "solver.linear_solver: unknown variant"),
            (r#"{"solver": {"bound_relaxation": 1e-3}}"#, "bound_relaxation is 0.001; it must be 0 to 0.000001"),
            (r#"{"solver": {"bound_push": 1}}"#, "bound_push is 1; it must be more than 0 and at most 0.5"),
            (r#"{"solver": {"hessian_regularisation_first": 0}}"#, "first is 0; it must be a positive number"),
            (r#"{"solver": {"mu_initial": 0.2}}"#, "mu_initial cannot be set here"),
            (r#"{"solver": {"mu_initial": 0.1}}"#, "mu_initial cannot be set here"),
            (r#"{"solver": {"threads": 2}}"#, "threads cannot be set here"),
        ] {
            let error = options(text).unwrap_err();
            assert!(error.contains(expected), "{text}: {error}");
        }
    }
}
