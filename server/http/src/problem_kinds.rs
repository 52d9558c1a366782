//! The kinds of problems: one table for the answers, the description and the pages that explain them.

use axum::http::StatusCode;

/// A kind of problem. Its address is the `type` of a problem document and serves a page that explains it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
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
    /// 412.
    Changed,
    /// 413.
    TooLarge,
    /// 415.
    UnsupportedMediaType,
    /// 422, a field.
    InvalidField,
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

/// What is known of a kind.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    /// Its address.
    pub(super) uri: &'static str,
    /// The HTTP status of most of its answers.
    pub(super) status: StatusCode,
    /// The kind in words.
    pub(super) title: &'static str,
    /// What happened.
    pub(super) meaning: &'static str,
    /// What the sender of the request can do.
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

impl Kind {
    /// Every kind, by status.
    pub(super) const ALL: [Self; 17] = [
        Self::Malformed,
        Self::NotSignedIn,
        Self::Forbidden,
        Self::NotFound,
        Self::MethodNotAllowed,
        Self::Conflict,
        Self::Changed,
        Self::TooLarge,
        Self::UnsupportedMediaType,
        Self::InvalidField,
        Self::Learner,
        Self::TooManyAttempts,
        Self::Internal,
        Self::TimedOut,
        Self::NotReady,
        Self::StorageFull,
        Self::RecordVanished,
    ];

    /// What is known of it.
    pub(super) const fn entry(self) -> Entry {
        match self {
            Self::Malformed => entry(
                "/problems/malformed",
                StatusCode::BAD_REQUEST,
                "The request cannot be read",
                "The body is not JSON, a field has the wrong type, or a header or parameter cannot be read. Nothing was \
                 changed.",
                "Correct the part that the detail names and send the request again.",
            ),
            Self::NotSignedIn => entry(
                "/problems/not-signed-in",
                StatusCode::UNAUTHORIZED,
                "Sign in first",
                "The request has no session or token, or the session or token has ended.",
                "Sign in again, or ask an administrator for a new token and send it as Authorization: Bearer TOKEN.",
            ),
            Self::Forbidden => entry(
                "/problems/forbidden",
                StatusCode::FORBIDDEN,
                "Not allowed",
                "The caller does not have the right that this needs, or the request comes from another site or for \
                 another host name.",
                "Ask an administrator for the right. If the detail names a host, add it with the setting host_names.",
            ),
            Self::NotFound => entry(
                "/problems/not-found",
                StatusCode::NOT_FOUND,
                "Not found",
                "The address, or something that the request names by its identifier, does not exist here.",
                "Check the address and the identifiers.",
            ),
            Self::MethodNotAllowed => entry(
                "/problems/method-not-allowed",
                StatusCode::METHOD_NOT_ALLOWED,
                "Not possible with this method",
                "The address exists, but does not accept this HTTP method.",
                "Use one of the methods in the Allow header.",
            ),
            Self::Conflict => entry(
                "/problems/conflict",
                StatusCode::CONFLICT,
                "Not possible in the present state",
                "The request is well formed but does not fit the state of the record: the study has ended, the name is \
                 taken, the subject withdrew consent. Nothing was changed.",
                "Read the detail, look at the present state, and decide again.",
            ),
            Self::Changed => entry(
                "/problems/changed",
                StatusCode::PRECONDITION_FAILED,
                "It was changed since it was read",
                "The If-Match header names a revision that is no longer the present one. Nothing was changed.",
                "Read it again and repeat the change with its new ETag.",
            ),
            Self::TooLarge => entry(
                "/problems/too-large",
                StatusCode::PAYLOAD_TOO_LARGE,
                "The request is too large",
                "The body is longer than this address accepts. Nothing was changed.",
                "Send less; the detail has the limit.",
            ),
            Self::UnsupportedMediaType => entry(
                "/problems/unsupported-media-type",
                StatusCode::UNSUPPORTED_MEDIA_TYPE,
                "Media type not accepted",
                "The Content-Type of the body is not the one that this address reads. Nothing was changed.",
                "Send the body as application/json, or as the description of the operation says.",
            ),
            Self::InvalidField => entry(
                "/problems/invalid-field",
                StatusCode::UNPROCESSABLE_ENTITY,
                "A field is not acceptable",
                "A field can be read, but its value is out of range or contradicts another one. Nothing was changed.",
                "The members field, value and allowed say what was given and what is accepted.",
            ),
            Self::Learner => entry(
                "/problems/learner",
                StatusCode::UNPROCESSABLE_ENTITY,
                "The learner cannot work with this",
                "The settings or answers of the study are such that the preference learner has no solution.",
                "Change the learner setting that the detail names.",
            ),
            Self::TooManyAttempts => entry(
                "/problems/too-many-attempts",
                StatusCode::TOO_MANY_REQUESTS,
                "Too many attempts",
                "Signing in failed too often.",
                "Wait as many seconds as the Retry-After header says.",
            ),
            Self::Internal => entry(
                "/problems/internal",
                StatusCode::INTERNAL_SERVER_ERROR,
                "The program failed",
                "A fault of the program or the machine. The log has the reason under the request id of the answer.",
                "Tell whoever runs the service the request id.",
            ),
            Self::TimedOut => entry(
                "/problems/timed-out",
                StatusCode::SERVICE_UNAVAILABLE,
                "The answer took too long",
                "The service gave the request up. A change that it asked for may have happened.",
                "Look at the present state, then try again; with the same Idempotency-Key a change happens once.",
            ),
            Self::NotReady => entry(
                "/problems/not-ready",
                StatusCode::SERVICE_UNAVAILABLE,
                "The service is not ready",
                "The record takes no changes, a task of the service is down, or the service is stopping. Nothing was \
                 changed.",
                "The detail has the reason. Tell whoever runs the service, and try again later.",
            ),
            Self::StorageFull => entry(
                "/problems/storage-full",
                StatusCode::INSUFFICIENT_STORAGE,
                "The disk is full",
                "The disk of the record has no room for the change, or too little for what it would begin. Nothing was \
                 changed.",
                "Make room on the disk and send the request again. The service goes on by itself.",
            ),
            Self::RecordVanished => entry(
                "/problems/record-vanished",
                StatusCode::SERVICE_UNAVAILABLE,
                "The record takes no changes",
                "The database file or its write-ahead log was deleted, replaced or cut while the service ran. No change is \
                 accepted, so that none is lost.",
                "Tell whoever runs the service: stop it, run `gaitwright audit verify`, and put a copy in place if the record \
                 is not whole.",
            ),
        }
    }

    /// The kind of an answer of which only the status is known.
    pub(super) fn of_status(status: StatusCode) -> Self {
        let known = Self::ALL.into_iter().find(|kind| kind.entry().status == status);
        known.unwrap_or(if status.is_server_error() { Self::Internal } else { Self::Malformed })
    }

    /// The kind at an address below `/problems/`.
    pub(super) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.entry().name() == name)
    }
}

impl Entry {
    /// The last part of the address.
    pub(super) fn name(&self) -> &'static str {
        self.uri.trim_start_matches("/problems/")
    }
}

#[cfg(test)]
mod tests {
    use super::Kind;
    use std::collections::BTreeSet;

    #[test]
    fn every_problem_kind_has_its_own_address() {
        let names: BTreeSet<_> = Kind::ALL.map(|kind| kind.entry().name()).into();
        assert_eq!(names.len(), Kind::ALL.len());
        for kind in Kind::ALL {
            assert_eq!(Kind::named(kind.entry().name()), Some(kind));
            let status = kind.entry().status;
            assert_eq!(Kind::of_status(status).entry().status, status);
        }
    }
}
