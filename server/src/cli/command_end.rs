//! How a command ends that did not fail with an error.

/// How a command ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CommandEnd {
    /// It succeeded.
    Done,
    /// A person stopped it.
    Interrupted,
    /// Part of it failed because of the program or the machine.
    Failed,
}
