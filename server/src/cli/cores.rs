//! Number of cores of this machine.

/// The given number, or the number of cores.
pub(super) fn cores_or(given: Option<usize>) -> usize {
    given.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, std::num::NonZero::get))
}
