//! Signing in and out, and the user's own account.

use super::unsent_form::{SignInPage, Unsent, send_now};
use crate::authentication::{cookie, session_of};
use crate::authorization::{SignedIn, not_signed_in};
use crate::extractors::Form;
use crate::format;
use crate::known_browser::{self, BrowserSecret};
use crate::page_error::{PageError, PageResult, page};
use crate::refused_fields::{FieldLabels, FormCheck, RefusedFields, TypedForm};
use crate::{AppState, ClientAddress};
use askama::Template;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::response::{AppendHeaders, IntoResponse, Redirect, Response};
use gaitwright_service::access::back_off::{self, AttemptOrigin, PasswordAttempt};
use gaitwright_service::access::{Caller, Role, password, secret, session, sign_in, user_administration};
use gaitwright_service::error::{Error, FieldError};
use gaitwright_store::audit::Actor;
use gaitwright_store::sessions::{Session, SignInOrigin};
use gaitwright_store::users::User;
use gaitwright_store::{BorrowedWriter, Connection, Instant, UserId, Writer, commit, sessions, users};
use serde::Deserialize;
use std::ops::ControlFlow;
use std::time::Duration;

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
    /// Whether the form asks for the current password.
    must_confirm_password: bool,
    /// The sessions of the user, and whether each is the current one.
    sessions: Vec<(Session, bool)>,
    refused: RefusedFields,
    saved: bool,
}

/// `GET /sign-in`.
pub(super) async fn get() -> PageResult {
    page(&SignInPage { refused: RefusedFields::default(), name: String::new(), unsent: Unsent::default() })
}

/// Name and password, and an entry that was sent before signing in.
#[derive(Deserialize)]
pub(super) struct Credentials {
    name: String,
    password: String,
    #[serde(flatten)]
    unsent: Unsent,
}

/// The origin of a request, for back-off and for the list of sessions.
struct Visit {
    address: ClientAddress,
    /// The `User-Agent` header.
    browser: Option<String>,
    /// The secret of the browser's cookie.
    kept: BrowserSecret,
}

impl Visit {
    fn of(address: ClientAddress, headers: &HeaderMap) -> Self {
        let browser = headers.get(header::USER_AGENT).and_then(|value| value.to_str().ok());
        let browser = browser.map(|text| text.chars().filter(|c| !c.is_control()).take(200).collect());
        Self { address, browser, kept: BrowserSecret::of(headers) }
    }

    /// The origin of an attempt to sign in with a name.
    async fn origin(&self, writer: &mut Writer, user: Option<&User>) -> Result<AttemptOrigin, Error> {
        let known = self.kept.recognised(writer, user).await?;
        Ok(AttemptOrigin { network: self.address.network(), site: self.address.site(), known })
    }

    /// The secret of the browser's cookie, and the origin that a new session records.
    fn begins(&self) -> Result<(String, SignInOrigin), Error> {
        let kept = self.kept.kept_or_fresh()?;
        let browser_hash = Some(secret::hash(&kept));
        let address = Some(self.address.to_string());
        Ok((kept, SignInOrigin { address, browser: self.browser.clone(), browser_hash }))
    }
}

/// Compares a password with that of a user, unless there were too many failed attempts. The inner `Err` is the time to wait.
/// Failed attempts are recorded, those without a comparison as well.
async fn compare<'a>(
    app: &'a AppState,
    visit: &Visit,
    name: &str,
    user: Option<&User>,
    password: String,
) -> Result<Result<Option<(BorrowedWriter<'a>, PasswordAttempt)>, Duration>, Error> {
    let (mut writer, now) = app.write_access().await?;
    let origin = visit.origin(&mut writer, user).await?;
    let network = origin.network.clone();
    let begun = back_off::begin(&mut writer, now, name, origin).await?;
    commit(writer).await?;
    let attempt = match begun {
        Ok(attempt) => attempt,
        Err(wait) => return Ok(Err(wait)),
    };
    let stored = user.and_then(|user| user.password.clone());
    let compared = move || secret::is_password(&password, stored.as_deref());
    let right = app.access.password_checks.run(&network, compared).await?;
    let (mut writer, now) = app.write_access().await?;
    if right {
        return Ok(Ok(Some((writer, attempt))));
    }
    attempt.failed(&mut writer, now).await?;
    commit(writer).await?;
    Ok(Ok(None))
}

