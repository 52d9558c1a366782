//! Access to a study: adds and removes members, and restricts the study to them. For pages and REST.

use crate::access::{Caller, Principal, Reach, Role};
use crate::error::Error;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::members::{self, MEMBER_ALREADY, Member, MemberKind};
use gaitwright_store::{Connection, MemberId, OnConstraint, StudyId, Writer, accessible_studies, tokens, users};
use serde::Deserialize;
use serde_json::json;
use utoipa::ToSchema;

/// A user or token to add to a study.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewMember {
    /// Whether it is a user or a token.
    pub kind: MemberKind,
    /// Name of an enabled user or a valid token.
    pub name: String,
}

/// Access to a study.
#[derive(Debug, Clone)]
pub struct StudyAccess {
    /// Whether only members and administrators can access the study.
    pub restricted: bool,
    /// Members, in the order in which they were added.
    pub members: Vec<Member>,
}

/// Reads the access to a study.
///
/// # Errors
/// Errors of the database.
pub async fn access(db: &mut Connection, study: StudyId) -> Result<StudyAccess, Error> {
    Ok(StudyAccess {
        restricted: members::is_restricted(db, study).await?,
        members: members::of_study(db, study).await?,
    })
}

/// Makes a user or a token a member of a study.
///
/// # Errors
/// [`Error::Invalid`] for an unknown name, [`Error::Conflict`] if it is a member already.
pub async fn add(writer: &mut Writer, actor: &Actor, study: StudyId, new: &NewMember) -> Result<Member, Error> {
    let who = match new.kind {
        MemberKind::User => users::by_name(writer, &new.name)
            .await?
            .filter(|user| user.disabled_at.is_none())
            .map(|user| Principal::User(user.id))
            .ok_or_else(|| Error::invalid("name", new.name.as_str(), "the name of an enabled user"))?,
        MemberKind::Token => tokens::all(writer)
            .await?
            .into_iter()
            .find(|token| token.name == new.name && token.is_good())
            .map(|token| Principal::Token(token.id))
            .ok_or_else(|| Error::invalid("name", new.name.as_str(), "the name of a valid token"))?,
    };
    insert(writer, actor, study, who).await
}

pub(super) async fn insert(
    writer: &mut Writer,
    actor: &Actor,
    study: StudyId,
    who: Principal,
) -> Result<Member, Error> {
    let id = members::insert(writer, study, who, actor.as_str())
        .await
        .on_constraint(MEMBER_ALREADY, || Error::conflict("This user or token is already a member of the study."))?;
    let member = members::get(writer, id).await?;
    let detail = json!({ "member": id, "kind": member.kind, "name": member.name });
    audit::append(writer, actor, "study.member_add", &format!("study {study}"), &detail).await?;
    Ok(member)
}

/// Removes a member.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Conflict`] if the member was already removed.
pub async fn end(writer: &mut Writer, actor: &Actor, id: MemberId) -> Result<Member, Error> {
    let member = members::get(writer, id).await?;
    if !members::end(writer, id, actor.as_str()).await? {
        return Err(Error::conflict("This member was already removed."));
    }
    let detail = json!({ "member": id, "kind": member.kind, "name": member.name });
    audit::append(writer, actor, "study.member_end", &format!("study {}", member.study_id), &detail).await?;
    Ok(member)
}

/// Restricts a study to its members and administrators, or opens it to all staff. The caller who restricts it becomes a
/// member.
///
/// # Errors
/// Errors of the database.
pub async fn restrict(writer: &mut Writer, caller: &Caller, study: StudyId, restricted: bool) -> Result<(), Error> {
    if members::is_restricted(writer, study).await? != restricted {
        members::set_restricted(writer, study, restricted, caller.actor.as_str()).await?;
        let detail = json!({ "restricted": restricted });
        audit::append(writer, &caller.actor, "study.restrict", &format!("study {study}"), &detail).await?;
        ensure_caller_is_member(writer, caller, study).await?;
    }
    Ok(())
}

/// Makes the caller a member if the study would otherwise become inaccessible to the caller.
pub(super) async fn ensure_caller_is_member(writer: &mut Writer, caller: &Caller, study: StudyId) -> Result<(), Error> {
    if let Reach::Open(who) | Reach::Assigned(who) = caller.reach()
        && !accessible_studies::reaches(writer, caller.reach(), study).await?
    {
        insert(writer, &caller.actor, study, who).await?;
    }
    Ok(())
}

/// Users, with their roles, and tokens that can be added to a study, sorted by name.
///
/// # Errors
/// Errors of the database.
pub async fn candidates(
    db: &mut Connection,
    present: &[Member],
) -> Result<Vec<(MemberKind, String, Option<Role>)>, Error> {
    let is_new = |kind, name: &str| !present.iter().any(|member| member.kind == kind && member.name == name);
    let users = users::all(db).await?.into_iter().filter(|user| user.disabled_at.is_none());
    let users = users.map(|user| (MemberKind::User, user.name, Some(user.role)));
    let tokens = tokens::all(db).await?.into_iter().filter(tokens::Token::is_good);
    let tokens = tokens.map(|token| (MemberKind::Token, token.name, None));
    Ok(users.chain(tokens).filter(|(kind, name, _)| is_new(*kind, name)).collect())
}
