//! Whether the service can do its work, for `/ready` and the page *System*.

use crate::AppState;
use gaitwright_service::error::Error;

/// Succeeds if all tasks run and the record can be written.
///
/// # Errors
/// [`Error::NotReady`] with the reason.
pub(crate) async fn check(app: &AppState) -> Result<(), Error> {
    if app.scheduler.stopping().is_cancelled() {
        return Err(Error::NotReady("The service is stopping.".to_owned()));
    }
    if let Err(reason) = app.store().probe().await {
        return Err(Error::NotReady(format!("The record cannot be written: {}.", reason.trim_end_matches('.'))));
    }
    app.scheduler.problem().map_or(Ok(()), |problem| Err(Error::NotReady(problem)))
}