fn too_many(wait: Duration) -> Error {
    // Rounded up, so that the next attempt after the wait is not refused again.
    Error::TooManyAttempts(wait.as_secs() + u64::from(wait.subsec_nanos() > 0))
}

/// `POST /sign-in`.
pub(super) async fn post(
    State(app): State<AppState>,
    address: ClientAddress,
    headers: HeaderMap,
    Form(form): Form<Credentials>,
) -> Result<Response, PageError> {
    let name = form.name.trim().to_owned();
    let visit = Visit::of(address, &headers);
    let user = users::by_name(&mut *app.read().await?, &name).await?.filter(|user| user.disabled_at.is_none());
    let right = compare(&app, &visit, &name, user.as_ref(), form.password).await?.map_err(too_many)?;
    if let (Some((mut writer, attempt)), Some(user)) = (right, user) {
        // The user may have been disabled meanwhile.
        let user = users::get(&mut writer, user.id).await?;
        if user.disabled_at.is_none() {
            attempt.succeeded(&mut writer).await?;
            let (kept, from) = visit.begins()?;
            let session = sign_in::with_password(&mut writer, &user, &from).await?;
            commit(writer).await?;
            let answer = if form.unsent.is_any() {
                send_now(&form.unsent)?.into_response()
            } else {
                Redirect::to(home_page(user.role)).into_response()
            };
            return Ok((cookies(&app, &session, &kept)?, answer).into_response());
        }
    }
    // Nothing says which of the two is wrong.
    let refused = RefusedFields::without_field("Wrong name or password.");
    Ok((StatusCode::UNAUTHORIZED, page(&SignInPage { refused, name, unsent: form.unsent })?).into_response())
}

/// `GET /sign-in/{link}`: a button, so that programs that only preview the link do not use it up.
pub(super) async fn link(Path(link): Path<String>) -> PageResult {
    page(&LinkPage { link })
}

/// `POST /sign-in/{link}`.
pub(super) async fn use_link(
    State(app): State<AppState>,
    address: ClientAddress,
    headers: HeaderMap,
    Path(link): Path<String>,
) -> Result<Response, PageError> {
    let (kept, from) = Visit::of(address, &headers).begins()?;
    let (mut writer, _) = app.write_access().await?;
    let (user, session) = match sign_in::with_link_from(&mut writer, &link, &from).await {
        Err(Error::NotSignedIn(reason)) => {
            // An expired link stays expired, so the page need not be retried.
            commit(writer).await?;
            let refused = SignInPage {
                refused: RefusedFields::without_field(&reason),
                name: String::new(),
                unsent: Unsent::default(),
            };
            let refused = page(&refused)?;
            return Ok((StatusCode::UNAUTHORIZED, refused).into_response());
        }
        found => found?,
    };
    commit(writer).await?;
    Ok((cookies(&app, &session, &kept)?, Redirect::to(home_page(user.role))).into_response())
}

/// The cookies of a new session.
fn cookies(app: &AppState, session: &str, kept: &str) -> Result<AppendHeaders<[(HeaderName, HeaderValue); 2]>, Error> {
    let secure = app.access.secure;
    let (session, browser) = (cookie(Some(session), secure)?, known_browser::cookie(kept, secure)?);
    Ok(AppendHeaders([(header::SET_COOKIE, session), (header::SET_COOKIE, browser)]))
}

fn home_page(role: Role) -> &'static str {
    if role == Role::Rater { "/rate" } else { "/" }
}

/// `POST /sign-out`.
pub(super) async fn out(
    State(app): State<AppState>,
    SignedIn(caller): SignedIn,
    headers: HeaderMap,
) -> Result<Response, PageError> {
    if let (Some(caller), Some(session)) = (caller, session_of(&headers)) {
        let mut writer = app.write().await?;
        session::sign_out(&mut writer, &caller.actor, session).await?;
        commit(writer).await?;
    }
    Ok(([(header::SET_COOKIE, cookie(None, app.access.secure)?)], Redirect::to("/sign-in")).into_response())
}

