//! Who makes a request.

use gaitwright_store::audit::Actor;
use gaitwright_store::feedback::Source;
use gaitwright_store::reach::{Principal, Reach};
use gaitwright_store::rights::{Right, Rights, Role};
use gaitwright_store::{TokenId, UserId};

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
    reach: Reach,
}

impl Caller {
    /// A person who signed in.
    pub fn person(id: UserId, name: &str, role: Role) -> Self {
        let principal = Principal::User(id);
        Self {
            reach: match role {
                Role::Admin => Reach::Every,
                Role::Clinician => Reach::Open(principal),
                Role::Rater => Reach::Assigned(principal),
            },
            actor: Actor::user(id, &format!("{} {name}", role.as_str())),
            name: name.to_owned(),
            user: Some(id),
            role: Some(role),
            rights: role.rights(),
        }
    }

    /// A program with a token. One that may compare gaits blindly and nothing else is a rater.
    pub fn token(id: TokenId, name: &str, scopes: &[Right]) -> Self {
        let principal = Principal::Token(id);
        let rates_only = scopes.iter().all(|scope| *scope == Right::Rate);
        Self {
            reach: if rates_only { Reach::Assigned(principal) } else { Reach::Open(principal) },
            actor: Actor::named(&format!("{}{name}", Actor::OF_TOKENS)),
            name: name.to_owned(),
            user: None,
            role: None,
            rights: Rights::of(scopes),
        }
    }

    /// Whoever reaches a service that asks nobody to sign in.
    pub fn without_sign_in() -> Self {
        let actor = Actor::anonymous();
        Self {
            name: actor.as_str().to_owned(),
            actor,
            user: None,
            role: None,
            rights: Rights::all(),
            reach: Reach::Every,
        }
    }

    /// Whether it may; none: what asks for no right.
    pub fn may(&self, right: impl Into<Option<Right>>) -> bool {
        right.into().is_none_or(|right| self.rights.has(right))
    }

    /// Which studies it reaches.
    pub fn reach(&self) -> Reach {
        self.reach
    }

    /// Whether it is the device in the lab: a program that can fetch controller files and nothing else.
    pub fn is_device(&self) -> bool {
        self.user.is_none() && self.is_known() && self.rights.is_only(Right::Device)
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
