//! Access: who is there, and what they may do. Says nothing of HTTP.
//!
//! People sign in with a one-time link or a password and have a role; programs of the lab carry a token and have
//! scopes. Either gives [`Rights`], the only thing that is ever asked for.

pub mod back_off;
mod caller;
pub mod clock;
pub mod password;
pub mod people;
mod permission;
pub mod secret;
pub mod sign_in;
pub mod tokens;

pub use caller::Caller;
pub use clock::Clock;
pub use gaitwright_store::reach::{Principal, Reach};
pub use gaitwright_store::rights::{Right, Rights, Role};
pub use permission::{Administer, Answer, Anything, Device, Permission, Rate, Read, Run};
