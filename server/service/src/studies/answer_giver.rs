//! Source of an answer, as requests and forms state it.

use crate::error::Error;
use gaitwright_store::feedback::Source;
use serde::{Deserialize, Serialize};
use std::str::FromStr;
use utoipa::ToSchema;

/// Source of an answer in a request: `subject`, the person who walks; `clinician`; `script`, a lab script.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum AnswerGiver {
    /// The subject.
    Subject,
    /// A clinician.
    Clinician,
    /// A script of the lab.
    Script,
}

impl From<AnswerGiver> for Source {
    fn from(giver: AnswerGiver) -> Self {
        match giver {
            AnswerGiver::Subject => Self::Subject,
            AnswerGiver::Clinician => Self::Clinician,
            AnswerGiver::Script => Self::Script,
        }
    }
}

impl FromStr for AnswerGiver {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        match text {
            "subject" => Ok(Self::Subject),
            "clinician" => Ok(Self::Clinician),
            "script" => Ok(Self::Script),
            other => Err(Error::invalid("source", other, "subject, clinician or script")),
        }
    }
}
