//! Signing in and out, and a person's own account.

use super::error::{Page, PageError, page};
use crate::access::{Caller, Role, people, secret, sign_in};
use crate::error::Error;
use crate::http::AppState;
use crate::http::extract::Form;
use crate::http::identify::{cookie, session_of};
use crate::store::{commit, users};
use askama::Template;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Redirect, Response};
use serde::Deserialize;
use std::time::Instant;

#[derive(Template)]
#[template(path = "sign_in.html")]
struct SignInPage {
    refused: Option<String>,
    name: String,
}

#[derive(Template)]
#[template(path = "sign_in_link.html")]
struct LinkPage {
    link: String,
}

#[derive(Template)]
#[template(path = "no_account.html")]
struct NoAccountPage;

#[derive(Template)]
#[template(path = "account.html")]
struct AccountPage {
    name: String,
    role: &'static str,
    shortest: usize,
    refused: Option<String>,
    saved: bool,
}

/// `GET /sign-in`.
pub(super) async fn get() -> Page {
    page(&SignInPage { refused: None, name: String::new() })
}

/// Name and password.
#[derive(Deserialize)]
pub(super) struct Credentials {
    name: String,
    password: String,
}

/// `POST /sign-in`.
pub(super) async fn post(State(app): State<AppState>, Form(form): Form<Credentials>) -> Result<Response, PageError> {
    let name = form.name.trim().to_owned();
    if let Err(wait) = app.access.back_off.begin(&name, Instant::now()) {
        return Err(Error::TooManyAttempts(wait.as_secs().max(1)).into());
    }
    let user = users::by_name(&mut *app.read().await?, &name).await?.filter(|user| user.disabled_at.is_none());
    let stored = user.as_ref().and_then(|user| user.password.clone());
    let right = secret::aside(move || secret::is_password(&form.password, stored.as_deref())).await?;
    let mut writer = app.write().await?;
    if let (true, Some(user)) = (right, user) {
        app.access.back_off.succeeded(&name);
        let session = sign_in::with_password(&mut writer, &user).await?;
        commit(writer).await?;
        return signed_in(&app, &session, user.role);
    }
    app.access.back_off.failed(&name, Instant::now());
    sign_in::failed(&mut writer, &name).await?;
    commit(writer).await?;
    let refused = Some("name or password is not right".to_owned());
    Ok((StatusCode::UNAUTHORIZED, page(&SignInPage { refused, name })?).into_response())
}

/// `GET /sign-in/{link}`: a button, so that whatever only looks at the link does not use it up.
pub(super) async fn link(Path(link): Path<String>) -> Page {
    page(&LinkPage { link })
}

/// `POST /sign-in/{link}`.
pub(super) async fn use_link(State(app): State<AppState>, Path(link): Path<String>) -> Result<Response, PageError> {
    let mut writer = app.write().await?;
    let (user, session) = match sign_in::with_link(&mut writer, &link).await {
        Err(Error::NotSignedIn(reason)) => {
            let refused = page(&SignInPage { refused: Some(reason), name: String::new() })?;
            return Ok((StatusCode::UNAUTHORIZED, refused).into_response());
        }
        found => found?,
    };
    commit(writer).await?;
    signed_in(&app, &session, user.role)
}

fn signed_in(app: &AppState, session: &str, role: Role) -> Result<Response, PageError> {
    let to = if role == Role::Rater { "/rate" } else { "/" };
    Ok(([(header::SET_COOKIE, cookie(Some(session), app.access.secure)?)], Redirect::to(to)).into_response())
}

/// `POST /sign-out`.
pub(super) async fn out(
    State(app): State<AppState>,
    caller: Option<Caller>,
    headers: HeaderMap,
) -> Result<Response, PageError> {
    if let (Some(caller), Some(session)) = (caller, session_of(&headers)) {
        let mut writer = app.write().await?;
        sign_in::out(&mut writer, &caller.actor, session).await?;
        commit(writer).await?;
    }
    Ok(([(header::SET_COOKIE, cookie(None, app.access.secure)?)], Redirect::to("/sign-in")).into_response())
}

/// `GET /account`.
pub(super) async fn account(State(app): State<AppState>, caller: Option<Caller>) -> Page {
    if app.access.open && caller.as_ref().is_some_and(|caller| caller.user.is_none()) {
        return page(&NoAccountPage);
    }
    page(&account_of(caller)?.0)
}

fn account_of(caller: Option<Caller>) -> Result<(AccountPage, crate::store::UserId), Error> {
    let caller = caller.ok_or_else(|| Error::NotSignedIn("sign in first".to_owned()))?;
    let (Some(user), Some(role)) = (caller.user, caller.role) else {
        return Err(Error::conflict("nobody is signed in here: there is no account"));
    };
    let (name, role) = (caller.name, role.as_str());
    Ok((AccountPage { name, role, shortest: secret::SHORTEST_PASSWORD, refused: None, saved: false }, user))
}

/// A new password.
#[derive(Deserialize)]
pub(super) struct NewPassword {
    password: String,
}

/// `POST /account`: sets the password, and ends every other session of the person.
pub(super) async fn set_password(
    State(app): State<AppState>,
    caller: Option<Caller>,
    Form(form): Form<NewPassword>,
) -> Result<Response, PageError> {
    let actor = caller.as_ref().map(|caller| caller.actor.clone());
    let (mut shown, user) = account_of(caller)?;
    let hashed = secret::aside(move || secret::hash_password(&form.password)).await?;
    let hashed = match (hashed, actor) {
        (Ok(hashed), Some(actor)) => (hashed, actor),
        (Err(Error::Invalid(field)), _) => {
            shown.refused = Some(field.message);
            return Ok((StatusCode::UNPROCESSABLE_ENTITY, page(&shown)?).into_response());
        }
        (Err(other), _) => return Err(other.into()),
        (Ok(_), None) => return Err(Error::NotSignedIn("sign in first".to_owned()).into()),
    };
    let mut writer = app.write().await?;
    let user = people::set_password(&mut writer, &hashed.1, user, &hashed.0).await?;
    let session = sign_in::renew(&mut writer, &user).await?;
    commit(writer).await?;
    shown.saved = true;
    Ok(([(header::SET_COOKIE, cookie(Some(&session), app.access.secure)?)], page(&shown)?).into_response())
}
