//! `?download=NAME` of a GET request of the REST interface: a browser saves the response as a file of this name. For the
//! access log, the response is then an export.

use super::attachment::disposition;
use super::query_string;
use crate::problem_details::Refusal;
use axum::extract::Request;
use axum::http::{Method, Uri, header};
use axum::middleware::Next;
use axum::response::Response;
use gaitwright_service::error::Error;

/// The parameter.
pub(super) const PARAMETER: &str = "download";
/// The names that it accepts, as a pattern.
pub(super) const PATTERN: &str = r"^[\p{L}\p{N}][\p{L}\p{N}._-]*\.json$";
/// Maximum length of a name, characters.
pub(super) const MAX_LENGTH: usize = 200;

/// Marks a request whose response is saved under a name.
#[derive(Debug, Clone, Copy)]
pub(super) struct SavedByBrowser;

/// Takes the name out of the query, which handlers read strictly, and gives it to the JSON response. Operations with other
/// responses name their files themselves and refuse it (`described_parameters`).
pub(super) async fn name(mut request: Request, next: Next) -> Result<Response, Refusal> {
    let reads = matches!(*request.method(), Method::GET | Method::HEAD);
    if !reads || !request.uri().path().starts_with("/api/v1/") {
        return Ok(next.run(request).await);
    }
    let Some((name, rest)) = taken_from(request.uri())? else { return Ok(next.run(request).await) };
    *request.uri_mut() = rest;
    request.extensions_mut().insert(SavedByBrowser);
    let mut response = next.run(request).await;
    let is_json = response.headers().get(header::CONTENT_TYPE).is_some_and(|kind| kind == "application/json");
    if response.status().is_success() && is_json && !response.headers().contains_key(header::CONTENT_DISPOSITION) {
        response.headers_mut().insert(header::CONTENT_DISPOSITION, disposition(&name));
    }
    Ok(response)
}

/// The name in a query, and the address without it.
fn taken_from(uri: &Uri) -> Result<Option<(String, Uri)>, Error> {
    let is_name = |part: &&str| part.split('=').next() == Some(PARAMETER);
    let (names, others): (Vec<&str>, Vec<&str>) = uri.query().unwrap_or_default().split('&').partition(is_name);
    let name = match names[..] {
        [] => return Ok(None),
        [name] => query_string::pairs(name)?.into_iter().map(|(_, value)| value).next().unwrap_or_default(),
        _ => return Err(Error::Malformed(query_string::occurs_twice(PARAMETER))),
    };
    if !is_allowed(&name) {
        let allowed =
            format!("the name of a .json file: at most {MAX_LENGTH} letters, digits, dots, hyphens and underscores");
        return Err(Error::invalid(PARAMETER, name, &allowed));
    }
    let path = uri.path();
    let rest = if others.is_empty() { path.to_owned() } else { format!("{path}?{}", others.join("&")) };
    Ok(Some((name, rest.parse().map_err(|error| Error::Malformed(format!("The query cannot be read: {error}.")))?)))
}

/// Whether it names a JSON file, in whatever folder a browser saves it.
fn is_allowed(name: &str) -> bool {
    let known = |c: char| c.is_alphanumeric() || matches!(c, '-' | '.' | '_');
    let stem = name.strip_suffix(".json").unwrap_or_default();
    stem.starts_with(char::is_alphanumeric) && stem.chars().all(known) && name.chars().count() <= MAX_LENGTH
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn name_is_taken_out_of_the_query() {
        let taken = |query: &str| {
            let uri: Uri = format!("/api/v1/trials/1{query}").parse().unwrap();
            taken_from(&uri).map(|taken| taken.map(|(name, rest)| (name, rest.to_string())))
        };
        let found = |name: &str, rest: &str| Some((name.to_owned(), format!("/api/v1/trials/1{rest}")));
        assert_eq!(taken("").unwrap(), None);
        assert_eq!(taken("?limit=2").unwrap(), None);
        assert_eq!(taken("?download=trial-1.json").unwrap(), found("trial-1.json", ""));
        assert_eq!(taken("?limit=2&download=a.json&sort=-a1").unwrap(), found("a.json", "?limit=2&sort=-a1"));
        assert_eq!(taken("?download=F%C3%BC%C3%9Fe.json").unwrap(), found("Füße.json", ""));
        for refused in
            ["", "=", "=a", "=.json", "=..json", "=../a.json", "=a%22.json", "=a%0D%0A.json", "=a.json&download=b.json"]
        {
            assert!(taken(&format!("?download{refused}")).is_err(), "{refused}");
        }
        assert!(taken(&format!("?download={}.json", "a".repeat(MAX_LENGTH))).is_err());
    }
}
