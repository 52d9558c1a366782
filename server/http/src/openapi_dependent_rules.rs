//! Rules that a schema cannot state, because they relate a field to the record, to other fields or to a file. The
//! description has them in `x-depends` of the field.

use super::openapi_schemas::Schemas;
use serde_json::{Value, json};

const GAIT: &str = "A trial of this study with a walkable gait: converged, certified, without a safety report in force. The two trials of \
                    a comparison have different gaits.";
const GAIT_OF_STUDY: &str =
    "A converged trial of this study. For `cannot_tell`, its gait is walkable. The two trials have different gaits.";
const BOUNDS: &str = "a3 is smaller than a4 by 0.001 or more.";
const SPACE: &str = "Each bound has at most one dimension. The values of a dimension increase, each within the range of the \
                     bound. Its lengthscale lies between a hundredth of the smallest step between the values and 10,000 times \
                     their range. The smallest a4 exceeds the largest a3 by 0.001 or more.";
const LEARNER: &str = "`nugget` is 1e-10 to 1 times `signal_variance`. Noise scales and `no_difference_width` are 1e-3 to 1e3 times the \
                       square root of `signal_variance`, and the threshold is at most 10 times that square root. \
                       `expectation_propagation` needs the link `probit`.";
const EXISTS: &str = "An existing object.";
const LIMITS: &str = "Each lower limit is smaller than its upper limit.";
const EMG_FILE: &str = "A file in the format that `format` names, with the columns of the muscles, sampled at 100 Hz or more, with one whole \
                        stride or more. It has all columns and heel strikes that are named in the request.";
const JOINT_ANGLE_FILE: &str = "A file in the format that `format` names, with the angle of at least one joint over several strides, as `/help/data-files` describes it.";
const REFERENCE_FILE: &str = "A file in the format that `format` names, with its columns, as `/help/data-files` describes it: five \
                              joint angles over at least one whole stride of a walking person. It has all columns and heel \
                              strikes that are named in the request.";

const STUDY_NAME: &str = "A name that no other study has, whatever its capitals and spaces.";
const AUTHOR: &str = "The name of the signed-in user, unless `source` is `subject` or `script`.";
const REPLACED: &str = "A person's answer to the same comparison in this study. It still counts, and is neither a rater's answer \
                        nor a safety report.";
/// Query parameter and the rule.
const PARAMETER_RULES: [(&str, &str); 3] = [
    ("cursor", "The value of `next` from a page of this list with the same filters and order."),
    ("x", "A bound of the study's search space, and not that of `y`."),
    ("y", "A bound of the study's search space, and not that of `x`."),
];

/// Component, field, and the rule.
const RULES: [(&str, &str, &str); 36] = [
    ("NewPreference", "replaces", REPLACED),
    ("NewAssessment", "replaces", REPLACED),
    ("NewPreference", "author", AUTHOR),
    ("NewAssessment", "author", AUTHOR),
    ("NewSafetyReport", "author", AUTHOR),
    ("NewSuggestion", "author", AUTHOR),
    ("NewPreference", "trial_a", GAIT),
    ("NewPreference", "trial_b", GAIT),
    ("NewAssessment", "trial_a", GAIT_OF_STUDY),
    ("NewAssessment", "trial_b", GAIT_OF_STUDY),
    ("NewLabSession", "trial_a", GAIT),
    ("NewLabSession", "trial_b", GAIT),
    ("NewSuggestion", "over", "A trial of this study with a walkable gait."),
    (
        "NewSuggestion",
        "bounds",
        "Dimensions of the study's search space, each with one of its values. At least one value differs from \
         that of the trial. If another trial already has these bounds, its gait is walkable and differs from \
         that of this trial.",
    ),
    ("NewStudy", "name", STUDY_NAME),
    ("StudyChange", "name", STUDY_NAME),
    ("StudyClone", "name", STUDY_NAME),
    ("NewStudy", "subject_id", EXISTS),
    ("NewStudy", "device_id", EXISTS),
    ("NewStudy", "reference_gait_id", EXISTS),
    ("NewStudy", "base_bounds", BOUNDS),
    ("NewStudy", "search_space", SPACE),
    ("NewStudy", "gait_settings", LIMITS),
    ("NewStudy", "learner", LEARNER),
    ("StudyExtension", "number_of_trials", "More than the current number of trials."),
    ("NewMember", "name", "The name of a user who is not disabled, or of a token that is not revoked."),
    ("RaterInvitation", "name", "The name of a rater, or one that is not taken."),
    ("RaterUnblinding", "rater", "A rater who was shown a pair of this study."),
    ("NewSafetyReview", "reports", "Includes every safety report in force about the gait of this trial."),
    ("NewEmg", "recording", EMG_FILE),
    (
        "NewEmg",
        "reading",
        "An OpenSim file has no `rate_hz`. Heel strikes are given as two or more times in seconds, or as a column instead.",
    ),
    ("NewJointAngles", "recording", JOINT_ANGLE_FILE),
    ("NewJointAngles", "reading", "`cutoff_hz` is at most 0.45 times the sampling rate."),
    ("NewReferenceGait", "recording", REFERENCE_FILE),
    (
        "EmgProcessing",
        "settings",
        "`band_high_hz` exceeds `band_low_hz` by 1 or more, and is at most 0.495 times the sampling rate. The other \
         frequencies are at most 0.45 times the sampling rate.",
    ),
    ("NewLabAnswer", "number", "At most the current `answer_number` or `report_number`."),
];

/// Adds the rules to the fields.
pub(super) fn state(schemas: &mut Schemas<'_>) {
    for (component, field, rule) in RULES {
        schemas.add(component, field, &json!({ "x-depends": rule }));
    }
}

/// Adds the rule of a query parameter to it.
pub(super) fn state_parameter(parameter: &mut Value) {
    let rule = PARAMETER_RULES.into_iter().find(|(name, _)| parameter["in"] == "query" && parameter["name"] == *name);
    if let Some((_, rule)) = rule {
        parameter["x-depends"] = rule.into();
    }
}

#[cfg(test)]
mod tests {
    use super::RULES;
    use crate::openapi;
    use std::collections::BTreeSet;

    #[test]
    fn every_dependency_rule_names_a_described_field() {
        let document = openapi::value().unwrap();
        let mut fields = BTreeSet::new();
        for (component, field, rule) in RULES {
            let place = format!("/components/schemas/{component}/properties/{field}/x-depends");
            assert_eq!(document.pointer(&place).and_then(|text| text.as_str()), Some(rule), "{component}.{field}");
            assert!(fields.insert((component, field)), "{component}.{field}");
        }
    }
}
