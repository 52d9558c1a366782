//! Adds ranges, lengths, patterns and allowed words to the schemas of the description.
//!
//! A value that matches the description is accepted, unless the state of the record forbids it. Names and notes follow
//! the same rules everywhere, so they are stated once. The ranges of solver and learner settings come from the errors
//! of their own checks.

use super::figures::MAX_IN_A_CHART;
use super::openapi_dependent_rules;
use super::openapi_descriptions;
use super::openapi_schemas::{Schemas, merge};
use super::openapi_settings::settings;
use super::openapi_solver_settings;
use super::resources::document_schemas;
use gait_learner::LearnerSettings;
use gait_optimizer::emg::{CHANNELS, EmgSettings};
use gait_optimizer::limit_cycle::JOINTS;
use gait_optimizer::muscle::{MuscleOverride, MuscleParameters};
use gait_optimizer::settings::Naturalness;
use gait_optimizer::{Device, GaitSettings, LocalOptimumChoice, SolveOptions, Subject, TunedBounds};
use gaitwright_service::access::Right;
use gaitwright_service::error::Error;
use gaitwright_service::studies::overlaid_gaits::MAX_OTHERS;
use gaitwright_service::studies::seed::MAX_SEED;
use gaitwright_store::studies::StudyColumn;
use gaitwright_store::trial_list::{RANGES, SORTS};
use serde_json::{Map, Value, json};

/// Control characters other than tab and line breaks, and characters that change the direction of text.
const UNPRINTABLE: &str =
    r"\u0000-\u0008\u000b\u000c\u000e-\u001f\u007f-\u009f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069";

/// Names: component, field and maximum length.
const NAMES: [(&str, &str, u32); 13] = [
    ("NewUser", "name", 80),
    ("NewToken", "name", 80),
    ("RaterInvitation", "name", 80),
    ("NewMember", "name", 120),
    ("NewStudy", "name", 120),
    ("StudyChange", "name", 120),
    ("StudyClone", "name", 120),
    ("AskRequest", "script", 80),
    ("NewPreference", "author", 80),
    ("NewAssessment", "author", 80),
    ("NewSafetyReport", "author", 80),
    ("NewSuggestion", "author", 80),
    ("AnswerUndo", "author", 80),
];

/// Parameters with rules.
const PARAMETERS: [&str; 11] =
    ["rate_hz", "walk", "after", "Last-Event-ID", "sort", "range", "code", "ids", "other", "x", "y"];

/// Where schemas are in a description.
pub(super) const SCHEMAS: &str = "#/components/schemas/";

