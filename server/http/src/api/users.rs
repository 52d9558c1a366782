//! Users and their one-time sign-in links.

use crate::AppState;
use crate::may::May;
use crate::may::SignedIn;
use crate::once::{Once, OnceWith};
use crate::paging::{Page, Paging};
use crate::problem::Refusal;
use crate::reached::Id;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::people::{self, NewUser};
use gaitwright_service::access::{Administer, Right, Role};
use gaitwright_service::error::Error;
use gaitwright_store::UserId;
use gaitwright_store::users::{self, User};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Who calls.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct Me {
    /// Name of the user or the token.
    name: String,
    /// Role of the user; none for tokens.
    role: Option<Role>,
    /// What the caller may do.
    rights: Vec<Right>,
}

/// `GET /me`: who calls, and what the caller may do.
#[utoipa::path(
    get,
    path = "/me",
    operation_id = "get_caller",
    tag = "access",
    responses((status = 200, description = "The caller", body = Me)),
    security(("token" = []), ("session" = [])),
)]
pub(super) async fn me(SignedIn(caller): SignedIn) -> Result<Json<Me>, Refusal> {
    let caller = caller.ok_or_else(|| Error::NotSignedIn("sign in first".to_owned()))?;
    let rights = Right::ALL.into_iter().filter(|right| caller.may(*right)).collect();
    Ok(Json(Me { name: caller.name, role: caller.role, rights }))
}

/// `GET /users`: oldest first.
#[utoipa::path(
    get,
    path = "/users",
    operation_id = "list_users",
    tag = "access",
    responses((status = 200, description = "A page", body = Page<User>)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn list(
    _: May<Administer>,
    State(app): State<AppState>,
    paging: Paging<UserId>,
) -> Result<Json<Page<User>>, Refusal> {
    let all = users::all(&mut *app.read().await?).await?;
    Ok(Json(paging.cut(all, |one| one.id)?))
}

/// `GET /users/{id}`.
#[utoipa::path(
    get,
    path = "/users/{id}",
    operation_id = "get_user",
    tag = "access",
    params(("id" = UserId, Path, description = "The user")),
    responses((status = 200, description = "The user", body = User)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn get(
    _: May<Administer>,
    State(app): State<AppState>,
    Id(id, _): Id<UserId, Administer>,
) -> Result<Json<User>, Refusal> {
    Ok(Json(users::get(&mut *app.read().await?, id).await?))
}

/// `POST /users`.
#[utoipa::path(
    post,
    path = "/users",
    operation_id = "create_user",
    tag = "access",
    request_body = NewUser,
    responses((status = 201, description = "Added", body = User)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn create(
    State(app): State<AppState>,
    OnceWith(once, new): OnceWith<Administer, NewUser>,
) -> Result<Response, Refusal> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let user = people::add(&mut writer, &once.actor, &new).await?;
    once.created(&app, writer, format!("/api/v1/users/{}", user.id), &user).await
}

/// A one-time sign-in link.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct Link {
    /// Path of the link on this service; shown once, good for a day.
    path: String,
}

/// `POST /users/{id}/link`: a one-time sign-in link for a user. Never repeated: an Idempotency-Key is refused.
#[utoipa::path(
    post,
    path = "/users/{id}/link",
    operation_id = "create_sign_in_link",
    tag = "access",
    params(("id" = UserId, Path, description = "The user")),
    responses((status = 200, description = "Shown once", body = Link)),
    extensions(("x-shown-once" = json!(true))),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn link(
    State(app): State<AppState>,
    Id(id, _): Id<UserId, Administer>,
    once: Once<Administer>,
) -> Result<Response, Refusal> {
    let mut writer = once.begin_secret(&app).await?;
    let secret = people::link(&mut writer, &once.actor, id).await?;
    once.done(&app, writer, &Link { path: format!("/sign-in/{secret}") }).await
}

/// `POST /users/{id}/disable`: ends the sessions, links and tokens of a user and lets nobody in by that name.
#[utoipa::path(
    post,
    path = "/users/{id}/disable",
    operation_id = "disable_user",
    tag = "access",
    params(("id" = UserId, Path, description = "The user")),
    responses((status = 200, description = "Shut out", body = User)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn disable(
    State(app): State<AppState>,
    Id(id, _): Id<UserId, Administer>,
    once: Once<Administer>,
) -> Result<Response, Refusal> {
    set_disabled(&app, id, &once, true).await
}

/// `POST /users/{id}/enable`.
#[utoipa::path(
    post,
    path = "/users/{id}/enable",
    operation_id = "enable_user",
    tag = "access",
    params(("id" = UserId, Path, description = "The user")),
    responses((status = 200, description = "Let in again", body = User)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn enable(
    State(app): State<AppState>,
    Id(id, _): Id<UserId, Administer>,
    once: Once<Administer>,
) -> Result<Response, Refusal> {
    set_disabled(&app, id, &once, false).await
}

/// A role to give.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct NewRole {
    /// What the person is from now on.
    role: Role,
}

/// `PUT /users/{id}/role`: gives a user another role. Tokens that an administrator made end when this one is none any
/// more.
#[utoipa::path(
    put,
    path = "/users/{id}/role",
    operation_id = "set_user_role",
    tag = "access",
    params(("id" = UserId, Path, description = "The user")),
    request_body = NewRole,
    responses((status = 200, description = "With the role", body = User)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn set_role(
    State(app): State<AppState>,
    Id(id, _): Id<UserId, Administer>,
    OnceWith(once, new): OnceWith<Administer, NewRole>,
) -> Result<Response, Refusal> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let user = people::set_role(&mut writer, &once.actor, id, new.role).await?;
    once.done(&app, writer, &user).await
}

async fn set_disabled(
    app: &AppState,
    id: UserId,
    once: &Once<Administer>,
    disabled: bool,
) -> Result<Response, Refusal> {
    let mut writer = match once.begin(app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let user = people::set_disabled(&mut writer, &once.actor, id, disabled).await?;
    once.done(app, writer, &user).await
}
