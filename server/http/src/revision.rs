//! Entity tags of what changes in place: a change that names the revision it was made from is refused when another
//! one came in between.

use crate::problem::Refusal;
use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use axum::http::{HeaderValue, header};
use axum::response::Response;
use gaitwright_service::error::Error;
use utoipa::IntoParams;
use utoipa::openapi::Required;
use utoipa::openapi::path::{Parameter, ParameterBuilder, ParameterIn};
use utoipa::openapi::schema::{ObjectBuilder, Type};

/// The revisions that a change may be made from; without the header, any.
#[derive(Debug)]
pub(crate) struct IfMatch(Option<String>);

impl IfMatch {
    /// Refuses when the present revision is another one.
    pub(crate) fn check(self, present: i64) -> Result<(), Error> {
        let Some(named) = self.0 else { return Ok(()) };
        let tag = format!("\"{present}\"");
        // A weak tag never matches: it does not say that nothing changed.
        if named.split(',').map(str::trim).any(|one| one == "*" || one == tag) {
            return Ok(());
        }
        let reason =
            format!("If-Match names revision {named}, the present one is {tag}: read it again and decide anew");
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
                .description(Some("The entity tag that the change was made from"))
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
