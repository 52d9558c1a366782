//! Who reaches a study: its members, and whether it is restricted to them.

use crate::AppState;
use crate::may::May;
use crate::once::{Once, OnceWith};
use crate::paging::{Page, Paging};
use crate::problem::Refusal;
use crate::reached::Id;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::{Administer, Read, Run};
use gaitwright_service::studies::membership::{self, NewMember};
use gaitwright_store::members::{self, Member};
use gaitwright_store::{MemberId, StudyId};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// `GET /studies/{id}/members`: who reaches the study besides administrators.
///
/// Raters reach the studies that they are members of. Clinicians, and tokens that may do more than rate, reach every study
/// that is not restricted, and restricted ones as members. A study that a caller does not reach is answered with 404.
#[utoipa::path(
    get,
    path = "/studies/{id}/members",
    operation_id = "list_study_members",
    tag = "access",
    params(("id" = StudyId, Path, description = "The study")),
    responses((status = 200, description = "A page, in the order in which they were added", body = Page<Member>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study(
    _: May<Read>,
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Read>,
    paging: Paging<MemberId>,
) -> Result<Json<Page<Member>>, Refusal> {
    let all = members::of_study(&mut *app.read().await?, id).await?;
    Ok(Json(paging.cut(all, |member| member.id)?))
}

/// `GET /studies/{id}/access`: whether the study is restricted to its members and administrators.
#[utoipa::path(
    get,
    path = "/studies/{id}/access",
    operation_id = "get_study_access",
    tag = "access",
    params(("id" = StudyId, Path, description = "The study")),
    responses((status = 200, description = "Who reaches it", body = StudyAccess)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn access(
    _: May<Read>,
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Read>,
) -> Result<Json<StudyAccess>, Refusal> {
    let restricted = members::is_restricted(&mut *app.read().await?, id).await?;
    Ok(Json(StudyAccess { restricted }))
}

/// `POST /studies/{id}/members`: assigns a rater, or adds a clinician or a token.
#[utoipa::path(
    post,
    path = "/studies/{id}/members",
    operation_id = "add_study_member",
    tag = "access",
    params(("id" = StudyId, Path, description = "The study")),
    request_body = NewMember,
    responses((status = 201, description = "Added", body = Member)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn add(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    OnceWith(once, new): OnceWith<Run, NewMember>,
) -> Result<Response, Refusal> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let member = membership::add(&mut writer, &once.actor, id, &new).await?;
    once.created(&app, writer, address(member.id), &member).await
}

/// Where a membership is.
fn address(id: MemberId) -> String {
    format!("/api/v1/study-members/{id}")
}

/// `GET /study-members/{id}`.
#[utoipa::path(
    get,
    path = "/study-members/{id}",
    operation_id = "get_study_member",
    tag = "access",
    params(("id" = MemberId, Path, description = "The membership")),
    responses((status = 200, description = "The membership, also one that has ended", body = Member)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: May<Read>,
    State(app): State<AppState>,
    Id(id, _): Id<MemberId, Read>,
) -> Result<Json<Member>, Refusal> {
    Ok(Json(members::get(&mut *app.read().await?, id).await?))
}

/// `POST /study-members/{id}/remove`: the member does not reach the study any more, unless it is open to it.
#[utoipa::path(
    post,
    path = "/study-members/{id}/remove",
    operation_id = "remove_study_member",
    tag = "access",
    params(("id" = MemberId, Path, description = "The membership")),
    responses((status = 200, description = "Removed", body = Member)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn end(
    State(app): State<AppState>,
    Id(id, _): Id<MemberId, Run>,
    once: Once<Run>,
) -> Result<Response, Refusal> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let member = membership::end(&mut writer, &once.actor, id).await?;
    once.done(&app, writer, &member).await
}

/// Who reaches a study.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct StudyAccess {
    /// Whether only members and administrators reach it. Raters need to be members in any case.
    restricted: bool,
}

/// `PUT /studies/{id}/access`: restricts the study to its members and administrators, or opens it to all staff. Whoever
/// restricts it stays a member.
#[utoipa::path(
    put,
    path = "/studies/{id}/access",
    operation_id = "set_study_access",
    tag = "access",
    params(("id" = StudyId, Path, description = "The study")),
    request_body = StudyAccess,
    responses((status = 200, description = "Who reaches it now", body = StudyAccess)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn restrict(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    OnceWith(once, wanted): OnceWith<Run, StudyAccess>,
) -> Result<Response, Refusal> {
    let mut writer = match once.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    membership::restrict(&mut writer, &once.caller, id, wanted.restricted).await?;
    once.done(&app, writer, &wanted).await
}

/// A rater to invite.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Invitation {
    /// Name or code of a rater, 1 to 80 characters; who does not exist yet is added.
    #[schema(min_length = 1, max_length = 80)]
    name: String,
}

/// An invited rater.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct Invited {
    /// The membership.
    member: Member,
    /// Path of a one-time sign-in link on this service; shown once, good for a day.
    path: String,
}

/// `POST /studies/{id}/invitations`: assigns a rater to the study and makes a one-time sign-in link. Never repeated: an
/// Idempotency-Key is refused.
#[utoipa::path(
    post,
    path = "/studies/{id}/invitations",
    operation_id = "invite_rater",
    tag = "access",
    params(("id" = StudyId, Path, description = "The study")),
    request_body = Invitation,
    responses((status = 201, description = "Shown once", body = Invited)),
    extensions(("x-shown-once" = json!(true))),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn invite(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Administer>,
    OnceWith(once, whom): OnceWith<Administer, Invitation>,
) -> Result<Response, Refusal> {
    let mut writer = once.begin_secret(&app).await?;
    let (_, member, secret) = membership::invite(&mut writer, &once.actor, id, &whom.name).await?;
    let invited = Invited { member, path: format!("/sign-in/{secret}") };
    once.created(&app, writer, address(invited.member.id), &invited).await
}
