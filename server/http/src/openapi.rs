//! Generates the OpenAPI 3.1 description of the REST interface from the handlers.
//!
//! The parts that all operations share are added here, so that no handler can omit them: problem documents, paging
//! parameters, the Idempotency-Key of every change whose response contains no secret, rules of values, and security
//! schemes.

use super::paging::{DEFAULT_LIMIT, MAX_LIMIT};
use super::problem_details::{PROBLEM_JSON, Problem};
use super::{api, openapi_dependent_rules, openapi_nulls, openapi_rules, saved_as};
use serde_json::{Map, Value, json};
use utoipa::openapi::OpenApi;
use utoipa::openapi::security::{ApiKey, ApiKeyValue, Http, HttpAuthScheme, SecurityScheme};
use utoipa::{OpenApi as _, PartialSchema, ToSchema};
use utoipa_axum::router::OpenApiRouter;

#[derive(utoipa::OpenApi)]
#[openapi(
    info(
        title = "Gaitwright",
        description = "A service that tunes walking gaits for powered prostheses by preference learning. Research software; \
                       not a medical device.\n\n*The paper* and *the published method* refer to Li, Tucker, Gehlhar, Yue, \
                       Ames, *Natural Multicontact Walking for Robotic Assistive Devices via Musculoskeletal Models and \
                       Hybrid Zero Dynamics*, IEEE Robotics and Automation Letters, 2022.\n\nLengths are in metres, masses \
                       in kilograms and angles in radians, unless a name or a description says otherwise. Times are in UTC \
                       (RFC 3339).\n\nLists are paginated: \
                       `items` has the entries, and `next` is the `cursor` of the next page, which has the same \
                       filters and order. An unknown query parameter is refused (400), and so is a value that a \
                       parameter does not accept (422).",
        license(name = "MIT OR Apache-2.0", identifier = "MIT OR Apache-2.0")
    ),
    servers((url = "/")),
    tags(
        (name = "access", description = "Users, tokens, sign-in sessions, and members of studies."),
        (name = "blind", description = "Blind pairs: two gaits that a rater compares without knowing which trials they are."),
        (name = "devices", description = "Models of powered prostheses."),
        (name = "figures", description = "Charts of studies, trials, lab sessions and reference gaits."),
        (name = "health", description = "State of the service, for monitoring."),
        (name = "lab", description = "Lab sessions: plans, walks, answers, measurement files and unblinding."),
        (name = "operation", description = "Operation of the service: audit trail, access log, jobs, workers and backups."),
        (
            name = "preferences",
            description = "Answers about gaits: preferences, assessments, suggestions, safety reports and their reviews."
        ),
        (name = "reference-gaits", description = "Gaits against which Gait RMSE is measured."),
        (name = "scripts", description = "Trials that lab scripts ask for and evaluate."),
        (name = "studies", description = "Tuning runs."),
        (name = "subjects", description = "People who walk: height and mass, consent and muscle values."),
        (name = "trials", description = "Evaluated actions of a study, and their gaits.")
    )
)]
struct ApiDescription;

/// Marks an operation whose response contains a secret. It takes no Idempotency-Key.
const SHOWN_ONCE: &str = "x-shown-once";

/// Prefix of the names that utoipa gives to pages, such as `Page_Trial`.
const PAGE: &str = "Page_";

/// Every route below `/api/v1` as its handler describes it.
fn document() -> OpenApi {
    let (_, mut document) =
        OpenApiRouter::with_openapi(ApiDescription::openapi()).nest("/api/v1", api::routes()).split_for_parts();
    let components = document.components.get_or_insert_default();
    components.schemas.insert(Problem::name().into_owned(), Problem::schema());
    let token = Http::builder().scheme(HttpAuthScheme::Bearer).description(Some("Token created by an administrator"));
    components.security_schemes.insert("token".to_owned(), SecurityScheme::Http(token.build()).into());
    let cookie = ApiKeyValue::with_description("gaitwright_session", "Session of a signed-in user");
    components.security_schemes.insert("session".to_owned(), SecurityScheme::ApiKey(ApiKey::Cookie(cookie)).into());
    document
}

