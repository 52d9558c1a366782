//! Threads that give way to others.

/// Of threads that solve: they give way to whoever waits for an answer.
pub(super) const SOLVER: i32 = 10;
/// Of threads that examine what was solved: they give way to every solve, too.
pub(crate) const EXAMINER: i32 = 19;

/// Lowers the priority of this thread alone; where that is not possible it stays as it is.
pub(crate) fn stand_back(niceness: i32) {
    #[cfg(target_os = "linux")]
    if let Err(error) = rustix::process::setpriority_process(None, niceness) {
        tracing::debug!(%error, niceness, "a thread keeps its priority");
    }
    #[cfg(not(target_os = "linux"))]
    let _ = niceness;
}
