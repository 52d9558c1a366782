//! Ctrl-C and SIGTERM.

use super::output::tell;
use gait_optimizer::CancelToken;

/// Waits for Ctrl-C or SIGTERM. From this call on, before the future is polled, these signals no longer end the
/// process.
#[cfg(unix)]
pub(super) fn interrupted() -> impl Future<Output = ()> + use<> {
    use tokio::signal::unix::{SignalKind, signal};
    let signals = [SignalKind::interrupt(), SignalKind::terminate()].map(signal);
    async move {
        if let [Ok(mut interrupt), Ok(mut terminate)] = signals {
            tokio::select! {
                _ = interrupt.recv() => {}
                _ = terminate.recv() => {}
            }
        } else {
            // Without signal handlers the process is killed, which the record survives.
            std::future::pending::<()>().await;
        }
    }
}

/// Ctrl-C.
#[cfg(not(unix))]
pub(super) async fn interrupted() {
    if tokio::signal::ctrl_c().await.is_err() {
        std::future::pending::<()>().await;
    }
}

/// A token that the first Ctrl-C cancels.
pub(super) fn cancelled_by_signal() -> CancelToken {
    let token = CancelToken::new();
    let (on_signal, interrupted) = (token.clone(), interrupted());
    tokio::spawn(async move {
        interrupted.await;
        tell("stopping");
        on_signal.cancel();
    });
    token
}
