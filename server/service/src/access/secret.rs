//! Random secrets, stored as SHA-256, and password hashing with argon2id.

use super::password;
use crate::error::Error;
use argon2::Argon2;
use argon2::password_hash::phc::PasswordHash;
use argon2::password_hash::{PasswordHasher as _, PasswordVerifier as _};
use sha2::{Digest, Sha256};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::Semaphore;

/// A new random secret of 256 bits, in hexadecimal.
///
/// # Errors
/// When the operating system cannot provide random numbers.
pub fn fresh() -> Result<String, Error> {
    let mut bytes = [0_u8; 32];
    getrandom::fill(&mut bytes)
        .map_err(|e| Error::Internal(format!("the operating system cannot provide random numbers: {e}")))?;
    Ok(hex::encode(bytes))
}

/// The stored hash of a secret. A fast hash is enough, because a random secret cannot be guessed.
pub fn hash(secret: &str) -> String {
    hex::encode(Sha256::digest(secret.as_bytes()))
}

/// Limits parallel password hashes, each of which takes a core and 19 MiB.
static PARALLEL_HASHES: Semaphore = Semaphore::const_new(2);

/// Queues of password checks, one for each network, so that many attempts from one network do not delay others.
#[derive(Debug, Default)]
pub struct PasswordCheckQueues(Mutex<HashMap<String, Arc<Semaphore>>>);

impl PasswordCheckQueues {
    /// Runs [`on_blocking_thread`] after earlier checks of the same network.
    ///
    /// # Errors
    /// If the work panics.
    pub async fn run<T: Send + 'static>(
        &self,
        network: &str,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Error> {
        let line = Arc::clone(self.networks().entry(network.to_owned()).or_insert_with(|| Semaphore::new(1).into()));
        let turn = Arc::clone(&line).acquire_owned().await.map_err(|e| Error::Internal(e.to_string()))?;
        let done = on_blocking_thread(move || {
            let _turn = turn;
            work()
        })
        .await;
        drop(line);
        // Forget networks without waiting checks.
        self.networks().retain(|_, line| Arc::strong_count(line) > 1);
        done
    }

    fn networks(&self) -> MutexGuard<'_, HashMap<String, Arc<Semaphore>>> {
        // The map is whole between any two statements that hold the lock.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Runs password hashing on a blocking thread, within the limit of parallel hashes.
///
/// # Errors
/// If the work panics.
pub async fn on_blocking_thread<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Result<T, Error> {
    let failed = |reason: String| Error::Internal(format!("password hashing failed: {reason}"));
    let turn = PARALLEL_HASHES.acquire().await.map_err(|e| failed(e.to_string()))?;
    // The permit ends with the work, even if the caller disconnects earlier.
    let work = move || {
        let _turn = turn;
        work()
    };
    // The semaphore bounds the number of threads.
    #[allow(clippy::disallowed_methods)]
    let done = tokio::task::spawn_blocking(work);
    done.await.map_err(|e| failed(e.to_string()))
}

/// The stored hash of a user's password. Takes tens of milliseconds on purpose, so call it in [`on_blocking_thread`].
///
/// # Errors
/// [`Error::Invalid`] for a password that is too short, too long or easily guessed.
pub fn hash_password_of(name: &str, password: &str) -> Result<String, Error> {
    password::check(password, name)?;
    let mut salt = [0_u8; 16];
    getrandom::fill(&mut salt)
        .map_err(|e| Error::Internal(format!("the operating system cannot provide random numbers: {e}")))?;
    let hash = Argon2::default()
        .hash_password_with_salt(password.as_bytes(), &salt)
        .map_err(|e| Error::Internal(format!("cannot hash a password: {e}")))?;
    Ok(hash.to_string())
}

/// [`hash_password_of`] without a name to check against.
///
/// # Errors
/// [`Error::Invalid`] for a password that is too short, too long or easily guessed.
pub fn hash_password(password: &str) -> Result<String, Error> {
    hash_password_of("", password)
}

/// Whether a password matches the stored hash. Takes the same time without a stored hash.
pub fn is_password(password: &str, stored: Option<&str>) -> bool {
    let parsed = stored.and_then(|text| PasswordHash::new(text).ok());
    if let Some(hash) = parsed {
        return Argon2::default().verify_password(password.as_bytes(), &hash).is_ok();
    }
    // The same work as a real check, so that timing does not reveal which users exist.
    let _ = Argon2::default().hash_password_with_salt(password.as_bytes(), b"nobody is there!");
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn secrets_differ_and_hashes_do_not_contain_them() {
        let (a, b) = (fresh().unwrap(), fresh().unwrap());
        assert_ne!(a, b);
        assert_eq!((a.len(), hash(&a).len()), (64, 64));
        assert_ne!(hash(&a), a);
        assert_eq!(hash(&a), hash(&a));
    }

    #[test]
    fn passwords_are_salted_and_verified() {
        let stored = hash_password("correct horse battery").unwrap();
        assert!(stored.starts_with("$argon2id$"));
        assert_ne!(stored, hash_password("correct horse battery").unwrap());
        assert!(is_password("correct horse battery", Some(&stored)));
        assert!(!is_password("correct horsf", Some(&stored)));
        assert!(!is_password("correct horse battery", None));
        assert!(hash_password("short").is_err());
    }
}