/// The description.
///
/// # Errors
/// When it cannot be written as JSON.
pub(super) fn value() -> Result<Value, serde_json::Error> {
    Ok(with_missed_rules()?.0)
}

/// The description, and the rules that apply to nothing in it.
fn with_missed_rules() -> Result<(Value, Vec<String>), serde_json::Error> {
    let mut value = serde_json::to_value(document())?;
    refer_to_entries(&mut value);
    let mut value = name_pages(value);
    let missed = openapi_rules::state(&mut value);
    openapi_nulls::require_in_responses(&mut value);
    let schemas = value["components"]["schemas"].clone();
    for (_, item) in value["paths"].as_object_mut().into_iter().flatten() {
        for (method, operation) in item.as_object_mut().into_iter().flatten() {
            complete(operation, method, &schemas);
        }
    }
    Ok((value, missed))
}

/// The description as it is served and committed.
///
/// # Errors
/// When it cannot be written as JSON.
pub fn text() -> Result<String, serde_json::Error> {
    let mut text = serde_json::to_string_pretty(&value()?)?;
    text.push('\n');
    Ok(text)
}

/// Makes pages refer to the schema of their entries instead of repeating it.
fn refer_to_entries(document: &mut Value) {
    for (name, schema) in document["components"]["schemas"].as_object_mut().into_iter().flatten() {
        if let (Some(entry), Some(items)) = (name.strip_prefix(PAGE), schema.pointer_mut("/properties/items/items")) {
            *items = json!({ "$ref": format!("{}{entry}", openapi_rules::SCHEMAS) });
        }
    }
}

/// Renames the schemas of pages: a page of trials is `TrialPage`.
fn name_pages(value: Value) -> Value {
    let named = |name: &str| name.strip_prefix(PAGE).map(|entry| format!("{entry}Page"));
    match value {
        Value::Object(fields) => {
            let fields = fields.into_iter().map(|(name, value)| (named(&name).unwrap_or(name), name_pages(value)));
            Value::Object(fields.collect())
        }
        Value::Array(items) => items.into_iter().map(name_pages).collect(),
        Value::String(text) => {
            let page = text.strip_prefix(openapi_rules::SCHEMAS).and_then(named);
            Value::String(page.map_or(text, |page| format!("{}{page}", openapi_rules::SCHEMAS)))
        }
        other => other,
    }
}

