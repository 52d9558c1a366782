//! Entity tags and If-Match: refuses a change that was based on an old revision.

use crate::problem_details::Refusal;
use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use axum::http::{HeaderValue, header};
use axum::response::Response;
use gaitwright_service::error::Error;
use utoipa::IntoParams;
use utoipa::openapi::Required;
use utoipa::openapi::path::{Parameter, ParameterBuilder, ParameterIn};
use utoipa::openapi::schema::{ObjectBuilder, Type};

/// The If-Match header. Without it, any revision matches.
#[derive(Debug)]
pub(crate) struct IfMatch(Option<String>);

impl IfMatch {
    /// Refuses the change if the current revision does not match.
    pub(crate) fn check(self, present: i64) -> Result<(), Error> {
        let Some(named) = self.0 else { return Ok(()) };
        let tag = format!("\"{present}\"");
        // A weak tag never matches, because it does not guarantee equality.
        if named.split(',').map(str::trim).any(|one| one == "*" || one == tag) {
            return Ok(());
        }
        let reason = format!(
            "If-Match is {named}, but the current revision is {tag}. Read the current state, then decide whether to make the change."
        );
        Err(Error::Changed(reason))
    }
}

impl<S: Send + Sync> FromRequestParts<S> for IfMatch {
    type Rejection = Refusal;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Refusal> {
        let lines: Vec<_> = parts.headers.get_all(header::IF_MATCH).iter().map(|v| v.to_str().unwrap_or("?")).collect();
        Ok(Self((!lines.is_empty()).then(|| lines.join(", "))))
    }
}

impl IntoParams for IfMatch {
    fn into_params(_: impl Fn() -> Option<ParameterIn>) -> Vec<Parameter> {
        let text = ObjectBuilder::new().schema_type(Type::String).build();
        vec![
            ParameterBuilder::new()
                .name("If-Match")
                .parameter_in(ParameterIn::Header)
                .required(Required::False)
                .description(Some("Entity tag of the revision that the change is based on"))
                .schema(Some(text))
                .build(),
        ]
    }
}

/// Adds the entity tag of a revision.
pub(crate) fn tagged(mut answer: Response, revision: i64) -> Response {
    if let Ok(tag) = HeaderValue::from_str(&format!("\"{revision}\"")) {
        answer.headers_mut().insert(header::ETAG, tag);
    }
    answer
}
