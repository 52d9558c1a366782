//! REST: sign-in sessions of users.

use crate::AppState;
use crate::accessible::Id;
use crate::authorization::Authorized;
use crate::idempotent::Idempotent;
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::resources::sessions::Session;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::{AnyCaller, Right, session};
use gaitwright_service::error::Error;
use gaitwright_store::{Instant, SessionId, sessions};
use std::cmp::Reverse;

/// List sign-in sessions
///
/// Active sign-in sessions of the caller, or of all users for an administrator, newest first.
#[utoipa::path(
    get,
    path = "/sessions",
    operation_id = "list_sessions",
    tag = "access",
    responses((status = 200, description = "Sign-in sessions", body = Page<Session>)),
    security(("token" = []), ("session" = [])),
)]
pub(super) async fn list(
    authorized: Authorized<AnyCaller>,
    State(app): State<AppState>,
    paging: Paging<(Reverse<Instant>, SessionId)>,
) -> Result<Json<Page<Session>>, Refusal> {
    let at = |session: &sessions::Session| (Reverse(session.created_at), session.id);
    let mut reader = app.read().await?;
    let now = app.access.clock.now(&mut reader).await?;
    let of = match authorized.caller.user {
        _ if authorized.caller.may(Right::Administer) => None,
        // A token has no sessions.
        None => return Ok(Json(paging.page(Vec::new(), at)?.map(Session::from))),
        own => own,
    };
    let live = session::live(&mut reader, of, app.access.limits, now).await?;
    Ok(Json(paging.cut(live, at)?.map(Session::from)))
}

/// End a sign-in session
///
/// Ends a sign-in session of the caller or, for an administrator, of any user.
#[utoipa::path(
    post,
    path = "/sessions/{id}/end",
    operation_id = "end_session",
    tag = "access",
    params(("id" = SessionId, Path, description = "Identifier of the sign-in session")),
    responses((status = 200, description = "Ended sign-in session", body = Session)),
    security(("token" = []), ("session" = [])),
)]
pub(super) async fn end(
    State(app): State<AppState>,
    Id(id, _): Id<SessionId, AnyCaller>,
    request: Idempotent<AnyCaller>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let found = sessions::get(&mut writer, id)
        .await?
        .filter(|session| request.caller.may(Right::Administer) || request.caller.user == Some(session.user_id));
    let found = found.ok_or_else(|| Error::NotFound { what: "sign-in session".to_owned(), id: id.to_string() })?;
    session::end(&mut writer, &request.actor, &found).await?;
    request.done(&app, writer, &Session::from(found)).await
}
