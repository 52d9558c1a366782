//! How an answer relates to an earlier one.

use crate::AnswerId;

/// How an answer relates to an earlier one, whose identifier is an `Id` if both are of the same kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin<Id> {
    /// It is independent of earlier answers.
    New,
    /// It was given in place of this answer.
    Replaces(AnswerId),
    /// It brings this answer back, because the change to another one was undone.
    Restores(Id),
}

impl<Id: Copy> Origin<Id> {
    /// The origin of an answer that may replace another one.
    pub fn replacing(replaced: Option<AnswerId>) -> Self {
        replaced.map_or(Self::New, Self::Replaces)
    }

    /// The answer in whose place it was given.
    pub fn replaces(self) -> Option<AnswerId> {
        if let Self::Replaces(id) = self { Some(id) } else { None }
    }

    /// The answer that it brings back.
    pub fn restores(self) -> Option<Id> {
        if let Self::Restores(id) = self { Some(id) } else { None }
    }
}