/// Adds the rules to the description. Returns the rules whose component, field or parameter it does not have.
pub(super) fn state(document: &mut Value) -> Vec<String> {
    let mut missed = Vec::new();
    let optional = format!("^[^{UNPRINTABLE}]*$");
    let needed = format!(r"^[^{UNPRINTABLE}]*[^\s{UNPRINTABLE}][^{UNPRINTABLE}]*$");
    let one_line = format!(r"^[^\t\r\n{UNPRINTABLE}]*[^\s{UNPRINTABLE}][^\t\r\n{UNPRINTABLE}]*$");
    if let Some(all) = document.pointer_mut("/components/schemas").and_then(Value::as_object_mut) {
        let schemas = &mut Schemas::of(all);
        for (component, field, longest) in NAMES {
            let rule = json!({ "minLength": 1, "maxLength": longest, "pattern": one_line });
            schemas.add(component, field, &rule);
        }
        for component in ["NewSafetyReview", "AnswerRetraction"] {
            schemas.add(component, "author", &json!({ "minLength": 1, "maxLength": 80, "pattern": one_line }));
        }
        for component in [
            "NewSafetyReview",
            "ConsentWithdrawal",
            "NewCorrection",
            "RaterUnblinding",
            "AnswerRetraction",
            "LabSessionUnblinding",
        ] {
            schemas.add(component, "reason", &json!({ "minLength": 1, "maxLength": 2000, "pattern": needed }));
        }
        schemas.add("NewConsent", "form", &json!({ "pattern": needed }));
        schemas.add("StudyChange", "notes", &json!({ "pattern": optional }));
        // A comma separates tags in the form.
        let tag = format!(r"^[^,\t\r\n{UNPRINTABLE}]*[^,\s{UNPRINTABLE}][^,\t\r\n{UNPRINTABLE}]*$");
        let tag = json!({ "type": "string", "minLength": 1, "maxLength": 40, "pattern": tag });
        schemas.add("StudyChange", "tags", &json!({ "items": tag }));
        for component in [
            "NewPreference",
            "NewAssessment",
            "NewSafetyReport",
            "NewSuggestion",
            "RaterAnswer",
            "NewLabAnswer",
            "RecordedWalk",
            "LabSessionClosing",
        ] {
            schemas.add(component, "note", &json!({ "maxLength": 2000, "pattern": optional }));
        }
        for component in ["TellRequest", "StateChangeReason"] {
            schemas.add(component, "reason", &json!({ "maxLength": 2000, "pattern": optional }));
        }
        for component in ["NewSubject", "NewLabSession"] {
            schemas.add(component, "notes", &json!({ "pattern": optional }));
        }
        // A code assigned by the site, without addresses, dates and long numbers.
        let pseudonym = r"^(?!(.*[0-9]){6})[A-Za-z0-9_.:/#+()\-][A-Za-z0-9 _.:/#+()\-]*$";
        schemas.add("NewSubject", "pseudonym", &json!({ "pattern": pseudonym }));
        let scopes: Vec<Right> = Right::ALL.into_iter().filter(|right| *right != Right::Administer).collect();
        schemas.add("NewToken", "scopes", &json!({ "items": { "enum": scopes } }));
        let answers = json!({ "enum": [
            "first", "second", "no_difference", "cannot_tell", "unsafe_first", "unsafe_second", "unsafe_both",
        ] });
        for component in ["RaterAnswer", "NewLabAnswer"] {
            schemas.set(component, "answer", answers.clone());
        }
        for field in ["gait_rmse_rad", "cost_of_transport"] {
            schemas.add("TellRequest", field, &json!({ "minimum": 0, "exclusiveMaximum": 1e6 }));
        }
        if let Some(tell) = schemas.component("TellRequest") {
            let reason = json!({ "required": ["reason"], "properties": { "reason": { "pattern": r"\S" } } });
            let rmse =
                json!({ "required": ["gait_rmse_rad"], "properties": { "gait_rmse_rad": { "type": "number" } } });
            tell.insert("if".to_owned(), json!({ "properties": { "label": { "const": "converged" } } }));
            tell.insert("then".to_owned(), rmse);
            tell.insert("else".to_owned(), reason);
        }
        schemas.add("NewReferenceGait", "name", &json!({ "minLength": 1, "maxLength": 200, "pattern": one_line }));
        for component in ["NewReferenceGait", "NewEmg", "NewJointAngles"] {
            schemas.add(component, "recording", &json!({ "minLength": 1 }));
        }
        schemas.add("NewReferenceGait", "format", &json!({ "default": "opensim" }));
        schemas.add("EmgReading", "channels", &json!({ "propertyNames": { "enum": CHANNELS } }));
        for component in ["JointAngleReading", "NewReferenceGait"] {
            schemas.add(component, "columns", &json!({ "propertyNames": { "enum": JOINTS } }));
        }
        schemas.add("JointAngleReading", "cutoff_hz", &json!({ "minimum": 0.5 }));
        state_emg(schemas);
        let bounds = json!({ "propertyNames": { "enum": TunedBounds::NAMES }, "minProperties": 1 });
        schemas.add("NewSuggestion", "bounds", &bounds);
        for (field, (least, most)) in
            [("height_m", Subject::HEIGHT_RANGE_M), ("body_mass_kg", Subject::BODY_MASS_RANGE_KG)]
        {
            schemas.add("NewReferenceGait", field, &json!({ "minimum": least, "maximum": most }));
        }
        for component in ["NewStudy", "StudyClone"] {
            schemas.add(component, "seed", &json!({ "minimum": 0, "maximum": MAX_SEED }));
            schemas.add(component, "number_of_trials", &json!({ "minimum": 1, "maximum": 10_000 }));
        }
        schemas.add("NewExecutionReport", "seed", &json!({ "minimum": 0, "maximum": MAX_SEED }));
        schemas.add("NewStudy", "parallel_trials", &json!({ "minimum": 1, "maximum": 64 }));
        schemas.add("NewStudy", "priority", &json!({ "minimum": -10, "maximum": 10 }));
        schemas.add("NewStudy", "solve_seconds_budget", &json!({ "minimum": 1, "maximum": 1e8 }));
        schemas.add("Dimension", "name", &json!({ "enum": TunedBounds::NAMES }));
        let (least, most) =
            TunedBounds::RANGES.iter().fold((f64::MAX, 0.0_f64), |all, own| (all.0.min(own.0), all.1.max(own.1)));
        let item = json!({ "type": "number", "format": "double", "minimum": least, "maximum": most });
        let values = json!({ "minItems": 1, "maxItems": 1000, "uniqueItems": true, "items": item });
        schemas.add("Dimension", "values", &values);
        schemas.add("Dimension", "lengthscale", &json!({ "minimum": 1e-15, "maximum": 1e15 }));
        schemas.add("SearchSpace", "dimensions", &json!({ "minItems": 1, "maxItems": TunedBounds::NAMES.len() }));
        for component in ["Dimension", "SearchSpace"].into_iter().chain(document_schemas::CLOSED) {
            schemas.close(component);
        }
        state_bounds(schemas);
        let mut gait = settings(widest_durations(), |s: &GaitSettings| s.validate().err().map(Error::from));
        // The muscles are absent if they have their default values.
        gait["properties"]["muscles"] = json!({ "$ref": format!("{SCHEMAS}MuscleParameters") });
        for (name, schema) in [
            ("GaitSettings", gait),
            ("SolveOptions", solve_options(&mut missed)),
            ("LearnerSettings", learner(&mut missed)),
            ("MuscleParameters", muscles()),
            ("DeviceDefinition", device(&one_line)),
        ] {
            schemas.put(name, schema);
        }
        openapi_descriptions::state(schemas);
        openapi_dependent_rules::state(schemas);
        missed.append(&mut schemas.missed);
    }
    let mut unused: Vec<&str> = PARAMETERS.to_vec();
    if let Some(paths) = document.get_mut("paths").and_then(Value::as_object_mut) {
        for (path, item) in paths {
            let operations = item.as_object_mut().into_iter().flatten();
            for parameter in
                operations.filter_map(|(_, operation)| operation.get_mut("parameters")?.as_array_mut()).flatten()
            {
                state_parameter(path, parameter);
                unused.retain(|name| parameter["name"] != *name);
            }
        }
    }
    missed.extend(unused.into_iter().map(|name| format!("parameter {name}")));
    missed
}

