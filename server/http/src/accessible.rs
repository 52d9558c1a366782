//! Identifiers in requests, checked for access.
//!
//! A handler gets an identifier only if its caller has the required right and can access the study that the identifier
//! belongs to. An inaccessible object gets the same response as one that does not exist.

use super::AppState;
use super::authorization::{RefusedRequest, permitted};
use axum::extract::{FromRequestParts, RawPathParams};
use axum::http::request::Parts;
use gaitwright_service::access::{Reach, RequiredRight};
use gaitwright_service::error::Error;
use gaitwright_service::job::JobId;
use gaitwright_store::{
    AssessmentId, BackupId, Connection, DeviceId, FeedbackId, LabSessionId, MeasurementFileId, MemberId,
    ReferenceGaitId, SessionId, StoreError, StoreResult, StudyId, SubjectId, TokenId, TrialId, UserId,
    accessible_studies, assessments, consents, feedback, lab_sessions, measurement_files, members, trials,
};
use serde::Deserialize;
use std::fmt::Display;
use std::marker::PhantomData;
use std::str::FromStr;

/// An identifier whose study can be found.
pub(crate) trait Located: Copy + Display + FromStr<Err: Display> + Send + Sync {
    /// The kind of object, for errors.
    const WHAT: &'static str;

    /// The study that the object belongs to; `None` if it is shared by all studies.
    fn study(self, db: &mut Connection) -> impl Future<Output = StoreResult<Option<StudyId>>> + Send;

    /// The subject, if that is the object.
    fn subject(self) -> Option<SubjectId> {
        None
    }
}

macro_rules! of_study {
    ($id:ty, $what:literal, $study:expr) => {
        impl Located for $id {
            const WHAT: &'static str = $what;

            async fn study(self, db: &mut Connection) -> StoreResult<Option<StudyId>> {
                let study: StudyId = $study(db, self).await?;
                Ok(Some(study))
            }
        }
    };
}

of_study!(StudyId, "study", async |_: &mut Connection, id: StudyId| StoreResult::Ok(id));
of_study!(TrialId, "trial", async |db: &mut Connection, id| StoreResult::Ok(trials::get(db, id).await?.study_id));
of_study!(FeedbackId, "preference or suggestion", async |db: &mut Connection, id| StoreResult::Ok(
    feedback::get(db, id).await?.study_id
));
of_study!(AssessmentId, "assessment", async |db: &mut Connection, id| StoreResult::Ok(
    assessments::get(db, id).await?.study_id
));
of_study!(MemberId, "membership", async |db: &mut Connection, id| StoreResult::Ok(
    members::get(db, id).await?.study_id
));
of_study!(LabSessionId, "lab session", async |db: &mut Connection, id| {
    StoreResult::Ok(lab_sessions::get(db, id).await?.study_id)
});
of_study!(MeasurementFileId, "measurement file", async |db: &mut Connection, id| {
    let session = measurement_files::get(db, id).await?.lab_session_id;
    StoreResult::Ok(lab_sessions::get(db, session).await?.study_id)
});

impl Located for SubjectId {
    const WHAT: &'static str = "subject";

    async fn study(self, _: &mut Connection) -> StoreResult<Option<StudyId>> {
        Ok(None)
    }

    fn subject(self) -> Option<SubjectId> {
        Some(self)
    }
}

impl Located for JobId {
    const WHAT: &'static str = "job";

    async fn study(self, db: &mut Connection) -> StoreResult<Option<StudyId>> {
        match self.trial() {
            Some(trial) => Ok(Some(trials::get(db, trial).await?.study_id)),
            None => Ok(None),
        }
    }
}

macro_rules! shared {
    ($id:ty, $what:literal) => {
        impl Located for $id {
            const WHAT: &'static str = $what;

            async fn study(self, _: &mut Connection) -> StoreResult<Option<StudyId>> {
                Ok(None)
            }
        }
    };
}

shared!(BackupId, "backup");
shared!(DeviceId, "device");
shared!(ReferenceGaitId, "reference gait");
shared!(UserId, "user");
shared!(TokenId, "token");
shared!(SessionId, "sign-in session");

/// The study of an object, if the caller can access it. Missing and inaccessible objects are refused with the same
/// message.
async fn located<T: Located>(db: &mut Connection, reach: Reach, id: T) -> Result<Option<StudyId>, Error> {
    let missing = || StoreError::Missing { what: T::WHAT, id: id.to_string() };
    let study = match id.study(db).await {
        Err(StoreError::Missing { .. }) => return Err(missing().into()),
        found => found?,
    };
    if let Some(study) = study
        && !accessible_studies::reaches(db, reach, study).await?
    {
        return Err(missing().into());
    }
    Ok(study)
}

