//! The kinds of problems: status, title, meaning and remedy of each.

use axum::http::StatusCode;

/// A kind of problem. Its address is the `type` of a problem document, and serves a page that explains it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ProblemKind {
    /// 400.
    Malformed,
    /// 401.
    NotSignedIn,
    /// 403.
    Forbidden,
    /// 404.
    NotFound,
    /// 405.
    MethodNotAllowed,
    /// 409.
    Conflict,
    /// 409, an undo.
    CannotBeUndone,
    /// 412.
    Changed,
    /// 413.
    TooLarge,
    /// 415.
    UnsupportedMediaType,
    /// 422, a field.
    InvalidField,
    /// 422, a cursor.
    CursorOfAnotherList,
    /// 422, the learner.
    Learner,
    /// 429.
    TooManyAttempts,
    /// 500.
    Internal,
    /// 503, too slow.
    TimedOut,
    /// 503, not now.
    NotReady,
    /// 507.
    StorageFull,
    /// 503, no changes.
    RecordVanished,
}

/// The description of a kind.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    /// Its address.
    pub(super) uri: &'static str,
    /// The usual HTTP status.
    pub(super) status: StatusCode,
    /// The name for people.
    pub(super) title: &'static str,
    /// Meaning of the problem.
    pub(super) meaning: &'static str,
    /// How the caller can solve the problem.
    pub(super) remedy: &'static str,
}

const fn entry(
    uri: &'static str,
    status: StatusCode,
    title: &'static str,
    meaning: &'static str,
    remedy: &'static str,
) -> Entry {
    Entry { uri, status, title, meaning, remedy }
}

impl ProblemKind {
    /// Every kind, by status.
    pub(super) const ALL: [Self; 19] = [
        Self::Malformed,
        Self::NotSignedIn,
        Self::Forbidden,
        Self::NotFound,
        Self::MethodNotAllowed,
        Self::Conflict,
        Self::CannotBeUndone,
        Self::Changed,
        Self::TooLarge,
        Self::UnsupportedMediaType,
        Self::InvalidField,
        Self::CursorOfAnotherList,
        Self::Learner,
        Self::TooManyAttempts,
        Self::Internal,
        Self::TimedOut,
        Self::NotReady,
        Self::StorageFull,
        Self::RecordVanished,
    ];

