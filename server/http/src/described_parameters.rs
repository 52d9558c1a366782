//! Refuses query parameters that the description of an operation does not have. No operation of the REST interface is left
//! to ignore a misspelt filter, because this happens before its handler runs.

use super::{openapi, query_string};
use crate::problem_details::Refusal;
use crate::saved_as::{self, SavedByBrowser};
use axum::extract::{MatchedPath, Request};
use axum::http::Method;
use axum::middleware::Next;
use axum::response::Response;
use gaitwright_service::error::Error;
use serde_json::Value;
use std::collections::HashMap;
use std::sync::LazyLock;

/// Names of the query parameters, by method in small letters and path.
type QueryParameters = HashMap<(String, String), Vec<String>>;

static DESCRIBED: LazyLock<Result<QueryParameters, String>> =
    LazyLock::new(|| openapi::value().map(|document| described(&document)).map_err(|error| error.to_string()));

/// Checks the query of a request to an operation.
pub(super) async fn check(request: Request, next: Next) -> Result<Response, Refusal> {
    let described = DESCRIBED.as_ref().map_err(|error| Error::Internal(error.clone()))?;
    let method = if request.method() == Method::HEAD { &Method::GET } else { request.method() };
    let path = request.extensions().get::<MatchedPath>().map_or("", MatchedPath::as_str);
    // An operation that is not described has a method that the path does not accept.
    if let Some(known) = described.get(&(method.as_str().to_lowercase(), path.to_owned())) {
        let unknown = |name: &str, value| query_string::unknown(name, value, known.iter().map(String::as_str));
        for (name, value) in query_string::pairs(request.uri().query().unwrap_or_default())? {
            if !known.contains(&name) {
                return Err(unknown(&name, Some(&value)).into());
            }
        }
        let is_saved = request.extensions().get::<SavedByBrowser>().is_some();
        if is_saved && !known.iter().any(|name| name == saved_as::PARAMETER) {
            return Err(unknown(saved_as::PARAMETER, None).into());
        }
    }
    Ok(next.run(request).await)
}

fn described(document: &Value) -> QueryParameters {
    let mut all = QueryParameters::new();
    for (path, item) in document["paths"].as_object().into_iter().flatten() {
        for (method, operation) in item.as_object().into_iter().flatten() {
            let parameters = operation["parameters"].as_array().into_iter().flatten();
            let of_query = parameters.filter(|parameter| parameter["in"] == "query");
            let names = of_query.filter_map(|parameter| parameter["name"].as_str()).map(str::to_owned).collect();
            all.insert((method.clone(), path.clone()), names);
        }
    }
    all
}
