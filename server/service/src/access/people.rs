//! Users: adding them, shutting them out, their passwords and one-time links. One way in for pages, REST and the
//! command line.

use super::{clock, secret, tokens};
use crate::error::Error;
use crate::printable;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::rights::Role;
use gaitwright_store::users::{self, NAME_UNIQUE, User};
use gaitwright_store::{Connection, OnConstraint, UserId, Writer, sessions};
use serde::Deserialize;
use serde_json::json;
use utoipa::ToSchema;

/// A one-time link can be used for this long.
const LINK_SECONDS: i64 = 24 * 3600;
/// The first user: whoever started the service.
pub const FIRST: &str = "admin";

/// A user to add.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewUser {
    /// Name or code: 1 to 80 characters.
    #[schema(min_length = 1, max_length = 80)]
    pub name: String,
    /// What the person is here.
    pub role: Role,
}

/// Adds a user.
///
/// # Errors
/// [`Error::Invalid`], [`Error::Conflict`] when the name is taken.
pub async fn add(writer: &mut Writer, actor: &Actor, new: &NewUser) -> Result<User, Error> {
    let name = printable::name("name", &new.name, 80)?;
    let user = users::insert(writer, name, new.role)
        .await
        .on_constraint(NAME_UNIQUE, || Error::conflict(format!("there is a user {name:?} already")))?;
    let detail = json!({ "name": name, "role": new.role });
    audit::append(writer, actor, "user.add", &format!("user {}", user.id), &detail).await?;
    Ok(user)
}

/// An administrator for whoever starts the service: the first one who is not disabled, or a new one. A disabled one is
/// not let in again, because the old password would be, too.
///
/// # Errors
/// What the database reports.
pub async fn way_in(writer: &mut Writer) -> Result<User, Error> {
    let all = users::all(writer).await?;
    let mut admins: Vec<&User> =
        all.iter().filter(|user| user.role == Role::Admin && user.disabled_at.is_none()).collect();
    admins.sort_by_key(|user| (!user.name.eq_ignore_ascii_case(FIRST), !user.has_password, user.id));
    if let Some(first) = admins.first() {
        return Ok((*first).clone());
    }
    let is_free = |name: &String| !all.iter().any(|user| user.name.eq_ignore_ascii_case(name));
    let numbered = (2..).map(|number: u32| format!("{FIRST}-{number}"));
    let name = std::iter::once(FIRST.to_owned()).chain(numbered).find(is_free).unwrap_or_default();
    add(writer, &Actor::program(), &NewUser { name, role: Role::Admin }).await
}

/// Makes a one-time link for a user: its secret, which is not stored.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Conflict`] when the user is shut out.
pub async fn link(writer: &mut Writer, actor: &Actor, id: UserId) -> Result<String, Error> {
    let user = users::get(writer, id).await?;
    if user.disabled_at.is_some() {
        return Err(Error::conflict("this user is disabled"));
    }
    let secret = secret::fresh()?;
    let now = clock::recorded(writer).await?;
    sessions::add_link(writer, &secret::hash(&secret), id, now, now.plus_seconds(LINK_SECONDS)).await?;
    audit::append(writer, actor, "user.link", &format!("user {id}"), &json!({})).await?;
    Ok(secret)
}

/// Sets a password that was hashed outside of any transaction, and ends the other sessions of the user.
///
/// # Errors
/// What the database reports.
pub async fn set_password(writer: &mut Writer, actor: &Actor, id: UserId, hashed: &str) -> Result<User, Error> {
    users::set_password(writer, id, hashed).await?;
    let now = clock::recorded(writer).await?;
    sessions::end_all(writer, id, now).await?;
    audit::append(writer, actor, "user.password", &format!("user {id}"), &json!({})).await?;
    Ok(users::get(writer, id).await?)
}

/// Shuts a user out and ends the user's sessions, links and tokens, or lets the user in again. What has ended stays ended.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Conflict`] when nobody would be left who can sign in and administer.
pub async fn set_disabled(writer: &mut Writer, actor: &Actor, id: UserId, disabled: bool) -> Result<User, Error> {
    let user = users::get(writer, id).await?;
    if disabled && user.disabled_at.is_none() {
        if user.role == Role::Admin {
            keep_an_administrator(writer, id).await?;
        }
        let now = clock::recorded(writer).await?;
        sessions::end_all(writer, id, now).await?;
        tokens::revoke_all_of(writer, actor, id).await?;
    }
    users::set_disabled(writer, id, disabled).await?;
    let action = if disabled { "user.disable" } else { "user.enable" };
    audit::append(writer, actor, action, &format!("user {id}"), &json!({ "name": user.name })).await?;
    Ok(users::get(writer, id).await?)
}

/// Gives a user another role, which holds from the next request on. Tokens are made by administrators: those of one who is
/// none any more end.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Conflict`] when nobody would be left who can sign in and administer.
pub async fn set_role(writer: &mut Writer, actor: &Actor, id: UserId, role: Role) -> Result<User, Error> {
    let user = users::get(writer, id).await?;
    if user.role == role {
        return Ok(user);
    }
    if user.role == Role::Admin {
        if user.disabled_at.is_none() {
            keep_an_administrator(writer, id).await?;
        }
        tokens::revoke_all_of(writer, actor, id).await?;
    }
    users::set_role(writer, id, role).await?;
    let detail = json!({ "name": user.name, "before": user.role, "role": role });
    audit::append(writer, actor, "user.role", &format!("user {id}"), &detail).await?;
    Ok(users::get(writer, id).await?)
}

/// How an administrator can sign in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum WayIn {
    /// Not yet: no link was used.
    Never,
    /// In a session that goes on; after it, with another link.
    Session,
    /// Whenever wanted.
    Password,
}

/// Refuses to lose an administrator when the others have less of a way in: one who never signed in does not count beside
/// one who did, and one in a session does not beside one with a password.
async fn keep_an_administrator(db: &mut Connection, lost: UserId) -> Result<(), Error> {
    let (mut own, mut others) = (WayIn::Never, None);
    for user in users::all(db).await?.iter().filter(|user| user.role == Role::Admin && user.disabled_at.is_none()) {
        let way_in = if user.has_password {
            WayIn::Password
        } else if sessions::live(db, Some(user.id)).await?.is_empty() {
            WayIn::Never
        } else {
            WayIn::Session
        };
        if user.id == lost {
            own = way_in;
        } else {
            others = others.max(Some(way_in));
        }
    }
    if others >= Some(own) {
        return Ok(());
    }
    let reason = match others {
        None => "this is the last administrator: add another one first",
        Some(_) => "this is the last administrator who can sign in: another one must sign in and set a password first",
    };
    Err(Error::conflict(reason))
}

/// Whether somebody can administer the service from afar: an administrator with a password.
///
/// # Errors
/// What the database reports.
pub async fn has_admin(db: &mut Connection) -> Result<bool, Error> {
    let all = users::all(db).await?;
    Ok(all.iter().any(|user| user.role == Role::Admin && user.has_password && user.disabled_at.is_none()))
}
