//! Archives: a whole study as one file, for export to another record.
//!
//! An archive is untrusted input. [`open`] unpacks it into a temporary record and checks every hash, reference and
//! value there; [`import`] writes only an archive that passed.

pub mod archive_file;
mod check;
mod import;
mod signature;
mod study_export;

pub use import::{Archive, import, open};
pub use signature::{PublicKey, SigningKey};
pub use study_export::export;
