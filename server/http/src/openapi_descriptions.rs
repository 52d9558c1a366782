//! Descriptions of the fields whose schemas come from default values and from tables of fields.

use super::openapi_schemas::Schemas;
use serde_json::json;

/// Component, field with a slash between levels, and the description.
type FieldDescription = (&'static str, &'static str, &'static str);

const LEARNER: [FieldDescription; 21] = [
    (
        "LearnerSettings",
        "method",
        "How the next action is chosen: `linecospar`, the best action of a posterior sample on a random line through the best \
         action; `eubo`, the action whose comparison with the best one is expected to be most useful; `thompson`, the best \
         action of a posterior sample over the whole search space; `information_gain`, the action whose feedback is expected \
         to tell the most about the utility; `random`, a random action that has not been tried.",
    ),
    (
        "LearnerSettings",
        "inference",
        "Method of approximate inference: `laplace`, a normal distribution at the mode of the posterior; \
         `expectation_propagation`, which needs the link `probit`.",
    ),
    ("LearnerSettings", "link", "Distribution of the noise: `logistic`, or `probit` for the normal distribution."),
    ("LearnerSettings", "signal_variance", "Prior variance of the utility."),
    (
        "LearnerSettings",
        "nugget",
        "Variance added to the diagonal of the prior covariance, called *GP noise* in the literature.",
    ),
    ("LearnerSettings", "lengthscale_factor", "Factor on the lengthscale of every dimension."),
    (
        "LearnerSettings",
        "labels",
        "What labels are evidence of: `in_utility`, the utility, as in the literature; `separate`, the feasibility of \
         actions, modelled by a second Gaussian process.",
    ),
    (
        "LearnerSettings",
        "start",
        "First action of a study: `random`, a random one; `centre`, the middle value of every dimension.",
    ),
    ("LearnerSettings", "preference_noise", "Noise scale of preferences, in units of utility."),
    ("LearnerSettings", "ordinal_noise", "Noise scale of labels, in units of utility."),
    (
        "LearnerSettings",
        "ordinal_thresholds",
        "Threshold between the labels *not converged* and *converged*, in units of utility.",
    ),
    ("LearnerSettings", "coactive_noise", "Noise scale of suggestions, in units of utility."),
    ("LearnerSettings", "no_difference_noise", "Noise scale of answers that state no difference, in units of utility."),
    ("LearnerSettings", "no_difference_width", "Difference in utility below which two gaits feel equal."),
    (
        "LearnerSettings",
        "avoidance",
        "Region of avoidance (ROIAL): an action is not proposed if its mean plus this many standard deviations is below the \
         threshold of labels, unless no other action is left. ROIAL uses -0.45. Null disables the region.",
    ),
    ("LearnerSettings", "samples_per_iteration", "Number of actions in a batch."),
    ("LearnerSettings", "repeats", "Whether `linecospar` may propose an action that has already been tried."),
    (
        "LearnerSettings",
        "lines",
        "Number of random lines through the best action that `eubo` searches. With 0, it searches the whole search space.",
    ),
    (
        "LearnerSettings",
        "line_trials",
        "Number of trials after which `eubo` searches the whole search space instead of lines. Null: it always searches lines.",
    ),
    (
        "LearnerSettings",
        "partner",
        "Earlier actions with which a new one is compared: `previous`, the other actions of its batch and the last `buffer` \
         actions before the batch; `incumbent`, the best one; `every`, all of them.",
    ),
    (
        "LearnerSettings",
        "buffer",
        "If `partner` is `previous`: number of actions before a batch with which each action of the batch is compared.",
    ),
];

const SOLVE_OPTIONS: [FieldDescription; 8] = [
    ("SolveOptions", "tolerance", "Scaled optimality tolerance."),
    (
        "SolveOptions",
        "max_iterations",
        "Maximum number of iterations in each phase of a solve. Phases that track the reference gait are limited to 200.",
    ),
    (
        "SolveOptions",
        "time_limit_s",
        "Maximum wall time of a solve, s. Null for no limit. With a limit, the result depends on the speed of the machine.",
    ),
    ("SolveOptions", "threads", "Number of threads. The result does not depend on it."),
    ("SolveOptions", "initial_guesses", "Minimum number of initial guesses of a cold start."),
    ("SolveOptions", "retry", "Whether a cold start tries further initial guesses until one converges."),
    (
        "SolveOptions",
        "local_optimum_choice",
        "Which one of several local optima is the result: `lowest_objective`, or `nearest_to_reference`, the one with the lowest \
         Gait RMSE among those whose objective exceeds the lowest by at most `within_percent` per cent, or `numbered`, the one with \
         this number among those that the cold start reached.",
    ),
    (
        "SolveOptions",
        "tightening_rounds",
        "Maximum number of rounds in which bounds are tightened and the solve continues, because the gait violates them \
         between nodes. 0 disables the check.",
    ),
];

const GAIT_SETTINGS: [FieldDescription; 51] = [
    ("GaitSettings", "mesh", "Number of mesh intervals of each kind of domain."),
    ("GaitSettings", "mesh/ds2", "Intervals of DS2, double support on the stance heel and the trailing toe."),
    ("GaitSettings", "mesh/ds3", "Intervals of DS3, double support on the flat stance foot and the trailing toe."),
    ("GaitSettings", "mesh/ss2", "Intervals of SS2, single support on the flat stance foot."),
    ("GaitSettings", "mesh/ss1", "Intervals of SS1, single support on the stance toe."),
    ("GaitSettings", "limits", "Limits of a gait besides the tuned bounds."),
    ("GaitSettings", "limits/friction", "Friction coefficient of the feet."),
    ("GaitSettings", "limits/impact_friction", "Friction coefficient of the impulse at heel strike."),
    ("GaitSettings", "limits/speed_min_m_s", "Minimum walking speed, m/s."),
    ("GaitSettings", "limits/speed_max_m_s", "Maximum walking speed, m/s."),
    ("GaitSettings", "limits/step_min_m", "Minimum length of each step, m."),
    ("GaitSettings", "limits/step_max_m", "Maximum length of each step, m."),
    ("GaitSettings", "limits/duration_min_s", "Minimum duration of each kind of domain, s."),
    ("GaitSettings", "limits/duration_min_s/ds2", "Minimum duration of DS2, s."),
    ("GaitSettings", "limits/duration_min_s/ds3", "Minimum duration of DS3, s."),
    ("GaitSettings", "limits/duration_min_s/ss2", "Minimum duration of SS2, s."),
    ("GaitSettings", "limits/duration_min_s/ss1", "Minimum duration of SS1, s."),
    ("GaitSettings", "limits/duration_max_s", "Maximum duration of each kind of domain, s."),
    ("GaitSettings", "limits/duration_max_s/ds2", "Maximum duration of DS2, s."),
    ("GaitSettings", "limits/duration_max_s/ds3", "Maximum duration of DS3, s."),
    ("GaitSettings", "limits/duration_max_s/ss2", "Maximum duration of SS2, s."),
    ("GaitSettings", "limits/duration_max_s/ss1", "Maximum duration of SS1, s."),
    (
        "GaitSettings",
        "limits/knee_min_rad",
        "Minimum knee flexion, rad. It excludes the straight knee, which is singular.",
    ),
    ("GaitSettings", "limits/knee_max_rad", "Maximum knee flexion, rad."),
    ("GaitSettings", "limits/hip_max_rad", "Anatomical limit of both hip angles in addition to a7, rad."),
    ("GaitSettings", "limits/hip_torque_n_m", "Maximum human hip torque, N m."),
    ("GaitSettings", "limits/knee_torque_n_m", "Maximum human knee torque, N m."),
    ("GaitSettings", "limits/ankle_plantarflexion_torque_n_m", "Maximum human plantarflexion torque, N m."),
    ("GaitSettings", "limits/ankle_dorsiflexion_torque_n_m", "Maximum human dorsiflexion torque, N m."),
    (
        "GaitSettings",
        "limits/phase_rate_min_m_s",
        "Minimum forward hip velocity in SS1, m/s. It makes the phase monotonic.",
    ),
    (
        "GaitSettings",
        "limits/torso_tolerance_rad",
        "Minimum half-width of the range of torso lean, rad. It applies if a6 is smaller.",
    ),
    ("GaitSettings", "limits/toe_touchdown_m_s", "Minimum downward velocity of the toe at toe strike, m/s."),
    ("GaitSettings", "limits/heel_touchdown_m_s", "Minimum downward velocity of the heel at heel strike, m/s."),
    (
        "GaitSettings",
        "limits/clearance_min_m",
        "Minimum clearance of the swing foot at mid-swing, m. It applies if a5 is smaller.",
    ),
    (
        "GaitSettings",
        "limits/liftoff_force_n",
        "Minimum normal force at the start of a domain that ends by unloading, N. It decreases linearly to 0.",
    ),
    ("GaitSettings", "limits/contact_force_max_n", "Maximum of each component of a contact force, N."),
    ("GaitSettings", "limits/impulse_max_n_s", "Maximum of each component of an impulse, N s."),
    ("GaitSettings", "limits/fibre_length_min", "Minimum fibre length, in optimal fibre lengths."),
    ("GaitSettings", "limits/fibre_length_max", "Maximum fibre length, in optimal fibre lengths."),
    (
        "GaitSettings",
        "regularisation",
        "Regularisation of the objective. Each weight multiplies the time integral of a square.",
    ),
    (
        "GaitSettings",
        "regularisation/power_smoothing_w",
        "Smoothing of the magnitudes of joint powers, W: with the smoothing e, |P| becomes sqrt(P² + e²) - e.",
    ),
    ("GaitSettings", "regularisation/torque", "Weight of torques, relative to 100 N m."),
    ("GaitSettings", "regularisation/acceleration", "Weight of accelerations, relative to 30 m/s² and 30 rad/s²."),
    ("GaitSettings", "regularisation/contact_force", "Weight of contact forces, relative to 500 N."),
    ("GaitSettings", "regularisation/activation", "Weight of muscle activations."),
    (
        "GaitSettings",
        "regularisation/fibre_velocity",
        "Weight of fibre velocities, relative to the maximum velocity of each muscle.",
    ),
    (
        "GaitSettings",
        "regularisation/activation_bend",
        "Weight of the second differences of muscle activations over adjacent nodes of a domain.",
    ),
    ("GaitSettings", "naturalness", "Naturalness terms, which the paper does not have."),
    (
        "GaitSettings",
        "naturalness/reference_weight",
        "Weight of the squared distance from the joint angles of the reference gait, relative to the cost of transport. 0 \
         disables the term.",
    ),
    (
        "GaitSettings",
        "naturalness/trailing_load_share",
        "Minimum share of the weight of the walker on the trailing foot at heel strike of the other foot. It decreases \
         linearly to 0 at toe-off. 0 disables the term.",
    ),
    ("GaitSettings", "muscles", "Muscle values of the subject that differ from the default values."),
];

const OTHERS: [FieldDescription; 11] = [
    ("DeviceDefinition", "name", "Unique name."),
    (
        "DeviceDefinition",
        "carried_limb",
        "Whether the subject also carries their own shank and foot, with the knee bent, as with a bypass adapter.",
    ),
    ("DeviceDefinition", "sources", "Source of each value, by the name of its field."),
    (
        "MuscleParameters",
        "scaled_to_body",
        "Whether lengths and moment arms scale with body height, and forces with body mass, from the 1.8 m and 80 kg of the \
         published table. Given values are not scaled.",
    ),
    ("MuscleParameters", "ham", "Hamstrings."),
    ("MuscleParameters", "glu", "Gluteus."),
    ("MuscleParameters", "hfl", "Hip flexors."),
    ("MuscleParameters", "gas", "Gastrocnemius."),
    ("MuscleParameters", "vas", "Vasti."),
    ("MuscleParameters", "sol", "Soleus."),
    ("MuscleParameters", "ta", "Tibialis anterior."),
];

fn all() -> impl Iterator<Item = &'static FieldDescription> {
    LEARNER.iter().chain(&SOLVE_OPTIONS).chain(&GAIT_SETTINGS).chain(&OTHERS)
}

