//! Invites a rater to a study by a one-time sign-in link.

use super::membership::insert;
use crate::access::user_administration::{self, NewUser};
use crate::access::{Principal, Role};
use crate::error::Error;
use gaitwright_store::audit::Actor;
use gaitwright_store::members::{self, Member, MemberKind};
use gaitwright_store::users::User;
use gaitwright_store::{StudyId, Writer, users};

/// Assigns a rater to a study and creates a one-time sign-in link. Adds the rater if the name is new. Returns the rater
/// and the secret of the link, which is not stored.
///
/// # Errors
/// [`Error::Invalid`] if the name belongs to a user who is not a rater, [`Error::Conflict`] for a disabled rater.
pub async fn invite(
    writer: &mut Writer,
    actor: &Actor,
    study: StudyId,
    name: &str,
) -> Result<(User, Member, String), Error> {
    let user = match users::by_name(writer, name).await? {
        Some(user) if user.role == Role::Rater => user,
        Some(_) => return Err(Error::invalid("name", name, "the name of a rater or a name that is not taken")),
        None => user_administration::add(writer, actor, &NewUser { name: name.to_owned(), role: Role::Rater }).await?,
    };
    let secret = user_administration::link(writer, actor, user.id).await?;
    let present = members::of_study(writer, study).await?;
    let present = present.into_iter().find(|member| member.kind == MemberKind::User && member.name == user.name);
    let member = match present {
        Some(member) => member,
        None => insert(writer, actor, study, Principal::User(user.id)).await?,
    };
    Ok((user, member, secret))
}
