//! Largest request bodies.

/// Largest request body, bytes.
pub(crate) const BODY_LIMIT_BYTES: usize = 1 << 20;
/// The same for callers who are not signed in.
pub(crate) const ANONYMOUS_BODY_LIMIT_BYTES: usize = 64 << 10;
/// The same for uploads of measurement files and reference gaits: a minute of six channels of EMG at 2000 Hz. A request
/// waits while its file is read and checked.
pub(crate) const MEASUREMENT_FILE_LIMIT_BYTES: usize = 8 << 20;
/// Bodies above this size are parsed outside the threads that answer requests.
pub(crate) const LONG_BODY_BYTES: usize = 64 << 10;