/// The bounds of an action, and a second schema for requests, where each bound has a default.
fn state_bounds(schemas: &mut Schemas<'_>) {
    let mut properties = Map::new();
    for (bound, name) in TunedBounds::NAMES.iter().enumerate() {
        let side = if TunedBounds::IS_LOWER[bound] { "Minimum" } else { "Maximum" };
        // Two meanings name the side themselves.
        let meaning = TunedBounds::MEANINGS[bound];
        let quantity = meaning.trim_start_matches("minimum ").trim_start_matches("maximum ");
        let meaning = format!("{side} {quantity}.");
        let (least, most) = TunedBounds::RANGES[bound];
        let mut schema = number(&meaning, least, most, &json!("number"));
        schema["format"] = json!("double");
        properties.insert((*name).to_owned(), schema);
    }
    let bounds = json!({
        "type": "object",
        "additionalProperties": false,
        "required": TunedBounds::NAMES,
        "properties": properties,
    });
    schemas.put("Bounds", bounds);
    let Some(mut given) = schemas.component("Bounds").cloned() else { return };
    given.remove("required");
    given.insert("description".to_owned(), json!("Values of bounds. Absent bounds take their default values."));
    schemas.insert("BaseBounds", Value::Object(given));
    for (name, usual) in TunedBounds::NAMES.iter().zip(TunedBounds::default().to_array()) {
        schemas.add("BaseBounds", name, &json!({ "default": usual }));
    }
    schemas.set("NewStudy", "base_bounds", json!({ "$ref": format!("{SCHEMAS}BaseBounds") }));
}

