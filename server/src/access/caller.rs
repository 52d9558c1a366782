//! Who makes a request.

use super::right::{Right, Rights, Role};
use crate::store::UserId;
use crate::store::audit::Actor;
use crate::store::feedback::Source;

/// Who makes a request, and what they may do.
#[derive(Debug, Clone)]
pub struct Caller {
    /// As written into the audit trail.
    pub actor: Actor,
    /// Name shown to people.
    pub name: String,
    /// The user, unless it is a token or nobody signed in.
    pub user: Option<UserId>,
    /// The role of the user.
    pub role: Option<Role>,
    rights: Rights,
}

impl Caller {
    /// A person who signed in.
    pub fn person(id: UserId, name: &str, role: Role) -> Self {
        Self {
            actor: Actor::named(&format!("{} {name}", role.as_str())),
            name: name.to_owned(),
            user: Some(id),
            role: Some(role),
            rights: role.rights(),
        }
    }

    /// A program with a token.
    pub fn token(name: &str, scopes: &[Right]) -> Self {
        Self {
            actor: Actor::named(&format!("token {name}")),
            name: name.to_owned(),
            user: None,
            role: None,
            rights: Rights::of(scopes),
        }
    }

    /// Whoever reaches a service that asks nobody to sign in.
    pub fn without_sign_in() -> Self {
        let actor = Actor::anonymous();
        Self { name: actor.as_str().to_owned(), actor, user: None, role: None, rights: Rights::all() }
    }

    /// Whether it may.
    pub fn may(&self, right: Right) -> bool {
        self.rights.has(right)
    }

    /// Whether the name is known: then it, and not what a form says, is the author of what is said.
    pub fn is_known(&self) -> bool {
        self.role.is_some() || self.actor != Actor::anonymous()
    }

    /// Where an answer of this caller comes from when it does not say so itself.
    pub fn source(&self) -> Source {
        match self.role {
            Some(Role::Rater) => Source::Subject,
            None if self.is_known() => Source::Script,
            _ => Source::Clinician,
        }
    }
}
