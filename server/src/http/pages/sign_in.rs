//! Signing in and out, and a person's own account.

use super::error::{Page, PageError, page};
use super::unsent::{SignInPage, Unsent, send_now};
use crate::access::{Caller, Role, people, secret, sign_in};
use crate::error::Error;
use crate::http::AppState;
use crate::http::extract::Form;
use crate::http::identify::{cookie, session_of};
use crate::store::audit::Actor;
use crate::store::users::User;
use crate::store::{commit, users};
use askama::Template;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Redirect, Response};
use serde::Deserialize;
use std::time::Instant;

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
    role: Role,
    shortest: usize,
    /// Whether the present password is asked for.
    must_say_password: bool,
    refused: Option<String>,
    saved: bool,
}

/// `GET /sign-in`.
pub(super) async fn get() -> Page {
    page(&SignInPage { refused: None, name: String::new(), unsent: Unsent::default() })
}

/// Name and password, and what was sent before.
#[derive(Deserialize)]
pub(super) struct Credentials {
    name: String,
    password: String,
    #[serde(flatten)]
    unsent: Unsent,
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
        if form.unsent.is_any() {
            let cookie = cookie(Some(&session), app.access.secure)?;
            return Ok(([(header::SET_COOKIE, cookie)], send_now(&form.unsent)?).into_response());
        }
        return signed_in(&app, &session, user.role);
    }
    app.access.back_off.failed(&name, Instant::now());
    sign_in::failed(&mut writer, &name).await?;
    commit(writer).await?;
    let refused = Some("name or password is not right".to_owned());
    Ok((StatusCode::UNAUTHORIZED, page(&SignInPage { refused, name, unsent: form.unsent })?).into_response())
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
            let refused = SignInPage { refused: Some(reason), name: String::new(), unsent: Unsent::default() };
            let refused = page(&refused)?;
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
pub(super) async fn account(State(app): State<AppState>, caller: Option<Caller>, headers: HeaderMap) -> Page {
    if app.access.open && caller.as_ref().is_some_and(|caller| caller.user.is_none()) {
        return page(&NoAccountPage);
    }
    page(&account_of(&app, caller.as_ref(), &headers).await?.0)
}

async fn account_of(
    app: &AppState,
    caller: Option<&Caller>,
    headers: &HeaderMap,
) -> Result<(AccountPage, User, Actor), Error> {
    let caller = caller.ok_or_else(|| Error::NotSignedIn("sign in first".to_owned()))?;
    let id = caller.user.ok_or_else(|| Error::conflict("nobody is signed in here: there is no account"))?;
    let mut reader = app.read().await?;
    let user = users::get(&mut reader, id).await?;
    let shown = AccountPage {
        name: user.name.clone(),
        role: user.role,
        shortest: secret::SHORTEST_PASSWORD,
        must_say_password: sign_in::must_say_password(&mut reader, &user, session_of(headers)).await?,
        refused: None,
        saved: false,
    };
    Ok((shown, user, caller.actor.clone()))
}

/// A new password, and the present one where that is asked for.
#[derive(Deserialize)]
pub(super) struct NewPassword {
    password: String,
    #[serde(default)]
    present: String,
}

/// `POST /account`: sets the password, and ends every other session of the person.
pub(super) async fn set_password(
    State(app): State<AppState>,
    caller: Option<Caller>,
    headers: HeaderMap,
    Form(form): Form<NewPassword>,
) -> Result<Response, PageError> {
    let (mut shown, user, actor) = account_of(&app, caller.as_ref(), &headers).await?;
    if shown.must_say_password && !is_present_password(&app, &user, form.present).await? {
        shown.refused = Some("the present password is not right".to_owned());
        return Ok((StatusCode::UNPROCESSABLE_ENTITY, page(&shown)?).into_response());
    }
    let hashed = match secret::aside(move || secret::hash_password(&form.password)).await? {
        Err(Error::Invalid(field)) => {
            shown.refused = Some(field.message);
            return Ok((StatusCode::UNPROCESSABLE_ENTITY, page(&shown)?).into_response());
        }
        hashed => hashed?,
    };
    let mut writer = app.write().await?;
    let user = people::set_password(&mut writer, &actor, user.id, &hashed).await?;
    let session = sign_in::renew(&mut writer, &user).await?;
    commit(writer).await?;
    (shown.saved, shown.must_say_password) = (true, true);
    Ok(([(header::SET_COOKIE, cookie(Some(&session), app.access.secure)?)], page(&shown)?).into_response())
}

/// Whether somebody who is signed in knows the password, too. Guesses wait as they do at the door.
async fn is_present_password(app: &AppState, user: &User, given: String) -> Result<bool, Error> {
    if let Err(wait) = app.access.back_off.begin(&user.name, Instant::now()) {
        return Err(Error::TooManyAttempts(wait.as_secs().max(1)));
    }
    let stored = user.password.clone();
    let right = secret::aside(move || secret::is_password(&given, stored.as_deref())).await?;
    if right {
        app.access.back_off.succeeded(&user.name);
        return Ok(true);
    }
    app.access.back_off.failed(&user.name, Instant::now());
    let mut writer = app.write().await?;
    sign_in::failed(&mut writer, &user.name).await?;
    commit(writer).await?;
    Ok(false)
}
