//! Who could have known which gait is which.

use crate::access::{Caller, Right};
use crate::error::Error;
use crate::store::{Connection, StudyId, allocations, presentations};

/// Whether a caller could know which gait is which in a study: whoever may read can open its trials, a rater may have been
/// unblinded, and a controller file of a lab walk shows a gait.
///
/// # Errors
/// What the database reports.
pub(crate) async fn could_have_known(db: &mut Connection, caller: &Caller, study: StudyId) -> Result<bool, Error> {
    Ok(caller.may(Right::Read)
        || presentations::is_unblinded(db, study, &caller.name).await?
        || allocations::has_file(db, study, &caller.actor).await?)
}
