//! Access control: users, roles, tokens, sessions, passwords and rights. Knows nothing of HTTP.
//!
//! Users sign in with a one-time link or a password and have a role. Programs send a token with scopes. Both give
//! [`Rights`], which every check uses.

pub mod back_off;
mod caller;
mod likely_words;
pub mod monotonic_clock;
pub mod password;
mod required_right;
pub mod secret;
pub mod session;
pub mod sign_in;
pub mod tokens;
pub mod user_administration;

pub use caller::Caller;
pub use gaitwright_store::accessible_studies::{Principal, Reach};
pub use gaitwright_store::rights::{Right, Rights, Role};
pub use monotonic_clock::Clock;
pub use required_right::{Administer, Answer, AnyCaller, Device, Rate, Read, RequiredRight, Run};