/// Adds the common responses and parameters of an operation.
fn complete(operation: &mut Value, method: &str, schemas: &Value) {
    let changes = method != "get";
    let shown_once = operation.get(SHOWN_ONCE).is_some();
    let is_page = operation
        .pointer("/responses/200/content/application~1json/schema/$ref")
        .is_some_and(|reference| reference.as_str().is_some_and(|reference| reference.ends_with("Page")));
    let mut parameters = operation["parameters"].as_array().cloned().unwrap_or_default();
    let takes = |place: &str, parameters: &[Value]| parameters.iter().any(|parameter| parameter["in"] == place);
    let if_match = parameters.iter().any(|parameter| parameter["name"] == "If-Match");
    if is_page {
        parameters.push(json!({
            "name": "cursor", "in": "query", "required": false,
            "schema": { "type": "string", "minLength": 18, "pattern": "^([0-9a-f]{2})+$" },
            "description": "The value of `next` from the previous page, with the same filters and order; omit it for the first page"
        }));
        parameters.push(json!({
            "name": "limit", "in": "query", "required": false,
            "schema": { "type": "integer", "format": "int32", "minimum": 1, "maximum": MAX_LIMIT, "default": DEFAULT_LIMIT },
            "description": "Maximum number of entries on the page"
        }));
    }
    if !changes && operation.pointer("/responses/200/content/application~1json").is_some() {
        parameters.push(json!({
            "name": saved_as::PARAMETER, "in": "query", "required": false,
            "schema": { "type": "string", "pattern": saved_as::PATTERN, "maxLength": saved_as::MAX_LENGTH },
            "description": "Name of the file, such as `trial.json`, as which a browser saves the response"
        }));
    }
    parameters.iter_mut().for_each(openapi_dependent_rules::state_parameter);
    if changes && !shown_once {
        parameters.push(json!({
            "name": "Idempotency-Key", "in": "header", "required": false,
            "schema": { "type": "string", "minLength": 1, "maxLength": 200, "pattern": "^[!-~]([ -~]*[!-~])?$" },
            "description": "A request repeated with the same key takes effect only once and gets the same response"
        }));
    }
    let body = operation.pointer("/requestBody/content/application~1json/schema");
    let needs_fields = |schema: &Value| {
        let name = schema["$ref"].as_str().and_then(|path| path.strip_prefix(openapi_rules::SCHEMAS));
        name.is_none_or(|name| schemas[name].get("required").is_some())
    };
    let may_be_absent = method == "post" && body.is_some_and(|schema| !needs_fields(schema));
    let (has_body, has_rules) = (body.is_some(), body.is_some_and(|schema| openapi_rules::has_rules(schema, schemas)));
    let has_query = takes("query", &parameters);
    let mut problems = vec![("500", "Internal error"), ("503", "Timed out or not ready")];
    // Every operation refuses a query parameter that it does not have.
    problems.push(("400", "The request cannot be read"));
    // A host name that the service does not answer to is refused before anything else.
    problems.push(("403", "Not allowed"));
    match operation.get("security") {
        Some(_) => problems.push(("401", "The session or token is missing or not valid")),
        None => operation["security"] = json!([]),
    }
    if takes("path", &parameters) {
        problems.push(("404", "Not found"));
    }
    if changes {
        problems.push(("409", "Conflict with the current state"));
        problems.push(("507", "Not enough disk space"));
    }
    if if_match {
        problems.push(("412", "Changed since it was read"));
    }
    if has_body {
        problems.push(("413", "The body is too large"));
        problems.push(("415", "Unsupported media type"));
    }
    if has_query || has_rules {
        problems.push(("422", "Invalid field or parameter"));
    }
    if !parameters.is_empty() {
        operation["parameters"] = Value::Array(parameters);
    }
    if may_be_absent {
        operation["requestBody"]["required"] = json!(false);
    }
    // No token can have the right to administer.
    if let Some(ways) = operation["security"].as_array_mut() {
        ways.retain(|way| way.get("token").is_none_or(|scopes| scopes != &json!(["administer"])));
    }
    let Some(responses) = operation["responses"].as_object_mut() else { return };
    for (status, description) in problems {
        responses.entry(status).or_insert_with(|| json!({ "description": description }));
    }
    for (status, of) in [("201", "the new object, or of the list or object that contains it"), ("202", "the job")] {
        if let Some(response) = responses.get_mut(status) {
            response["headers"]["Location"] =
                json!({ "description": format!("URL of {of}"), "schema": { "type": "string" } });
        }
    }
    answer_problems(responses);
}

/// Every refusal and failure is answered with a problem document.
fn answer_problems(responses: &mut Map<String, Value>) {
    let problem =
        json!({ PROBLEM_JSON: { "schema": { "$ref": format!("{}{}", openapi_rules::SCHEMAS, Problem::name()) } } });
    for (_, response) in responses.iter_mut().filter(|(status, _)| status.starts_with(['4', '5'])) {
        response["content"] = problem.clone();
    }
}

#[cfg(test)]
mod tests {
    use super::with_missed_rules;

    #[test]
    fn every_rule_finds_its_component_field_or_parameter() {
        let missed = with_missed_rules().unwrap().1;
        assert!(missed.is_empty(), "these rules apply to nothing: {missed:?}");
    }
}
