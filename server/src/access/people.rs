//! Users: adding them, shutting them out, their passwords and one-time links. One way in for pages, REST and the
//! command line.

use super::right::Role;
use super::secret;
use crate::error::Error;
use crate::printable;
use crate::store::audit::{self, Actor};
use crate::store::users::{self, NAME_UNIQUE, User};
use crate::store::{OnConstraint, UserId, Writer, now, sessions};
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

/// The first administrator, added if nobody is there yet.
///
/// # Errors
/// What the database reports.
pub async fn first(writer: &mut Writer) -> Result<User, Error> {
    match users::by_name(writer, FIRST).await? {
        Some(user) => Ok(user),
        None => add(writer, &Actor::program(), &NewUser { name: FIRST.to_owned(), role: Role::Admin }).await,
    }
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
    sessions::add_link(writer, &secret::hash(&secret), id, now().plus_seconds(LINK_SECONDS)).await?;
    audit::append(writer, actor, "user.link", &format!("user {id}"), &json!({})).await?;
    Ok(secret)
}

/// Sets a password that was hashed outside of any transaction, and ends the other sessions of the user.
///
/// # Errors
/// What the database reports.
pub async fn set_password(writer: &mut Writer, actor: &Actor, id: UserId, hashed: &str) -> Result<User, Error> {
    users::set_password(writer, id, hashed).await?;
    sessions::end_all(writer, id).await?;
    audit::append(writer, actor, "user.password", &format!("user {id}"), &json!({})).await?;
    Ok(users::get(writer, id).await?)
}

/// Shuts a user out and ends the user's sessions, or lets the user in again.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Conflict`] when it would leave nobody who administers.
pub async fn set_disabled(writer: &mut Writer, actor: &Actor, id: UserId, disabled: bool) -> Result<User, Error> {
    let user = users::get(writer, id).await?;
    let admins = users::all(writer).await?.into_iter().filter(|u| u.role == Role::Admin && u.disabled_at.is_none());
    if disabled && user.role == Role::Admin && admins.filter(|admin| admin.id != id).count() == 0 {
        return Err(Error::conflict("this is the last administrator"));
    }
    users::set_disabled(writer, id, disabled).await?;
    if disabled {
        sessions::end_all(writer, id).await?;
    }
    let action = if disabled { "user.disable" } else { "user.enable" };
    audit::append(writer, actor, action, &format!("user {id}"), &json!({ "name": user.name })).await?;
    Ok(users::get(writer, id).await?)
}

/// Whether somebody can administer the service from afar: an administrator with a password.
///
/// # Errors
/// What the database reports.
pub async fn has_admin(db: &mut crate::store::Connection) -> Result<bool, Error> {
    let all = users::all(db).await?;
    Ok(all.iter().any(|user| user.role == Role::Admin && user.has_password && user.disabled_at.is_none()))
}
