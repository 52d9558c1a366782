//! The form that chooses the units of heights and body masses for the browser.

use crate::authorization::Authorized;
use crate::extractors::Form;
use crate::page_error::PageError;
use crate::units::Units;
use axum::http::header;
use axum::response::{AppendHeaders, IntoResponse, Redirect, Response};
use gaitwright_service::access::Read;
use serde::Deserialize;

#[derive(Debug, Deserialize)]
pub(super) struct Chosen {
    units: Units,
}

/// `POST /units`.
pub(super) async fn post(_: Authorized<Read>, Form(chosen): Form<Chosen>) -> Result<Response, PageError> {
    let cookie = AppendHeaders([(header::SET_COOKIE, chosen.units.cookie()?)]);
    Ok((cookie, Redirect::to("/subjects")).into_response())
}
