//! Identifiers: UUIDv7, with one type for each kind of object, so that they cannot be confused.

use serde::{Deserialize, Serialize};
use sqlx::encode::IsNull;
use sqlx::error::BoxDynError;
use sqlx::{Decode, Encode, Sqlite, Type};
use std::fmt;
use std::str::FromStr;
use utoipa::ToSchema;
use uuid::Uuid;

macro_rules! identifier {
    ($(#[$($attribute:tt)*])* $name:ident) => {
        $(#[$($attribute)*])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
        #[serde(transparent)]
        #[schema(value_type = String, format = Uuid)]
        pub struct $name(Uuid);

        impl $name {
            /// A new identifier, larger than all earlier ones of this process.
            pub fn fresh() -> Self {
                Self(Uuid::now_v7())
            }

            /// The last characters, for display.
            pub fn short(self) -> String {
                let text = self.0.simple().to_string();
                text[text.len() - 8..].to_owned()
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.hyphenated().fmt(f)
            }
        }

        impl FromStr for $name {
            type Err = uuid::Error;
            fn from_str(text: &str) -> Result<Self, Self::Err> {
                Uuid::parse_str(text).map(Self)
            }
        }

        impl Type<Sqlite> for $name {
            fn type_info() -> sqlx::sqlite::SqliteTypeInfo {
                <String as Type<Sqlite>>::type_info()
            }
        }

        impl Encode<'_, Sqlite> for $name {
            fn encode_by_ref(
                &self,
                buffer: &mut <Sqlite as sqlx::Database>::ArgumentBuffer,
            ) -> Result<IsNull, BoxDynError> {
                <String as Encode<'_, Sqlite>>::encode(self.to_string(), buffer)
            }
        }

        impl Decode<'_, Sqlite> for $name {
            fn decode(value: <Sqlite as sqlx::Database>::ValueRef<'_>) -> Result<Self, BoxDynError> {
                Ok(<&str as Decode<'_, Sqlite>>::decode(value)?.parse()?)
            }
        }
    };
}

identifier!(
    /// Identifier of a subject.
    SubjectId
);
identifier!(
    /// Identifier of a device.
    DeviceId
);
identifier!(
    /// Identifier of a reference gait.
    ReferenceGaitId
);
identifier!(
    /// Identifier of a study.
    StudyId
);
identifier!(
    /// Identifier of a trial.
    TrialId
);
identifier!(
    /// Identifier of an entry of the feedback of a study.
    FeedbackId
);
identifier!(
    /// Identifier of a solve job.
    SolveJobId
);
identifier!(
    /// Identifier of a backup.
    BackupId
);
identifier!(
    /// Identifier of a user.
    UserId
);
identifier!(
    /// Identifier of a token.
    TokenId
);
identifier!(
    /// Identifier of a membership in a study.
    MemberId
);
identifier!(
    /// Identifier of a sign-in session of a user.
    SessionId
);
identifier!(
    /// Identifier of a blind pair.
    BlindPairId
);
identifier!(
    /// Identifier of an assessment.
    AssessmentId
);
identifier!(
    /// Identifier of an answer to a comparison: of a preference or of an assessment.
    AnswerId
);
identifier!(
    /// Identifier of a safety report.
    SafetyReportId
);
identifier!(
    /// Identifier of a safety review.
    SafetyReviewId
);
identifier!(
    /// Identifier of a lab session.
    LabSessionId
);
identifier!(
    /// Identifier of a measurement file of a lab session.
    MeasurementFileId
);
identifier!(
    /// Identifier of a download of a controller file.
    ControllerFileDownloadId
);
identifier!(
    /// Identifier of a result of EMG processing.
    EmgResultId
);

macro_rules! holds_safety_reports {
    ($($name:ident),*) => {
        $(impl From<$name> for SafetyReportId {
            /// The safety report that this object holds has the same identifier.
            fn from(holder: $name) -> Self {
                Self(holder.0)
            }
        })*
    };
}
holds_safety_reports!(BlindPairId, AssessmentId, LabSessionId);

impl From<FeedbackId> for AnswerId {
    fn from(preference: FeedbackId) -> Self {
        Self(preference.0)
    }
}

impl From<AssessmentId> for AnswerId {
    fn from(assessment: AssessmentId) -> Self {
        Self(assessment.0)
    }
}

impl AnswerId {
    /// The identifier, if the answer is a preference.
    pub fn of_preference(self) -> FeedbackId {
        FeedbackId(self.0)
    }

    /// The identifier, if the answer is an assessment.
    pub fn of_assessment(self) -> AssessmentId {
        AssessmentId(self.0)
    }
}
