//! Priorities of threads: requests before computations, solves, and certification.

use std::io;
use tokio::sync::oneshot;

/// Threads that compute for a waiting caller; they yield to threads that answer requests.
pub const COMPUTING: i32 = 5;
/// Threads that solve; they yield to everything that a caller waits for.
pub const SOLVER: i32 = 10;
/// Threads that certify and explain; they yield to solves, too.
pub const BACKGROUND_NICENESS: i32 = 19;
/// Stack size of solver threads. Block factorisations recurse deeper than the default allows.
pub const STACK_BYTES: usize = 16 << 20;

/// Lowers the priority of the calling thread, if the system allows it.
pub fn lower_priority(niceness: i32) {
    #[cfg(target_os = "linux")]
    if let Err(error) = rustix::process::setpriority_process(None, niceness) {
        tracing::debug!(%error, niceness, "cannot lower the priority of a thread");
    }
    #[cfg(not(target_os = "linux"))]
    let _ = niceness;
}

/// Runs work on its own thread with lower priority than solves, as [`run_with`].
///
/// # Errors
/// If no thread can be started.
pub fn run_below_solves<T: Send + 'static>(
    name: &str,
    work: impl FnOnce() -> T + Send + 'static,
) -> io::Result<oneshot::Receiver<T>> {
    run_with(BACKGROUND_NICENESS, name, work)
}

/// Runs work on its own thread with this priority. A panic drops the sender. Dropping the receiver abandons the thread.
///
/// # Errors
/// If no thread can be started.
pub fn run_with<T: Send + 'static>(
    niceness: i32,
    name: &str,
    work: impl FnOnce() -> T + Send + 'static,
) -> io::Result<oneshot::Receiver<T>> {
    let (sender, result) = oneshot::channel();
    let work = move || {
        lower_priority(niceness);
        // Fails only if the receiver was dropped.
        let _ = sender.send(work());
    };
    std::thread::Builder::new().name(name.to_owned()).stack_size(STACK_BYTES).spawn(work)?;
    Ok(result)
}
