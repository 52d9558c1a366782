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
    ($name:ident, $what:literal) => {
        #[doc = concat!("Identifier of a ", $what, ".")]
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

identifier!(SubjectId, "subject");
identifier!(DeviceId, "device");
identifier!(ReferenceGaitId, "reference gait");
identifier!(StudyId, "study");
identifier!(TrialId, "trial");
identifier!(FeedbackId, "feedback row");
identifier!(JobId, "job");
identifier!(BackupId, "backup");
identifier!(UserId, "user");
identifier!(TokenId, "token");
identifier!(MemberId, "membership in a study");
identifier!(SessionId, "session of a user");
identifier!(BlindPairId, "blind pair");
identifier!(AssessmentId, "assessment");
identifier!(SafetyReportId, "safety report");
identifier!(SafetyReviewId, "safety review");
identifier!(LabSessionId, "lab session");
identifier!(MeasurementFileId, "measurement file of a lab session");
identifier!(ControllerFileDownloadId, "download of a controller file");
identifier!(EmgResultId, "result of EMG processing");

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