/// The study of the object that the path names, for [`Idempotent`](super::idempotent::Idempotent), which reads the
/// request afterwards.
#[derive(Debug, Clone, Copy)]
pub(super) struct StudyOfPath(pub(super) Option<StudyId>);

/// The identifier `{id}` in the path, of an object for which the caller has the right `P`. A request that changes an
/// object whose subject withdrew consent is refused.
#[derive(Debug)]
pub(crate) struct Id<T, P>(pub(crate) T, pub(crate) PhantomData<P>);

impl<T: Located, P: RequiredRight> FromRequestParts<AppState> for Id<T, P> {
    type Rejection = RefusedRequest;

    async fn from_request_parts(parts: &mut Parts, app: &AppState) -> Result<Self, RefusedRequest> {
        let found = if parts.method.is_safe() {
            in_path::<T, P>(parts, app).await.map(|(id, _)| id)
        } else {
            visible::<T, P>(parts, app).await
        };
        found.map(|id| Self(id, PhantomData)).map_err(|error| RefusedRequest::of(parts, error))
    }
}

/// An [`Id`] for handlers that take access away, which protects a subject who withdrew consent.
#[derive(Debug)]
pub(crate) struct DespiteWithdrawal<T, P>(pub(crate) T, pub(crate) PhantomData<P>);

impl<T: Located, P: RequiredRight> FromRequestParts<AppState> for DespiteWithdrawal<T, P> {
    type Rejection = RefusedRequest;

    async fn from_request_parts(parts: &mut Parts, app: &AppState) -> Result<Self, RefusedRequest> {
        let found = in_path::<T, P>(parts, app).await;
        // A stored response of such a handler has no data of the subject, so it may be repeated.
        parts.extensions.insert(StudyOfPath(None));
        found.map(|(id, _)| Self(id, PhantomData)).map_err(|error| RefusedRequest::of(parts, error))
    }
}

/// Reads the identifier in the path and finds its study.
pub(super) async fn in_path<T: Located, P: RequiredRight>(
    parts: &mut Parts,
    app: &AppState,
) -> Result<(T, Option<StudyId>), Error> {
    // Check the right first, so that the refusal does not depend on whether the object exists.
    let reach = permitted::<P>(&parts.extensions)?.reach();
    let named = RawPathParams::from_request_parts(parts, app).await.map_err(|e| Error::Malformed(e.body_text()))?;
    let text = named.iter().find(|(name, _)| *name == "id").map_or("", |(_, text)| text);
    let unknown = || Error::NotFound { what: "object with the identifier".to_owned(), id: text.to_owned() };
    let id: T = text.parse().map_err(|_| unknown())?;
    let study = located(&mut *app.read().await?, reach, id).await?;
    parts.extensions.insert(StudyOfPath(study));
    Ok((id, study))
}

/// Reads the identifier in the path, and refuses it if its subject, or that of its study, withdrew consent.
pub(super) async fn visible<T: Located, P: RequiredRight>(parts: &mut Parts, app: &AppState) -> Result<T, Error> {
    let (id, study) = in_path::<T, P>(parts, app).await?;
    if let Some(study) = study {
        consents::may_be_shown(&mut *app.read().await?, study).await?;
    }
    if let Some(subject) = id.subject() {
        consents::has_not_withdrawn(&mut *app.read().await?, subject).await?;
    }
    Ok(id)
}

/// An identifier in a query or form, usable only through [`Named::accessible`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(transparent)]
pub(crate) struct Named<T>(T);

impl<T: Located> Named<T> {
    /// The identifier, if the caller can access its object.
    pub(crate) async fn accessible(self, db: &mut Connection, reach: Reach) -> Result<T, Error> {
        located(db, reach, self.0).await?;
        Ok(self.0)
    }
}

/// The optional identifier, if the caller can access its object.
pub(crate) async fn accessible<T: Located>(
    db: &mut Connection,
    reach: Reach,
    named: Option<Named<T>>,
) -> Result<Option<T>, Error> {
    match named {
        Some(named) => Ok(Some(named.accessible(db, reach).await?)),
        None => Ok(None),
    }
}

/// The identifiers, if the caller can access every object.
pub(crate) async fn all_accessible<T: Located>(
    db: &mut Connection,
    reach: Reach,
    named: Vec<Named<T>>,
) -> Result<Vec<T>, Error> {
    let mut found = Vec::new();
    for named in named {
        found.push(named.accessible(db, reach).await?);
    }
    Ok(found)
}

impl<T> From<T> for Named<T> {
    fn from(id: T) -> Self {
        Self(id)
    }
}

impl<T: FromStr> FromStr for Named<T> {
    type Err = T::Err;
    fn from_str(text: &str) -> Result<Self, T::Err> {
        text.parse().map(Self)
    }
}
