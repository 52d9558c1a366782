//! Tokens of programs: creation and revocation.

use super::monotonic_clock;
use super::secret;
use crate::error::Error;
use crate::printable;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::rights::Right;
use gaitwright_store::tokens::{self, NAME_UNIQUE, Token};
use gaitwright_store::{OnConstraint, TokenId, UserId, Writer};
use serde::Deserialize;
use serde_json::json;
use utoipa::ToSchema;

/// Maximum validity of a token, days.
const MAX_DAYS: u32 = 3660;

/// A token to create.
#[derive(Debug, Clone, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewToken {
    /// Purpose of the token, 1 to 80 characters.
    #[schema(min_length = 1, max_length = 80)]
    pub name: String,
    /// Scopes: at least one of `read`, `run`, `answer`, `rate`, `device`.
    #[schema(min_items = 1)]
    pub scopes: Vec<Right>,
    /// Validity in days. Unlimited if absent.
    #[serde(default)]
    #[schema(minimum = 1, maximum = 3660)]
    pub days: Option<u32>,
}

/// Creates a token. Returns the row and its secret, which is not stored.
///
/// # Errors
/// [`Error::Invalid`] naming the field, [`Error::Conflict`] if the name is taken.
pub async fn make(writer: &mut Writer, actor: &Actor, new: &NewToken) -> Result<(Token, String), Error> {
    let name = printable::name("name", &new.name, 80)?;
    if new.scopes.is_empty() || new.scopes.contains(&Right::Administer) {
        let allowed = "one or more of read, run, answer, rate, device";
        return Err(Error::invalid("scopes", json!(new.scopes), allowed));
    }
    if new.days.is_some_and(|days| !(1..=MAX_DAYS).contains(&days)) {
        return Err(Error::invalid("days", json!(new.days), &format!("1 to {MAX_DAYS}, or absent")));
    }
    let secret = format!("gait_{}", secret::fresh()?);
    let now = monotonic_clock::recorded(writer).await?;
    let ends = new.days.map(|days| now.plus_seconds(i64::from(days) * 86_400));
    let token = tokens::insert(writer, name, &secret::hash(&secret), &new.scopes, actor, ends)
        .await
        .on_constraint(NAME_UNIQUE, || {
            Error::conflict(format!("A token named {name:?} already exists. Choose another name."))
        })?;
    let detail = json!({ "name": name, "scopes": new.scopes });
    audit::append(writer, actor, "token.create", &format!("token {}", token.id), &detail).await?;
    Ok((token, secret))
}

/// Revokes a token.
///
/// # Errors
/// [`Error::NotFound`], [`Error::Conflict`] if it was already revoked.
pub async fn revoke(writer: &mut Writer, actor: &Actor, id: TokenId) -> Result<Token, Error> {
    let token = tokens::get(writer, id).await?;
    if !tokens::revoke(writer, id).await? {
        return Err(Error::conflict("This token was already revoked."));
    }
    audit::append(writer, actor, "token.revoke", &format!("token {id}"), &json!({ "name": token.name })).await?;
    Ok(tokens::get(writer, id).await?)
}

/// Revokes every token that a user created, so that a former administrator keeps no access through a program.
///
/// # Errors
/// Errors of the database.
pub(super) async fn revoke_all_of(writer: &mut Writer, actor: &Actor, user: UserId) -> Result<(), Error> {
    for token in tokens::created_by_user(writer, user).await? {
        revoke(writer, actor, token.id).await?;
    }
    Ok(())
}