/// `GET /account`.
pub(super) async fn account(State(app): State<AppState>, SignedIn(caller): SignedIn, headers: HeaderMap) -> PageResult {
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
    let caller = caller.ok_or_else(not_signed_in)?;
    let id = caller.user.ok_or_else(|| Error::conflict("Only a signed-in user has an account."))?;
    let mut reader = app.read().await?;
    let user = users::get(&mut reader, id).await?;
    let now = app.access.clock.now(&mut reader).await?;
    let shown = AccountPage {
        name: user.name.clone(),
        role: user.role,
        shortest: password::MIN_LENGTH,
        must_confirm_password: sign_in::must_confirm_password(&mut reader, &user, session_of(headers)).await?,
        sessions: own_sessions(&mut reader, app, user.id, session_of(headers), now).await?,
        refused: RefusedFields::default(),
        saved: false,
    };
    Ok((shown, user, caller.actor.clone()))
}

/// A new password, and the current one if the form asks for it.
#[derive(Clone, Deserialize)]
pub(super) struct NewPassword {
    password: String,
    #[serde(default)]
    present: String,
}

impl TypedForm for NewPassword {
    const LABELS: FieldLabels = &[("present", "Current password"), ("password", "New password")];

    fn repair(&mut self, _: &str) -> bool {
        false
    }
}

/// `POST /account`: sets the password, and ends every other session of the person.
pub(super) async fn set_password(
    State(app): State<AppState>,
    SignedIn(caller): SignedIn,
    address: ClientAddress,
    headers: HeaderMap,
    Form(form): Form<NewPassword>,
) -> Result<Response, PageError> {
    let (mut shown, user, actor) = account_of(&app, caller.as_ref(), &headers).await?;
    let (visit, mut check) = (Visit::of(address, &headers), FormCheck::new(&form));
    if shown.must_confirm_password {
        // Wrong passwords count as failed sign-ins.
        let right = compare(&app, &visit, &user.name, Some(&user), form.present).await?.map_err(too_many)?;
        if let Some((mut writer, attempt)) = right {
            attempt.succeeded(&mut writer).await?;
            commit(writer).await?;
        } else {
            let wrong = FieldError::in_words("present", "The current password is wrong.");
            check.refuse(Error::Invalid(Box::new(wrong)))?;
        }
    }
    let name = user.name.clone();
    let hashed = secret::on_blocking_thread(move || secret::hash_password_of(&name, &form.password)).await?;
    let hashed = match check.step(hashed)? {
        ControlFlow::Break(Some(hashed)) if check.is_clean() => hashed,
        _ => {
            shown.refused = check.into_refused();
            return Ok((shown.refused.status(), page(&shown)?).into_response());
        }
    };
    let (kept, from) = visit.begins()?;
    let (mut writer, now) = app.write_access().await?;
    let user = user_administration::set_password(&mut writer, &actor, user.id, &hashed).await?;
    let session = sign_in::renewed(&mut writer, &user, &from).await?;
    shown.sessions = own_sessions(&mut writer, &app, user.id, Some(&session), now).await?;
    commit(writer).await?;
    (shown.saved, shown.must_confirm_password) = (true, true);
    Ok((cookies(&app, &session, &kept)?, page(&shown)?).into_response())
}

/// The session to end.
#[derive(Deserialize)]
pub(super) struct SessionToEnd {
    id: String,
}

/// `POST /account/sessions`: ends one of one's own sessions.
pub(super) async fn end_session(
    State(app): State<AppState>,
    SignedIn(caller): SignedIn,
    Form(form): Form<SessionToEnd>,
) -> Result<Response, PageError> {
    let caller = caller.ok_or_else(not_signed_in)?;
    let missing = || Error::NotFound { what: "sign-in session".to_owned(), id: form.id.clone() };
    let id = form.id.parse().map_err(|_| missing())?;
    let (mut writer, _) = app.write_access().await?;
    let session = sessions::get(&mut writer, id).await?;
    let own = session.filter(|session| Some(session.user_id) == caller.user).ok_or_else(missing)?;
    session::end(&mut writer, &caller.actor, &own).await?;
    commit(writer).await?;
    app.scheduler.changed();
    Ok(Redirect::to("/account#sessions").into_response())
}

async fn own_sessions(
    db: &mut Connection,
    app: &AppState,
    user: UserId,
    present: Option<&str>,
    now: Instant,
) -> Result<Vec<(Session, bool)>, Error> {
    let present = match present {
        Some(secret) => sessions::find(db, &secret::hash(secret)).await?.map(|session| session.id),
        None => None,
    };
    let live = session::live(db, Some(user), app.access.limits, now).await?;
    Ok(live
        .into_iter()
        .map(|session| {
            let is_present = Some(session.id) == present;
            (session, is_present)
        })
        .collect())
}