/// The ranges of EMG settings at the highest sampling rate; that of a file can narrow them.
fn state_emg(schemas: &mut Schemas<'_>) {
    // The widest range of the upper edge belongs to the lowest lower edge.
    let widest = EmgSettings { band_low_hz: 1.0, ..EmgSettings::default() };
    let found = settings(widest, |s: &EmgSettings| s.validate(1e6).err().map(Error::from));
    for (field, rule) in found["properties"].as_object().into_iter().flatten() {
        schemas.add("EmgSettings", field, rule);
    }
    for (field, usual) in
        serde_json::to_value(EmgSettings::default()).unwrap_or_default().as_object().into_iter().flatten()
    {
        schemas.add("EmgSettings", field, &json!({ "default": usual }));
    }
    schemas.set("EmgSettings", "order", json!({ "type": "integer", "enum": [2, 4, 6, 8], "default": 4 }));
    schemas.close("EmgSettings");
}

/// Settings whose durations leave each other the widest ranges; `x-depends` has the rule between them. Naturalness terms
/// are on, because they are absent otherwise.
fn widest_durations() -> GaitSettings {
    let naturalness = Naturalness { reference_weight: 1.0, trailing_load_share: 0.1 };
    let mut settings = GaitSettings { naturalness, ..GaitSettings::default() };
    let (least, most) = (&mut settings.limits.duration_min_s, &mut settings.limits.duration_max_s);
    (least.ds2, least.ds3, least.ss2, least.ss1) = (0.005, 0.005, 0.005, 0.005);
    (most.ds2, most.ds3, most.ss2, most.ss1) = (2.0, 2.0, 2.0, 2.0);
    settings
}

/// The schema of the options of a solve. The choice of a gait is a word, or an object with a percentage or a number.
fn solve_options(missed: &mut Vec<String>) -> Value {
    let of = |options: SolveOptions| settings(options, |s: &SolveOptions| s.validate().err().map(Error::from));
    let mut schema = of(SolveOptions::default());
    let word = json!({ "type": "string", "enum": [LocalOptimumChoice::LowestObjective] });
    let mut choices = vec![word];
    for (choice, described) in [
        (
            LocalOptimumChoice::NearestToReference { within_percent: 0.0 },
            [
                ("/properties/nearest_to_reference", "Takes the local optimum with the lowest Gait RMSE."),
                (
                    "/properties/nearest_to_reference/properties/within_percent",
                    "Largest excess over the lowest objective, %.",
                ),
            ],
        ),
        (
            LocalOptimumChoice::Numbered { number: 1 },
            [
                ("/properties/numbered", "Takes the local optimum with this number."),
                (
                    "/properties/numbered/properties/number",
                    "Number of the local optimum, in the order in which the initial guesses reached them, from 1.",
                ),
            ],
        ),
    ] {
        let options = SolveOptions { local_optimum_choice: choice, ..SolveOptions::default() };
        let mut object = of(options)["properties"]["local_optimum_choice"].take();
        for (place, text) in described {
            match object.pointer_mut(place) {
                Some(part) => part["description"] = json!(text),
                None => missed.push(format!("SolveOptions.local_optimum_choice{place}")),
            }
        }
        choices.push(object);
    }
    match schema.pointer_mut("/properties/local_optimum_choice") {
        Some(choice) => *choice = json!({ "oneOf": choices }),
        None => missed.push("SolveOptions.local_optimum_choice".to_owned()),
    }
    schema["properties"]["solver"] = openapi_solver_settings::schema();
    schema
}

