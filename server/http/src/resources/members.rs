//! Members of studies.

use gaitwright_store::members::{self, MemberKind};
use gaitwright_store::rights::Role;
use gaitwright_store::{Instant, MemberId, StudyId};
use serde::Serialize;
use utoipa::ToSchema;

/// Member of a study.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Member {
    /// Identifier of the membership.
    id: MemberId,
    /// Identifier of the study.
    study_id: StudyId,
    /// Whether it is a user or a token.
    kind: MemberKind,
    /// Name of the user or the token.
    name: String,
    /// Role of a user. Null for a token.
    role: Option<Role>,
    /// Actor who added the member.
    added_by: String,
    /// Time at which the member was added.
    created_at: Instant,
}

impl From<members::Member> for Member {
    fn from(row: members::Member) -> Self {
        let members::Member { id, study_id, kind, name, role, added_by, created_at } = row;
        Self { id, study_id, kind, name, role, added_by, created_at }
    }
}
