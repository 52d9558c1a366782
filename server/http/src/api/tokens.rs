//! REST: tokens of programs.

use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::idempotent::{Idempotent, IdempotentWith};
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::resources::tokens::Token;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::Administer;
use gaitwright_service::access::tokens::{self as making, NewToken};
use gaitwright_store::{TokenId, tokens};
use serde::Serialize;
use std::cmp::Reverse;
use utoipa::ToSchema;

/// New token.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct CreatedToken {
    /// The token.
    #[serde(flatten)]
    token: Token,
    /// Secret, shown once. Send it as `Authorization: Bearer SECRET`.
    secret: String,
}

/// List tokens
///
/// Newest first.
#[utoipa::path(
    get,
    path = "/tokens",
    operation_id = "list_tokens",
    tag = "access",
    responses((status = 200, description = "A page, without secrets", body = Page<Token>)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn list(
    _: Authorized<Administer>,
    State(app): State<AppState>,
    paging: Paging<Reverse<TokenId>>,
) -> Result<Json<Page<Token>>, Refusal> {
    let mut all = tokens::all(&mut *app.read().await?).await?;
    all.reverse();
    Ok(Json(paging.cut(all, |one| Reverse(one.id))?.map(Token::from)))
}

/// Get a token
///
/// Revoked and expired tokens are returned, too. The secret is shown only once, by `create_token`.
#[utoipa::path(
    get,
    path = "/tokens/{id}",
    operation_id = "get_token",
    tag = "access",
    params(("id" = TokenId, Path, description = "Identifier of the token")),
    responses((status = 200, description = "Token, without its secret", body = Token)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn get(
    _: Authorized<Administer>,
    State(app): State<AppState>,
    Id(id, _): Id<TokenId, Administer>,
) -> Result<Json<Token>, Refusal> {
    Ok(Json(tokens::get(&mut *app.read().await?, id).await?.into()))
}

/// Create a token
///
/// Does not accept an Idempotency-Key, because the secret is not stored.
#[utoipa::path(
    post,
    path = "/tokens",
    operation_id = "create_token",
    tag = "access",
    request_body = NewToken,
    responses((status = 201, description = "Token; the secret is shown once", body = CreatedToken)),
    extensions(("x-shown-once" = json!(true))),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn create(
    State(app): State<AppState>,
    IdempotentWith(request, new): IdempotentWith<Administer, NewToken>,
) -> Result<Response, Refusal> {
    let mut writer = request.begin_secret(&app).await?;
    let (token, secret) = making::make(&mut writer, &request.actor, &new).await?;
    let location = format!("/api/v1/tokens/{}", token.id);
    request.created(&app, writer, location, &CreatedToken { token: token.into(), secret }).await
}

/// Revoke a token
///
/// A revoked token can no longer be used.
#[utoipa::path(
    post,
    path = "/tokens/{id}/revoke",
    operation_id = "revoke_token",
    tag = "access",
    params(("id" = TokenId, Path, description = "Identifier of the token")),
    responses((status = 200, description = "Revoked token", body = Token)),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn revoke(
    State(app): State<AppState>,
    Id(id, _): Id<TokenId, Administer>,
    request: Idempotent<Administer>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let token = making::revoke(&mut writer, &request.actor, id).await?;
    request.done(&app, writer, &Token::from(token)).await
}
