//! Largest request bodies.

/// Largest request body, bytes.
pub(crate) const BODY_LIMIT_BYTES: usize = 1 << 20;
/// Largest request body of callers who are not signed in, bytes.
pub(crate) const ANONYMOUS_BODY_LIMIT_BYTES: usize = 64 << 10;
/// Largest uploaded measurement file or reference gait, bytes: a minute of six channels of EMG at 2000 Hz. A request waits
/// while its file is read and checked.
pub(crate) const MEASUREMENT_FILE_LIMIT_BYTES: usize = 8 << 20;
/// Bodies above this size are parsed outside the threads that answer requests.
pub(crate) const LONG_BODY_BYTES: usize = 64 << 10;
