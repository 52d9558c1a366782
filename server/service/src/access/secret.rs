//! Secrets: drawn by the system, shown once, stored as SHA-256. Passwords as argon2id.

use super::password;
use crate::error::Error;
use argon2::Argon2;
use argon2::password_hash::phc::PasswordHash;
use argon2::password_hash::{PasswordHasher as _, PasswordVerifier as _};
use sha2::{Digest, Sha256};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::Semaphore;

/// A fresh secret of 256 bits, as hexadecimal digits.
///
/// # Errors
/// When the system has no random numbers.
pub fn fresh() -> Result<String, Error> {
    let mut bytes = [0_u8; 32];
    getrandom::fill(&mut bytes).map_err(|e| Error::Internal(format!("no random numbers: {e}")))?;
    Ok(hex::encode(bytes))
}

/// What is stored of a random secret. It has too many bits to be guessed, so a fast hash is enough.
pub fn hash(secret: &str) -> String {
    hex::encode(Sha256::digest(secret.as_bytes()))
}

/// Each takes a core and 19 MiB: whoever asks for many waits.
static AT_ONCE: Semaphore = Semaphore::const_new(2);

/// The passwords of one network are compared one after the other: whoever sends many waits behind their own, and others
/// wait for one of them at most.
#[derive(Debug, Default)]
pub struct Turns(Mutex<HashMap<String, Arc<Semaphore>>>);

impl Turns {
    /// Works on a password [`aside`], when those of this network before it are done.
    ///
    /// # Errors
    /// When the work panics.
    pub async fn aside<T: Send + 'static>(
        &self,
        network: &str,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Error> {
        let line = Arc::clone(self.networks().entry(network.to_owned()).or_insert_with(|| Semaphore::new(1).into()));
        let turn = Arc::clone(&line).acquire_owned().await.map_err(|e| Error::Internal(e.to_string()))?;
        let done = aside(move || {
            let _turn = turn;
            work()
        })
        .await;
        drop(line);
        // A network that nobody waits for is forgotten.
        self.networks().retain(|_, line| Arc::strong_count(line) > 1);
        done
    }

    fn networks(&self) -> MutexGuard<'_, HashMap<String, Arc<Semaphore>>> {
        // The map is whole between any two statements that hold the lock.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Works on a password where that holds up nothing else.
///
/// # Errors
/// When the work panics.
pub async fn aside<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Result<T, Error> {
    let failed = |reason: String| Error::Internal(format!("working on a password: {reason}"));
    let turn = AT_ONCE.acquire().await.map_err(|e| failed(e.to_string()))?;
    // The turn ends with the work: whoever asked may go away before.
    let work = move || {
        let _turn = turn;
        work()
    };
    // Bounded by the turn.
    #[allow(clippy::disallowed_methods)]
    let done = tokio::task::spawn_blocking(work);
    done.await.map_err(|e| failed(e.to_string()))
}

/// What is stored of a password of the user with this name. Takes tens of milliseconds on purpose: call it [`aside`].
///
/// # Errors
/// [`Error::Invalid`] for a password that is too short, too long or easily guessed.
pub fn hash_password_of(name: &str, password: &str) -> Result<String, Error> {
    password::check(password, name)?;
    let mut salt = [0_u8; 16];
    getrandom::fill(&mut salt).map_err(|e| Error::Internal(format!("no random numbers: {e}")))?;
    let hash = Argon2::default()
        .hash_password_with_salt(password.as_bytes(), &salt)
        .map_err(|e| Error::Internal(format!("cannot hash a password: {e}")))?;
    Ok(hash.to_string())
}

/// [`hash_password_of`] somebody whose name does not matter.
///
/// # Errors
/// [`Error::Invalid`] for a password that is too short, too long or easily guessed.
pub fn hash_password(password: &str) -> Result<String, Error> {
    hash_password_of("", password)
}

/// Whether a password is the one that was stored. Takes as long when nothing was stored.
pub fn is_password(password: &str, stored: Option<&str>) -> bool {
    let parsed = stored.and_then(|text| PasswordHash::new(text).ok());
    if let Some(hash) = parsed {
        return Argon2::default().verify_password(password.as_bytes(), &hash).is_ok();
    }
    // As much work as a real comparison: the time says nothing about who exists.
    let _ = Argon2::default().hash_password_with_salt(password.as_bytes(), b"nobody is there!");
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn secrets_differ_and_their_hashes_do_not_show_them() {
        let (a, b) = (fresh().unwrap(), fresh().unwrap());
        assert_ne!(a, b);
        assert_eq!((a.len(), hash(&a).len()), (64, 64));
        assert_ne!(hash(&a), a);
        assert_eq!(hash(&a), hash(&a));
    }

    #[test]
    fn a_password_is_recognised_and_salted() {
        let stored = hash_password("correct horse").unwrap();
        assert!(stored.starts_with("$argon2id$"));
        assert_ne!(stored, hash_password("correct horse").unwrap());
        assert!(is_password("correct horse", Some(&stored)));
        assert!(!is_password("correct horsf", Some(&stored)));
        assert!(!is_password("correct horse", None));
        assert!(hash_password("short").is_err());
    }
}
