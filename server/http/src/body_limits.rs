//! Largest request bodies.

/// Largest request body, bytes.
pub(crate) const BODY_LIMIT_BYTES: usize = 1 << 20;
/// The same for callers who are not signed in.
pub(crate) const ANONYMOUS_BODY_LIMIT_BYTES: usize = 64 << 10;
/// The same for uploads of measurement files.
pub(crate) const MEASUREMENT_FILE_LIMIT_BYTES: usize = 16 << 20;