/// The schema of the settings of the learner. Noises and thresholds have ranges in proportion to the signal: stated are
/// the widest ones, and `x-depends` has the rule.
fn learner(missed: &mut Vec<String>) -> Value {
    let usual = LearnerSettings::default();
    let with = |signal_variance: f64| {
        let share = signal_variance / usual.signal_variance;
        let deviation = share.sqrt();
        let scaled = LearnerSettings {
            signal_variance,
            nugget: usual.nugget * share,
            preference_noise: usual.preference_noise * deviation,
            ordinal_noise: usual.ordinal_noise * deviation,
            coactive_noise: usual.coactive_noise * deviation,
            no_difference_noise: usual.no_difference_noise * deviation,
            no_difference_width: usual.no_difference_width * deviation,
            ordinal_thresholds: usual.ordinal_thresholds.iter().map(|threshold| threshold * deviation).collect(),
            ..usual.clone()
        };
        settings(scaled, |s: &LearnerSettings| s.validate().err().map(Error::Learner))
    };
    let mut schema = with(usual.signal_variance);
    let (least, most) = (
        schema["properties"]["signal_variance"]["minimum"].as_f64(),
        schema["properties"]["signal_variance"]["maximum"].as_f64(),
    );
    if least.is_none() || most.is_none() {
        missed.push("LearnerSettings.signal_variance".to_owned());
    }
    for end in [least, most].into_iter().flatten() {
        widen(&mut schema, &with(end));
    }
    match schema.pointer_mut("/properties/ordinal_thresholds") {
        Some(thresholds) => (thresholds["minItems"], thresholds["maxItems"]) = (json!(1), json!(1)),
        None => missed.push("LearnerSettings.ordinal_thresholds".to_owned()),
    }
    schema
}

/// Widens every range of a schema to that of another one of the same shape.
fn widen(schema: &mut Value, other: &Value) {
    match (schema, other) {
        (Value::Object(fields), Value::Object(others)) => {
            for (name, other) in others {
                let Some(own) = fields.get_mut(name) else { continue };
                match (name.as_str(), own.as_f64(), other.as_f64()) {
                    ("minimum", Some(least), Some(than)) if than < least => *own = other.clone(),
                    ("maximum", Some(most), Some(than)) if than > most => *own = other.clone(),
                    _ => widen(own, other),
                }
            }
        }
        (Value::Array(items), Value::Array(others)) => {
            items.iter_mut().zip(others).for_each(|(own, other)| widen(own, other));
        }
        _ => {}
    }
}

fn state_parameter(path: &str, parameter: &mut Value) {
    // A header or query parameter is present or absent, but never null.
    if let Some(kind) = parameter.pointer_mut("/schema/type")
        && let Value::Array(kinds) = kind
        && let Some(own) = kinds.iter().find(|kind| *kind != "null").cloned()
    {
        *kind = own;
    }
    let rule = match parameter.get("name").and_then(Value::as_str).unwrap_or_default() {
        "rate_hz" => json!({ "minimum": 10, "maximum": 5000 }),
        "walk" => json!({ "minimum": 2, "maximum": 3 }),
        "after" | "Last-Event-ID" => json!({ "minimum": 0 }),
        "sort" => {
            let studies = StudyColumn::ALL.map(StudyColumn::as_str);
            let columns = if path.ends_with("/studies") { &studies[..] } else { &SORTS[..] };
            let names: Vec<String> = columns.iter().flat_map(|name| [(*name).to_owned(), format!("-{name}")]).collect();
            json!({ "enum": names })
        }
        "range" => json!({ "enum": RANGES }),
        "code" => json!({ "pattern": "^[0-9a-f]{64}$" }),
        "ids" => identifiers(2, 20),
        "other" if path.contains("/studies/") => identifiers(1, MAX_IN_A_CHART - 1),
        "other" => identifiers(1, MAX_OTHERS),
        "x" | "y" => json!({ "enum": TunedBounds::NAMES }),
        _ => return,
    };
    if let Some(schema) = parameter.get_mut("schema").and_then(Value::as_object_mut) {
        merge(schema, &rule);
    }
}