    /// Its description.
    pub(super) const fn entry(self) -> Entry {
        match self {
            Self::Malformed => entry(
                "/problems/malformed",
                StatusCode::BAD_REQUEST,
                "The request cannot be read",
                "The body is not JSON, a field has the wrong type, a header is malformed, or a query parameter is unknown, missing or \
                 given twice. Nothing was changed.",
                "Correct the part that the detail names, then send the request again.",
            ),
            Self::NotSignedIn => entry(
                "/problems/not-signed-in",
                StatusCode::UNAUTHORIZED,
                "Not signed in",
                "The request has no session or token, or the session or token has expired.",
                "Sign in again, or ask an administrator for a new token and send it as Authorization: Bearer TOKEN.",
            ),
            Self::Forbidden => entry(
                "/problems/forbidden",
                StatusCode::FORBIDDEN,
                "Not allowed",
                "The caller lacks the required right, or the request comes from another site, names an unknown host, or comes \
                 through a proxy to a service without sign-in.",
                "Ask an administrator for the right. If the detail names a host, add it to the setting host_names.",
            ),
            Self::NotFound => entry(
                "/problems/not-found",
                StatusCode::NOT_FOUND,
                "Not found",
                "The address does not exist, or the request names something that does not exist or that the caller cannot \
                 access.",
                "Check the address and the identifiers.",
            ),
            Self::MethodNotAllowed => entry(
                "/problems/method-not-allowed",
                StatusCode::METHOD_NOT_ALLOWED,
                "Method not allowed",
                "The address exists, but does not accept this HTTP method.",
                "Use one of the methods in the Allow header.",
            ),
            Self::Conflict => entry(
                "/problems/conflict",
                StatusCode::CONFLICT,
                "Conflict with the current state",
                "The request is valid, but the current state does not allow it: for example, the study has ended, the name is \
                 taken, or the subject withdrew consent. Nothing was changed.",
                "Read the detail and the current state, then decide whether to repeat the request.",
            ),
            Self::CannotBeUndone => entry(
                "/problems/cannot-be-undone",
                StatusCode::CONFLICT,
                "The answer cannot be undone",
                "A person's answer can be undone once, within two minutes, as long as it counts. Safety reports and answers \
                 that an undo brought back cannot be undone. Nothing was changed.",
                "Change the answer, or retract it with a reason. Staff review safety reports.",
            ),
            Self::Changed => entry(
                "/problems/changed",
                StatusCode::PRECONDITION_FAILED,
                "Changed since it was read",
                "The If-Match header names an old revision. Nothing was changed.",
                "Read the resource again, then repeat the change with its new ETag.",
            ),
            Self::TooLarge => entry(
                "/problems/too-large",
                StatusCode::PAYLOAD_TOO_LARGE,
                "The request is too large",
                "The body exceeds the limit for this address. Nothing was changed.",
                "Send a smaller body. The detail names the limit.",
            ),
            Self::UnsupportedMediaType => entry(
                "/problems/unsupported-media-type",
                StatusCode::UNSUPPORTED_MEDIA_TYPE,
                "Unsupported media type",
                "This address does not accept the Content-Type of the body. Nothing was changed.",
                "Send the body as application/json, or in the media type that the description of the operation names.",
            ),
            Self::InvalidField => entry(
                "/problems/invalid-field",
                StatusCode::UNPROCESSABLE_ENTITY,
                "Invalid field",
                "The value of a field or query parameter is not accepted or contradicts another field. Nothing was changed.",
                "Correct the field. In the problem document, `field` is its name, `value` is the refused value, and `allowed` describes \
                 the accepted values.",
            ),
            Self::CursorOfAnotherList => entry(
                "/problems/cursor-of-another-list",
                StatusCode::UNPROCESSABLE_ENTITY,
                "Cursor of another list",
                "The cursor comes from a page of another list, or of this list with other filters or in another order.",
                "Repeat the path, the filters and the order of the first page in the request for each further page, or leave out \
                 the cursor to begin with the first page.",
            ),
            Self::Learner => entry(
                "/problems/learner",
                StatusCode::UNPROCESSABLE_ENTITY,
                "The learner failed",
                "The learner found no solution for the settings and answers of the study.",
                "Create a new study with other learner settings.",
            ),
            Self::TooManyAttempts => entry(
                "/problems/too-many-attempts",
                StatusCode::TOO_MANY_REQUESTS,
                "Too many attempts",
                "Too many sign-in attempts failed.",
                "Wait for the number of seconds in the Retry-After header.",
            ),
            Self::Internal => entry(
                "/problems/internal",
                StatusCode::INTERNAL_SERVER_ERROR,
                "Internal error",
                "The program or the machine failed. The log has the cause, under the request ID of this response.",
                "Give the request ID to the administrator.",
            ),
            Self::TimedOut => entry(
                "/problems/timed-out",
                StatusCode::SERVICE_UNAVAILABLE,
                "The request timed out",
                "The service stopped waiting for the request. A change may still have been made.",
                "Check the current state, then try again. With the same Idempotency-Key, a change is made only once.",
            ),
            Self::NotReady => entry(
                "/problems/not-ready",
                StatusCode::SERVICE_UNAVAILABLE,
                "The service is not ready",
                "The record cannot be written, a background task has failed, or the service is stopping. Nothing was changed.",
                "Give the detail to the administrator, and try again later.",
            ),
            Self::StorageFull => entry(
                "/problems/storage-full",
                StatusCode::INSUFFICIENT_STORAGE,
                "Not enough disk space",
                "The disk that holds the record has too little space for the change, or for the work that it \
                 would start. Nothing was changed.",
                "Free some space, then send the request again. The service does not need a restart.",
            ),
            Self::RecordVanished => entry(
                "/problems/record-vanished",
                StatusCode::SERVICE_UNAVAILABLE,
                "The record accepts no changes",
                "The database file or its write-ahead log was deleted, replaced or truncated, or another program wrote to it, \
                 while the service was running. The service refuses changes, because they could be lost or depend on forged \
                 rows.",
                "Tell the administrator to stop the service, run `gaitwright audit verify`, and restore a backup if it reports \
                 damage.",
            ),
        }
    }

    /// The kind of a response that has only a status.
    pub(super) fn of_status(status: StatusCode) -> Self {
        let known = Self::ALL.into_iter().find(|kind| kind.entry().status == status);
        known.unwrap_or(if status.is_server_error() { Self::Internal } else { Self::Malformed })
    }

    /// The kind with this address below `/problems/`.
    pub(super) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.entry().name() == name)
    }
}

impl Entry {
    /// The last segment of the address.
    pub(super) fn name(&self) -> &'static str {
        self.uri.trim_start_matches("/problems/")
    }
}

#[cfg(test)]
mod tests {
    use super::ProblemKind;
    use std::collections::BTreeSet;

    #[test]
    fn every_problem_kind_has_its_own_address() {
        let names: BTreeSet<_> = ProblemKind::ALL.map(|kind| kind.entry().name()).into();
        assert_eq!(names.len(), ProblemKind::ALL.len());
        for kind in ProblemKind::ALL {
            assert_eq!(ProblemKind::named(kind.entry().name()), Some(kind));
            let status = kind.entry().status;
            assert_eq!(ProblemKind::of_status(status).entry().status, status);
        }
    }
}