/// Adds the descriptions to the fields.
pub(super) fn state(schemas: &mut Schemas<'_>) {
    for (component, field, text) in all() {
        schemas.add(component, field, &json!({ "description": text }));
    }
    // Its schema describes the kind of entry as the tag of an enumeration, which has no comment.
    let entries = schemas.component("PreferenceContent").and_then(|content| content.get_mut("oneOf")?.as_array_mut());
    for entry in entries.into_iter().flatten() {
        if let Some(kind) = entry.pointer_mut("/properties/kind") {
            kind["description"] = json!("Kind of preference.");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::all;
    use crate::openapi;
    use serde_json::Value;

    /// The fields at any depth without a description of their own or of their type.
    fn undescribed(schema: &Value, place: &str, found: &mut Vec<String>) {
        let is_described = |schema: &Value| schema.get("description").is_some() || schema.get("$ref").is_some();
        for (name, field) in schema["properties"].as_object().into_iter().flatten() {
            let place = format!("{place}.{name}");
            let alternatives = field["oneOf"].as_array().into_iter().flatten();
            if !is_described(field) && !alternatives.clone().any(is_described) {
                found.push(place.clone());
            }
            undescribed(field, &place, found);
        }
        for (at, part) in schema["oneOf"].as_array().into_iter().flatten().enumerate() {
            undescribed(part, &format!("{place}[{at}]"), found);
        }
    }

    #[test]
    fn every_component_and_field_is_described() {
        let document = openapi::value().unwrap();
        let mut found = Vec::new();
        for (component, schema) in document["components"]["schemas"].as_object().unwrap() {
            if schema.get("description").is_none() {
                found.push(component.clone());
            }
            undescribed(schema, component, &mut found);
        }
        assert!(found.is_empty(), "{found:?}");
    }

    #[test]
    fn every_description_is_of_a_field() {
        let document = openapi::value().unwrap();
        for (component, field, text) in all() {
            let place = format!("/components/schemas/{component}/properties/{}", field.replace('/', "/properties/"));
            let schema = document.pointer(&place).unwrap_or_else(|| panic!("{component}.{field}"));
            assert_eq!(schema["description"], *text, "{component}.{field}");
        }
    }

    #[test]
    fn every_tag_is_described_and_used() {
        let document = openapi::value().unwrap();
        let operations = document["paths"].as_object().unwrap().values().flat_map(|item| item.as_object().unwrap());
        let mut used: Vec<&str> = operations.filter_map(|(_, operation)| operation["tags"][0].as_str()).collect();
        used.sort_unstable();
        used.dedup();
        let described: Vec<&str> =
            document["tags"].as_array().unwrap().iter().filter_map(|t| t["name"].as_str()).collect();
        assert_eq!(used, described);
        let texts = document["tags"].as_array().unwrap().iter().map(|tag| tag["description"].as_str());
        assert!(
            texts.clone().all(|text| text.is_some_and(|text| text.ends_with('.'))),
            "{:?}",
            texts.collect::<Vec<_>>()
        );
    }
}
