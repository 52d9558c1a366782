//! Generates the OpenAPI 3.1 description of the REST interface from the handlers.
//!
//! What holds for every operation is added here, so that no handler can forget it: the problem documents, the
//! Idempotency-Key of every change whose answer holds no secret, the rules of values, the ways to say who calls.

use super::problem::{PROBLEM_JSON, Problem};
use super::{api, openapi_rules};
use serde_json::Value;
use utoipa::openapi::path::{Operation, ParameterBuilder, ParameterIn};
use utoipa::openapi::schema::{ObjectBuilder, Type};
use utoipa::openapi::security::{ApiKey, ApiKeyValue, Http, HttpAuthScheme, SecurityScheme};
use utoipa::openapi::{ContentBuilder, OpenApi, Ref, RefOr, Required, ResponseBuilder};
use utoipa::{OpenApi as _, PartialSchema, ToSchema};
use utoipa_axum::router::OpenApiRouter;

#[derive(utoipa::OpenApi)]
#[openapi(
    info(
        title = "Gaitwright",
        description = "A preference-learning tuning service for walking gaits of powered prostheses. Research software; \
                       not a medical device.\n\nLengths are metres, masses kilograms, angles radians unless a name says \
                       otherwise, times RFC 3339 in UTC.",
        license(name = "MIT OR Apache-2.0")
    ),
    servers((url = "/"))
)]
struct Described;

/// Marks an operation whose response contains a secret. It takes no Idempotency-Key.
const SHOWN_ONCE: &str = "x-shown-once";

/// The description of every route below `/api/v1`.
pub fn document() -> OpenApi {
    let (_, mut document) =
        OpenApiRouter::with_openapi(Described::openapi()).nest("/api/v1", api::routes()).split_for_parts();
    let components = document.components.get_or_insert_default();
    components.schemas.insert(Problem::name().into_owned(), Problem::schema());
    let token = Http::builder().scheme(HttpAuthScheme::Bearer).description(Some("Token created by an administrator"));
    components.security_schemes.insert("token".to_owned(), SecurityScheme::Http(token.build()).into());
    let cookie = ApiKeyValue::with_description("gaitwright_session", "Session of a signed-in user");
    components.security_schemes.insert("session".to_owned(), SecurityScheme::ApiKey(ApiKey::Cookie(cookie)).into());
    for (path, item) in &mut document.paths.paths {
        let has_parameters = path.contains('{');
        for operation in [&mut item.get].into_iter().flatten() {
            complete(operation, false, has_parameters);
        }
        for operation in [&mut item.post, &mut item.patch].into_iter().flatten() {
            complete(operation, true, has_parameters);
        }
    }
    document
}

/// The document with the rules of values.
///
/// # Errors
/// When it cannot be written as JSON.
pub(super) fn value() -> Result<Value, serde_json::Error> {
    let mut value = serde_json::to_value(document())?;
    openapi_rules::state(&mut value);
    Ok(value)
}

/// The document as it is served and committed.
///
/// # Errors
/// When it cannot be written as JSON.
pub fn text() -> Result<String, serde_json::Error> {
    let mut text = serde_json::to_string_pretty(&value()?)?;
    text.push('\n');
    Ok(text)
}

/// Adds what every operation may answer and take.
fn complete(operation: &mut Operation, changes: bool, names_something: bool) {
    let protected = operation.security.is_some();
    let mut problems = vec![("500", "The program failed; nothing was changed"), ("503", "Too slow or shutting down")];
    if operation.parameters.is_some() || changes {
        problems.push(("400", "The request cannot be read"));
    }
    if protected {
        problems.push(("401", "Sign in first"));
        problems.push(("403", "Not allowed"));
    }
    let names_several = operation
        .parameters
        .iter()
        .flatten()
        .any(|parameter| matches!(parameter, RefOr::T(parameter) if parameter.name == "ids"));
    if names_something || names_several || changes {
        problems.push(("404", "Not found"));
    }
    if changes || operation.parameters.is_some() {
        problems.push(("409", "Not possible in the present state"));
    }
    if changes {
        problems.push(("412", "It was changed since it was read"));
        problems.push(("413", "The body is too large"));
        problems.push(("415", "Unsupported media type"));
    }
    if changes || operation.parameters.is_some() {
        problems.push(("422", "A field is not acceptable"));
    }
    for (status, description) in problems {
        let content = ContentBuilder::new().schema(Some(Ref::from_schema_name(Problem::name()))).build();
        let response = ResponseBuilder::new().description(description).content(PROBLEM_JSON, content).build();
        operation.responses.responses.entry(status.to_owned()).or_insert_with(|| response.into());
    }
    let shown_once = operation.extensions.as_ref().is_some_and(|extensions| extensions.contains_key(SHOWN_ONCE));
    if changes && !shown_once {
        let text = ObjectBuilder::new().schema_type(Type::String).min_length(Some(1)).max_length(Some(200)).build();
        let key = ParameterBuilder::new()
            .name("Idempotency-Key")
            .parameter_in(ParameterIn::Header)
            .required(Required::False)
            .description(Some("Sent twice with the same key, a request has one effect and the same answer"))
            .schema(Some(text))
            .build();
        operation.parameters.get_or_insert_default().push(key.into());
    }
}
