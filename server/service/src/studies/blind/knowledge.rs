//! Decides whether a caller could have known the allocation, so that the answer does not count as blind.

use crate::access::{Caller, Right};
use crate::error::Error;
use gaitwright_store::audit::Actor;
use gaitwright_store::{Connection, StudyId, allocations, blind_pairs, users};

/// Whether a caller is never blind: users who may read can open the trials, and the holder of a token is unknown.
fn sees_gaits(caller: &Caller) -> bool {
    Actor::is_token(caller.actor.as_str()) || caller.may(Right::Read)
}

/// Whether a caller is not blind in any study: besides who sees gaits, a user whose former role allowed it.
///
/// # Errors
/// Errors of the database.
pub async fn is_never_blind(db: &mut Connection, caller: &Caller) -> Result<bool, Error> {
    if sees_gaits(caller) {
        return Ok(true);
    }
    let Some(user) = caller.user else { return Ok(false) };
    Ok(users::former_roles(db, user).await?.iter().any(|role| role.rights().has(Right::Read)))
}

/// Whether a caller could know which gait is which in a study: besides who is [not blind in any](is_never_blind), a
/// rater may have been unblinded, and a controller file of a lab walk shows a gait.
///
/// # Errors
/// Errors of the database.
pub async fn could_have_known(db: &mut Connection, caller: &Caller, study: StudyId) -> Result<bool, Error> {
    Ok(is_never_blind(db, caller).await?
        || blind_pairs::is_unblinded(db, study, &caller.name).await?
        || allocations::has_file(db, study, &caller.actor).await?)
}
