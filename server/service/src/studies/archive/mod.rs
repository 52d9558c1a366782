//! A whole study as one file: every row that belongs to it, as written, so that it can be taken to another record.
//!
//! An archive comes from outside. It is unpacked into a record of its own first ([`open`]): every hash, every reference
//! and every value is checked there by the rules of its noun, and only what passed is written ([`import`]).

mod check;
mod export;
pub mod file;
mod import;
mod signature;

pub use export::export;
pub use import::{Archive, import, open};
pub use signature::{PublicKey, SigningKey};
