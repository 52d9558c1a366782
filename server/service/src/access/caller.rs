//! The caller of a request: a user, a token or nobody, with rights and accessible studies.

use gaitwright_store::accessible_studies::{Principal, Reach};
use gaitwright_store::audit::Actor;
use gaitwright_store::feedback::Source;
use gaitwright_store::rights::{Right, Rights, Role};
use gaitwright_store::{TokenId, UserId};

/// The caller of a request and its rights.
#[derive(Debug, Clone)]
pub struct Caller {
    /// The actor in the audit trail.
    pub actor: Actor,
    /// Name shown to users.
    pub name: String,
    /// The user, unless the caller is a token or not signed in.
    pub user: Option<UserId>,
    /// The role of the user.
    pub role: Option<Role>,
    rights: Rights,
    reach: Reach,
}

impl Caller {
    /// A signed-in user.
    pub fn person(id: UserId, name: &str, role: Role) -> Self {
        let principal = Principal::User(id);
        Self {
            reach: match role {
                Role::Administrator => Reach::Every,
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

    /// A program with a token. A token with the scope `rate` only is a rater.
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

    /// Any caller of a service without sign-in.
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

    /// Whether the caller has a right; `None` needs none.
    pub fn may(&self, right: impl Into<Option<Right>>) -> bool {
        right.into().is_none_or(|right| self.rights.has(right))
    }

    /// The studies that the caller can access.
    pub fn reach(&self) -> Reach {
        self.reach
    }

    /// Whether the caller is the device in the lab: a token with the scope `device` only.
    pub fn is_device(&self) -> bool {
        self.user.is_none() && self.is_known() && self.rights.is_only(Right::Device)
    }

    /// Whether the caller has a name, which then is the author of its answers.
    pub fn is_known(&self) -> bool {
        self.role.is_some() || self.actor != Actor::anonymous()
    }

    /// The default source of this caller's answers.
    pub fn source(&self) -> Source {
        match self.role {
            Some(Role::Rater) => Source::Subject,
            None if self.is_known() => Source::Script,
            _ => Source::Clinician,
        }
    }
}