/// Comma-separated identifiers.
fn identifiers(least: usize, most: usize) -> Value {
    let id = "[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{12}";
    json!({ "pattern": format!("^{id}(,{id}){{{},{}}}$", least - 1, most - 1) })
}

/// Whether a schema says more of values than their types: a value of the right type can be refused.
pub(super) fn has_rules(schema: &Value, schemas: &Value) -> bool {
    const RULES: [&str; 8] =
        ["minimum", "maximum", "minLength", "maxLength", "pattern", "minItems", "maxItems", "x-depends"];
    match schema {
        Value::Object(fields) => {
            let named = fields.get("$ref").and_then(Value::as_str).and_then(|name| name.strip_prefix(SCHEMAS));
            named.is_some_and(|name| has_rules(&schemas[name], schemas))
                || RULES.iter().any(|rule| fields.contains_key(*rule))
                || fields.values().any(|part| has_rules(part, schemas))
        }
        Value::Array(parts) => parts.iter().any(|part| has_rules(part, schemas)),
        _ => false,
    }
}

/// The schema of a device file; no two devices have one name.
fn device(name: &str) -> Value {
    let mut properties = Map::new();
    properties.insert("name".to_owned(), json!({
        "type": "string", "minLength": 1, "maxLength": 80, "pattern": name, "x-depends": "A name that no other device has."
    }));
    properties.insert("carried_limb".to_owned(), json!({ "type": "boolean" }));
    for field in &Device::FIELDS {
        properties.insert(
            field.name.to_owned(),
            number(&sentence(field.meaning), field.minimum, field.maximum, &json!("number")),
        );
    }
    let required: Vec<String> = properties.keys().cloned().collect();
    let texts = json!({ "type": "object", "additionalProperties": { "type": "string" } });
    properties.insert("sources".to_owned(), texts);
    json!({ "type": "object", "properties": properties, "required": required, "additionalProperties": false })
}

/// The schema of muscle parameters: omitted values are the default ones, and a muscle has moment arms only at the
/// joints that it spans.
fn muscles() -> Value {
    let published = MuscleParameters::default();
    let mut properties = Map::new();
    properties.insert("scaled_to_body".to_owned(), json!({ "type": "boolean" }));
    let anybody = Subject { height_m: Subject::HEIGHT_RANGE_M.0, body_mass_kg: Subject::BODY_MASS_RANGE_KG.0 };
    for (kind, _) in published.overrides() {
        let Some(muscle) = published.muscle_of_kind(&anybody, kind) else { continue };
        let fields = MuscleOverride::FIELDS.iter().filter(|field| (field.value)(&muscle).is_some());
        let numbers: Map<String, Value> = fields
            .map(|f| {
                (f.name.to_owned(), number(&sentence(f.meaning), f.minimum, f.maximum, &json!(["number", "null"])))
            })
            .collect();
        let schema = json!({ "type": "object", "properties": numbers, "additionalProperties": false });
        properties.insert(kind.to_owned(), schema);
    }
    json!({ "type": "object", "properties": properties, "additionalProperties": false })
}

/// A label as the sentence of a description: `Mass of the adapter.`
fn sentence(label: &str) -> String {
    let mut rest = label.chars();
    let first = rest.next().map(|first| first.to_uppercase().to_string()).unwrap_or_default();
    format!("{first}{}.", rest.as_str())
}

fn number(meaning: &str, minimum: f64, maximum: f64, kind: &Value) -> Value {
    json!({ "type": kind, "description": meaning, "minimum": minimum, "maximum": maximum })
}
