//! The reader of an error page.

use gaitwright_service::access::Role;

/// The role of the caller, for error pages.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RespondedTo(pub(crate) Option<Role>);
