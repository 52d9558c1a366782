//! REST: members of studies, restriction of access, and invitations of raters.

use crate::AppState;
use crate::accessible::{DespiteWithdrawal, Id};
use crate::authorization::Authorized;
use crate::idempotent::{Idempotent, IdempotentWith};
use crate::paging::{Page, Paging};
use crate::problem_details::Refusal;
use crate::resources::members::Member;
use axum::Json;
use axum::extract::State;
use axum::response::Response;
use gaitwright_service::access::{Administer, Read, Run};
use gaitwright_service::studies::membership::{self, NewMember};
use gaitwright_service::studies::rater_invitation;
use gaitwright_store::{MemberId, StudyId, members};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// List members of a study
///
/// Raters can access studies of which they are members. Clinicians, and tokens with any scope other than `rate`, can
/// access every unrestricted study, and the restricted studies of which they are members. A request for any other study
/// is answered with 404. Oldest first.
#[utoipa::path(
    get,
    path = "/studies/{id}/members",
    operation_id = "list_study_members",
    tag = "access",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    responses((status = 200, description = "A page of members, in the order in which they were added", body = Page<Member>)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn of_study(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Read>,
    paging: Paging<MemberId>,
) -> Result<Json<Page<Member>>, Refusal> {
    let all = members::of_study(&mut *app.read().await?, id).await?;
    Ok(Json(paging.cut(all, |member| member.id)?.map(Member::from)))
}

/// Get the access restriction of a study
///
/// A restricted study is visible to administrators and to its members only.
#[utoipa::path(
    get,
    path = "/studies/{id}/access",
    operation_id = "get_study_access",
    tag = "access",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    responses((status = 200, description = "Access", body = StudyRestriction)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn access(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Read>,
) -> Result<Json<StudyRestriction>, Refusal> {
    let restricted = members::is_restricted(&mut *app.read().await?, id).await?;
    Ok(Json(StudyRestriction { restricted }))
}

/// Create a study member
///
/// Assigns a rater, or adds a clinician or a token.
#[utoipa::path(
    post,
    path = "/studies/{id}/members",
    operation_id = "create_study_member",
    tag = "access",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    request_body = NewMember,
    responses((status = 201, description = "Member", body = Member)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn add(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    IdempotentWith(request, new): IdempotentWith<Run, NewMember>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let member = membership::add(&mut writer, &request.actor, id, &new).await?;
    request.created(&app, writer, address(member.id), &Member::from(member)).await
}

/// The address of a membership.
fn address(id: MemberId) -> String {
    format!("/api/v1/study-members/{id}")
}

/// Get a study member
///
/// Includes memberships that have ended.
#[utoipa::path(
    get,
    path = "/study-members/{id}",
    operation_id = "get_study_member",
    tag = "access",
    params(("id" = MemberId, Path, description = "Identifier of the membership")),
    responses((status = 200, description = "Member", body = Member)),
    security(("token" = ["read"]), ("session" = ["read"])),
)]
pub(super) async fn get(
    _: Authorized<Read>,
    State(app): State<AppState>,
    Id(id, _): Id<MemberId, Read>,
) -> Result<Json<Member>, Refusal> {
    Ok(Json(members::get(&mut *app.read().await?, id).await?.into()))
}

/// Remove a study member
///
/// Ends the membership, which remains on record.
#[utoipa::path(
    post,
    path = "/study-members/{id}/remove",
    operation_id = "remove_study_member",
    tag = "access",
    params(("id" = MemberId, Path, description = "Identifier of the membership")),
    responses((status = 200, description = "Removed member", body = Member)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn end(
    State(app): State<AppState>,
    DespiteWithdrawal(id, _): DespiteWithdrawal<MemberId, Run>,
    request: Idempotent<Run>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    let member = membership::end(&mut writer, &request.actor, id).await?;
    request.done(&app, writer, &Member::from(member)).await
}

/// Access to a study.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct StudyRestriction {
    /// Whether only members and administrators can access the study. Raters must always be members.
    restricted: bool,
}

/// Set the access restriction of a study
///
/// Restricts the study to members and administrators, or opens it to all staff. The caller who restricts it becomes a
/// member.
#[utoipa::path(
    put,
    path = "/studies/{id}/access",
    operation_id = "set_study_access",
    tag = "access",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    request_body = StudyRestriction,
    responses((status = 200, description = "Access", body = StudyRestriction)),
    security(("token" = ["run"]), ("session" = ["run"])),
)]
pub(super) async fn restrict(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Run>,
    IdempotentWith(request, wanted): IdempotentWith<Run, StudyRestriction>,
) -> Result<Response, Refusal> {
    let mut writer = match request.begin(&app).await? {
        Ok(writer) => writer,
        Err(before) => return Ok(before),
    };
    membership::restrict(&mut writer, &request.caller, id, wanted.restricted).await?;
    request.done(&app, writer, &wanted).await
}

/// Rater to invite.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct RaterInvitation {
    /// Name or code of the rater, 1 to 80 characters. A new name adds a rater.
    #[schema(min_length = 1, max_length = 80)]
    name: String,
}

/// Invited rater.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct CreatedRaterInvitation {
    /// The membership.
    member: Member,
    /// Path of the one-time sign-in link, which is shown once and valid for a day.
    path: String,
}

/// Create an invitation for a rater
///
/// Assigns the rater to the study and creates a one-time sign-in link. Does not accept an Idempotency-Key.
#[utoipa::path(
    post,
    path = "/studies/{id}/invitations",
    operation_id = "create_invitation",
    tag = "access",
    params(("id" = StudyId, Path, description = "Identifier of the study")),
    request_body = RaterInvitation,
    responses((status = 201, description = "Invitation; the link is shown once", body = CreatedRaterInvitation)),
    extensions(("x-shown-once" = json!(true))),
    security(("token" = ["administer"]), ("session" = ["administer"])),
)]
pub(super) async fn invite(
    State(app): State<AppState>,
    Id(id, _): Id<StudyId, Administer>,
    IdempotentWith(request, whom): IdempotentWith<Administer, RaterInvitation>,
) -> Result<Response, Refusal> {
    let mut writer = request.begin_secret(&app).await?;
    let (_, member, secret) = rater_invitation::invite(&mut writer, &request.actor, id, &whom.name).await?;
    let location = address(member.id);
    let invited = CreatedRaterInvitation { member: member.into(), path: format!("/sign-in/{secret}") };
    request.created(&app, writer, location, &invited).await
}
