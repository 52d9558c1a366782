//! Keyset pages of lists: a page says where the next one begins, so that it is as fast as the first.

use axum::Json;
use axum::http::{HeaderValue, header};
use axum::response::{IntoResponse, Response};
use gaitwright_service::error::Error;
use serde::{Deserialize, Serialize};

/// A page of what is older than something, newest first.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Before<K> {
    /// Where the page before ended.
    pub(crate) before: Option<K>,
    /// As given: what is no number at all is refused like one out of range.
    limit: Option<String>,
}

/// A page of what comes after something, in order.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct After<K> {
    /// Where the page before ended.
    pub(crate) after: Option<K>,
    limit: Option<String>,
}

impl<K> Before<K> {
    /// How many rows, by default as many as are allowed.
    pub(crate) fn limit(&self, most: u32) -> Result<u32, Error> {
        checked(self.limit.as_deref(), most)
    }
}

impl<K> After<K> {
    /// How many rows, by default as many as are allowed.
    pub(crate) fn limit(&self, most: u32) -> Result<u32, Error> {
        checked(self.limit.as_deref(), most)
    }

    /// How many rows, where a page of as many as are allowed is not what most ask for.
    pub(crate) fn limit_or(&self, default: u32, most: u32) -> Result<u32, Error> {
        if self.limit.is_some() { self.limit(most) } else { Ok(default) }
    }
}

/// How many rows, by default as many as are allowed.
pub(crate) fn checked(limit: Option<&str>, most: u32) -> Result<u32, Error> {
    let Some(text) = limit else { return Ok(most) };
    let refused = || Error::invalid("limit", text, &format!("1 to {most}"));
    text.parse().ok().filter(|limit| (1..=most).contains(limit)).ok_or_else(refused)
}

/// At most `limit` of the rows as JSON; with more of them, a `Link` header to the page `before` the last one.
pub(crate) fn linked<T: Serialize>(path: &str, rows: Vec<T>, limit: u32, key: impl Fn(&T) -> String) -> Response {
    page(path, "before", rows, limit, key)
}

/// The same for the page `after` the last one.
pub(crate) fn linked_after<T: Serialize>(path: &str, rows: Vec<T>, limit: u32, key: impl Fn(&T) -> String) -> Response {
    page(path, "after", rows, limit, key)
}

/// The same as [`linked`], and the next page is chosen by the same parameters.
pub(crate) fn linked_with<T: Serialize>(
    path: &str,
    chosen: &[(&str, &str)],
    rows: Vec<T>,
    limit: u32,
    key: impl Fn(&T) -> String,
) -> Response {
    let chosen = serde_urlencoded::to_string(chosen).unwrap_or_default();
    let parameter = if chosen.is_empty() { "before".to_owned() } else { format!("{chosen}&before") };
    page(path, &parameter, rows, limit, key)
}

fn page<T: Serialize>(
    path: &str,
    parameter: &str,
    mut rows: Vec<T>,
    limit: u32,
    key: impl Fn(&T) -> String,
) -> Response {
    let more = rows.len() > limit as usize;
    rows.truncate(limit as usize);
    let next = rows.last().filter(|_| more).map(key);
    let mut answer = Json(rows).into_response();
    let link = next.map(|key| format!("<{path}?{parameter}={key}&limit={limit}>; rel=\"next\""));
    if let Some(link) = link.and_then(|text| HeaderValue::from_str(&text).ok()) {
        answer.headers_mut().insert(header::LINK, link);
    }
    answer
}
