//! REST: users and one-time sign-in links.

use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::authorization::{SignedIn, not_signed_in};
use crate::idempotent::{Idempotent, IdempotentWith};
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::resources::users::User;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::user_administration::{self, NewUser};
use gaitwright_service::access::{Administer, Right, Role};
use gaitwright_store::{UserId, users};
use serde::{Deserialize, Serialize};
use std::cmp::Reverse;
use utoipa::ToSchema;

/// Caller of the request.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Caller)]
pub(super) struct CurrentUser {
    /// Name of the user or the token.
    name: String,
    /// Role of the user. Null for tokens.
    role: Option<Role>,
    /// Rights of the caller.
    rights: Vec<Right>,
}

/// Get the caller
///
/// Name, role and rights of the caller.
#[utoipa::path(
    get,
    path = "/me",
    operation_id = "get_caller",
    tag = "access",
    responses((status = 200, description = "Caller", body = CurrentUser)),
    security(("token" = []), ("session" = [])),
)]
pub(super) async fn me(SignedIn(caller): SignedIn) -> Result<Json<CurrentUser>, Refusal> {
    let caller = caller.ok_or_else(not_signed_in)?;
    let rights = Right::ALL.into_iter().filter(|right| caller.may(*right)).collect();
    Ok(Json(CurrentUser { name: caller.name, role: caller.role, rights }))
}

/// List users
///
/// Newest first.
#[utoipa::path(
    get,
    path = "/users",
    operation_id = "list_users",
    tag = "access",
    responses((status = 200, description = "A page", body = Page<User>)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn list(
    _: Authorized<Administer>,
    State(app): State<AppState>,
    paging: Paging<Reverse<UserId>>,
) -> Result<Json<Page<User>>, Refusal> {
    let mut all = users::all(&mut *app.read().await?).await?;
    all.reverse();
    Ok(Json(paging.cut(all, |one| Reverse(one.id))?.map(User::from)))
}

/// Get a user
///
/// Disabled users are returned, too.
#[utoipa::path(
    get,
    path = "/users/{id}",
    operation_id = "get_user",
    tag = "access",
    params(("id" = UserId, Path, description = "Identifier of the user")),
    responses((status = 200, description = "User", body = User)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn get(
    _: Authorized<Administer>,
    State(app): State<AppState>,
    Id(id, _): Id<UserId, Administer>,
) -> Result<Json<User>, Refusal> {
    Ok(Json(users::get(&mut *app.read().await?, id).await?.into()))
}

/// Create a user
///
/// The user has no password yet: `create_sign_in_link` makes a link with which the user signs in and sets one.
#[utoipa::path(
    post,
    path = "/users",
    operation_id = "create_user",
    tag = "access",
    request_body = NewUser,
    responses((status = 201, description = "User", body = User)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn create(
    State(app): State<AppState>,
    IdempotentWith(request, new): IdempotentWith<Administer, NewUser>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let user = user_administration::add(&mut writer, &request.actor, &new).await?;
    let location = format!("/api/v1/users/{}", user.id);
    request.created(&app, writer, location, &User::from(user)).await
}

/// One-time sign-in link.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct SignInLink {
    /// Path of the link, which is shown once and valid for a day.
    path: String,
}

/// Create a sign-in link for a user
///
/// The link works once, within a day. The request does not accept an Idempotency-Key.
#[utoipa::path(
    post,
    path = "/users/{id}/link",
    operation_id = "create_sign_in_link",
    tag = "access",
    params(("id" = UserId, Path, description = "Identifier of the user")),
    responses((status = 201, description = "Link, shown once. `Location` points to the user, because the link is a secret", body = SignInLink)),
    extensions(("x-shown-once" = json!(true))),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn link(
    State(app): State<AppState>,
    Id(id, _): Id<UserId, Administer>,
    request: Idempotent<Administer>,
) -> Result<Response, Refusal> {
    let mut writer = request.begin_secret(&app).await?;
    let secret = user_administration::link(&mut writer, &request.actor, id).await?;
    let link = SignInLink { path: format!("/sign-in/{secret}") };
    request.created(&app, writer, format!("/api/v1/users/{id}"), &link).await
}

/// Disable a user
///
/// Ends the user's sign-in sessions, and revokes the user's links and tokens.
#[utoipa::path(
    post,
    path = "/users/{id}/disable",
    operation_id = "disable_user",
    tag = "access",
    params(("id" = UserId, Path, description = "Identifier of the user")),
    responses((status = 200, description = "Disabled user", body = User)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn disable(
    State(app): State<AppState>,
    Id(id, _): Id<UserId, Administer>,
    request: Idempotent<Administer>,
) -> Result<Response, Refusal> {
    set_disabled(&app, id, &request, true).await
}

/// Enable a user
///
/// The password is valid again. Links and tokens that were revoked when the user was disabled stay revoked.
#[utoipa::path(
    post,
    path = "/users/{id}/enable",
    operation_id = "enable_user",
    tag = "access",
    params(("id" = UserId, Path, description = "Identifier of the user")),
    responses((status = 200, description = "Enabled user", body = User)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn enable(
    State(app): State<AppState>,
    Id(id, _): Id<UserId, Administer>,
    request: Idempotent<Administer>,
) -> Result<Response, Refusal> {
    set_disabled(&app, id, &request, false).await
}

/// New role of a user.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct NewRole {
    /// New role.
    role: Role,
}

/// Set the role of a user
///
/// If the user is no longer an administrator, the tokens that the user created are revoked.
#[utoipa::path(
    put,
    path = "/users/{id}/role",
    operation_id = "set_user_role",
    tag = "access",
    params(("id" = UserId, Path, description = "Identifier of the user")),
    request_body = NewRole,
    responses((status = 200, description = "User with the new role", body = User)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn set_role(
    State(app): State<AppState>,
    Id(id, _): Id<UserId, Administer>,
    IdempotentWith(request, new): IdempotentWith<Administer, NewRole>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let user = user_administration::set_role(&mut writer, &request.actor, id, new.role).await?;
    request.done(&app, writer, &User::from(user)).await
}

async fn set_disabled(
    app: &AppState,
    id: UserId,
    request: &Idempotent<Administer>,
    disabled: bool,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let user = user_administration::set_disabled(&mut writer, &request.actor, id, disabled).await?;
    request.done(app, writer, &User::from(user)).await
}
