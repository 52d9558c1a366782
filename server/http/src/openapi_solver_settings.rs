//! The schema of the settings of the interior-point solver. They are absent from the default options of a solve, so it
//! cannot be found by asking their checks; a test sends the ends of each range.

use super::openapi_schemas::merge;
use serde_json::{Map, Value, json};

/// A setting that is a number: name, smallest and largest value, description.
const NUMBERS: [(&str, f64, f64, &str); 5] = [
    (
        "bound_relaxation",
        0.0,
        1e-6,
        "Relaxation of every bound, relative to the larger of 1 and the bound. Default 1e-8.",
    ),
    (
        "bound_push",
        f64::MIN_POSITIVE,
        0.5,
        "Minimum distance of a cold start from its bounds, relative to the larger of 1 and the bound, and to the distance \
         between two bounds. Default 0.1.",
    ),
    ("hessian_regularisation_first", f64::MIN_POSITIVE, f64::MAX, "First regularisation of the Hessian. Default 1e-4."),
    (
        "proximal_first",
        0.0,
        1e4,
        "Initial weight of the proximal term after a step that the line search shortened many times. Default 1e-4. 0 \
         disables the term.",
    ),
    (
        "required_reduction",
        0.0,
        0.999_999,
        "Share of the violation at which the restoration phase ends if the filter accepts the point. Default 0.9.",
    ),
];

/// A setting that is a count: name and description.
const COUNTS: [(&str, &str); 3] = [
    (
        "regularisation_memory",
        "After the unregularised matrix has had the wrong inertia twice in a row, this many iterations start from a \
         reduced regularisation. Each further time adds one iteration. Default 4.",
    ),
    ("max_second_order_corrections", "Maximum number of second-order corrections in each iteration. Default 1."),
    (
        "short_step_limit",
        "Number of consecutive steps below 0.05 after which the restoration phase starts. Default 5. With 0, short \
         steps do not start it.",
    ),
];

/// A setting that is a word: name, words and description.
const WORDS: [(&str, &[&str], &str); 2] = [
    (
        "bound_multiplier_start",
        &["centred", "one"],
        "Bound multipliers of a cold start: `centred`, on the central path; `one`, all 1. Default `centred`.",
    ),
    (
        "linear_solver",
        &["auto", "multifrontal", "delayed_pivots"],
        "Factorisation of the linear systems: `multifrontal`, pivots within blocks; `delayed_pivots`, pivots by a threshold, \
         slower; `auto`, `multifrontal`, or `delayed_pivots` where the former is inaccurate. Default `auto`.",
    ),
];

/// The schema of `SolveOptions.solver`.
pub(super) fn schema() -> Value {
    let mut properties = Map::new();
    let mut add = |name: &str, text: &str, rule: &Value| {
        let mut property = Map::new();
        merge(&mut property, &json!({ "description": text }));
        merge(&mut property, rule);
        properties.insert(name.to_owned(), Value::Object(property));
    };
    for (name, least, most, text) in NUMBERS {
        add(name, text, &json!({ "type": "number", "minimum": least, "maximum": most }));
    }
    for (name, text) in COUNTS {
        add(name, text, &json!({ "type": "integer", "minimum": 0 }));
    }
    for (name, words, text) in WORDS {
        add(name, text, &json!({ "type": "string", "enum": words }));
    }
    json!({
        "type": "object",
        "description": "Settings of the interior-point solver. Absent settings have their default values.",
        "properties": properties,
        "additionalProperties": false,
    })
}
