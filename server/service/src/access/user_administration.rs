//! Administration of users: adds and disables them, sets roles and passwords, creates sign-in links. For pages, REST
//! and the command line.

use super::{monotonic_clock, secret, tokens};
use crate::error::Error;
use crate::printable;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::rights::Role;
use gaitwright_store::users::{self, NAME_UNIQUE, User};
use gaitwright_store::{Connection, OnConstraint, UserId, Writer, sessions};
use serde::Deserialize;
use serde_json::json;
use utoipa::ToSchema;

/// Validity of a one-time sign-in link.
const LINK_SECONDS: i64 = 24 * 3600;
/// Name of the first user.
pub const FIRST: &str = "admin";

/// A user to add.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewUser {
    /// Name or code, 1 to 80 characters.
    #[schema(min_length = 1, max_length = 80)]
    pub name: String,
    /// Role of the user.
    pub role: Role,
}

/// Adds a user.
///
/// # Errors
/// [`Error::Invalid`] naming the field, [`Error::Conflict`] if a user has this name or one of the same person.
pub async fn add(writer: &mut Writer, actor: &Actor, new: &NewUser) -> Result<User, Error> {
    let name = printable::name("name", &new.name, 80)?;
    let taken = |by: &str| Error::conflict(format!("A user named {by:?} already exists. Choose another name."));
    if let Some(same) = users::all(writer).await?.iter().find(|user| printable::is_same_name(&user.name, name)) {
        return Err(taken(&same.name));
    }
    let user = users::insert(writer, name, new.role).await.on_constraint(NAME_UNIQUE, || taken(name))?;
    let detail = json!({ "name": name, "role": new.role });
    audit::append(writer, actor, "user.add", &format!("user {}", user.id), &detail).await?;
    Ok(user)
}

/// The administrator for the operator of the service: the first one who is not disabled, or a new one. A disabled one
/// stays disabled, because enabling would make the old password valid again.
///
/// # Errors
/// Errors of the database.
pub async fn operator_administrator(writer: &mut Writer) -> Result<User, Error> {
    let all = users::all(writer).await?;
    let mut admins: Vec<&User> =
        all.iter().filter(|user| user.role == Role::Administrator && user.disabled_at.is_none()).collect();
    admins.sort_by_key(|user| (!user.name.eq_ignore_ascii_case(FIRST), !user.has_password, user.id));
    if let Some(first) = admins.first() {
        return Ok((*first).clone());
    }
    let is_free = |name: &String| !all.iter().any(|user| printable::is_same_name(&user.name, name));
    let numbered = (2..).map(|number: u32| format!("{FIRST}-{number}"));
    let name = std::iter::once(FIRST.to_owned()).chain(numbered).find(is_free).unwrap_or_default();
    add(writer, &Actor::program(), &NewUser { name, role: Role::Administrator }).await
}

/// Creates a one-time sign-in link and returns its secret, which is not stored.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Conflict`] if the user is disabled.
pub async fn link(writer: &mut Writer, actor: &Actor, id: UserId) -> Result<String, Error> {
    let user = users::get(writer, id).await?;
    if user.disabled_at.is_some() {
        return Err(Error::conflict("This user is disabled. Enable the user first."));
    }
    let secret = secret::fresh()?;
    let now = monotonic_clock::recorded(writer).await?;
    sessions::add_link(writer, &secret::hash(&secret), id, now, now.plus_seconds(LINK_SECONDS)).await?;
    audit::append(writer, actor, "user.link", &format!("user {id}"), &json!({})).await?;
    Ok(secret)
}

/// Sets a password and ends the other sessions of the user. `hashed` is computed outside any transaction.
///
/// # Errors
/// Errors of the database.
pub async fn set_password(writer: &mut Writer, actor: &Actor, id: UserId, hashed: &str) -> Result<User, Error> {
    users::set_password(writer, id, hashed).await?;
    let now = monotonic_clock::recorded(writer).await?;
    sessions::end_all(writer, id, now).await?;
    audit::append(writer, actor, "user.password", &format!("user {id}"), &json!({})).await?;
    Ok(users::get(writer, id).await?)
}

/// Disables a user and ends the user's sessions, links and tokens, or enables the user again. Enabling does not restore
/// them.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Conflict`] if no administrator who can sign in would be left.
pub async fn set_disabled(writer: &mut Writer, actor: &Actor, id: UserId, disabled: bool) -> Result<User, Error> {
    let user = users::get(writer, id).await?;
    if disabled && user.disabled_at.is_none() {
        if user.role == Role::Administrator {
            keep_an_administrator(writer, id).await?;
        }
        let now = monotonic_clock::recorded(writer).await?;
        sessions::end_all(writer, id, now).await?;
        tokens::revoke_all_of(writer, actor, id).await?;
    }
    users::set_disabled(writer, id, disabled).await?;
    let change = if disabled { "user.disable" } else { "user.enable" };
    audit::append(writer, actor, change, &format!("user {id}"), &json!({ "name": user.name })).await?;
    Ok(users::get(writer, id).await?)
}

/// Changes the role of a user, beginning with the next request. If the user is no longer an administrator, the tokens that the user created are revoked.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Conflict`] if no administrator who can sign in would be left.
pub async fn set_role(writer: &mut Writer, actor: &Actor, id: UserId, role: Role) -> Result<User, Error> {
    let user = users::get(writer, id).await?;
    if user.role == role {
        return Ok(user);
    }
    if user.role == Role::Administrator {
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
    /// With an unused link only.
    Never,
    /// In the current session; later with another link.
    Session,
    /// With a password.
    Password,
}

/// Refuses to lose an administrator if every other one has a weaker way to sign in: an unused link is weaker than a
/// session, and a session is weaker than a password.
async fn keep_an_administrator(db: &mut Connection, lost: UserId) -> Result<(), Error> {
    let (mut own, mut others) = (WayIn::Never, None);
    for user in
        users::all(db).await?.iter().filter(|user| user.role == Role::Administrator && user.disabled_at.is_none())
    {
        let operator_administrator = if user.has_password {
            WayIn::Password
        } else if sessions::live(db, Some(user.id)).await?.is_empty() {
            WayIn::Never
        } else {
            WayIn::Session
        };
        if user.id == lost {
            own = operator_administrator;
        } else {
            others = others.max(Some(operator_administrator));
        }
    }
    if others >= Some(own) {
        return Ok(());
    }
    let reason = match others {
        None => "This is the last administrator. Make another user an administrator first.",
        Some(_) => {
            "This is the last administrator who can sign in. Another administrator must sign in and set a password first."
        }
    };
    Err(Error::conflict(reason))
}

/// Whether there is an administrator with a password.
///
/// # Errors
/// Errors of the database.
pub async fn has_admin(db: &mut Connection) -> Result<bool, Error> {
    let all = users::all(db).await?;
    Ok(all.iter().any(|user| user.role == Role::Administrator && user.has_password && user.disabled_at.is_none()))
}
