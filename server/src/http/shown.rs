//! What may be shown of studies: nothing that was computed or said of a subject who withdrew.

use super::AppState;
use super::extract::Id;
use crate::error::Error;
use crate::store::{
    Connection, FeedbackId, LabRecordingId, LabSessionId, RemarkId, StoreResult, StudyId, TrialId, consents, feedback,
    lab_recordings, lab_sessions, remarks, trials,
};
use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use std::fmt::Display;
use std::str::FromStr;

/// The identifier in the path, of something whose subject did not withdraw. A handler that gives out figures asks for
/// this one in place of [`Id`].
#[derive(Debug)]
pub(crate) struct Shown<T>(pub(crate) T);

/// What belongs to a study.
pub(crate) trait OfStudy: Copy + Send + Sync {
    /// The study.
    fn study(self, db: &mut Connection) -> impl Future<Output = StoreResult<StudyId>> + Send;
}

impl OfStudy for StudyId {
    async fn study(self, _: &mut Connection) -> StoreResult<StudyId> {
        Ok(self)
    }
}

impl OfStudy for TrialId {
    async fn study(self, db: &mut Connection) -> StoreResult<StudyId> {
        Ok(trials::get(db, self).await?.study_id)
    }
}

impl OfStudy for FeedbackId {
    async fn study(self, db: &mut Connection) -> StoreResult<StudyId> {
        Ok(feedback::get(db, self).await?.study_id)
    }
}

impl OfStudy for RemarkId {
    async fn study(self, db: &mut Connection) -> StoreResult<StudyId> {
        Ok(remarks::get(db, self).await?.study_id)
    }
}

impl OfStudy for LabSessionId {
    async fn study(self, db: &mut Connection) -> StoreResult<StudyId> {
        Ok(lab_sessions::get(db, self).await?.study_id)
    }
}

impl OfStudy for LabRecordingId {
    async fn study(self, db: &mut Connection) -> StoreResult<StudyId> {
        lab_recordings::get(db, self).await?.session_id.study(db).await
    }
}

impl<T> FromRequestParts<AppState> for Shown<T>
where
    T: OfStudy + FromStr,
    T::Err: Display,
{
    type Rejection = Error;

    async fn from_request_parts(parts: &mut Parts, app: &AppState) -> Result<Self, Error> {
        let Id(id) = Id::<T>::from_request_parts(parts, app).await?;
        let mut reader = app.read().await?;
        let study = id.study(&mut reader).await?;
        consents::may_be_shown(&mut reader, study).await?;
        Ok(Self(id))
    }
}
