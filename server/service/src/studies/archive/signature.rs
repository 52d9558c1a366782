//! Ed25519 keys and signatures of archives.

use crate::error::Error;
use ring::rand::SystemRandom;
use ring::signature::{ED25519, Ed25519KeyPair, KeyPair, UnparsedPublicKey};
use std::str::FromStr;

/// Prefix of the key in a key file.
const PREFIX: &str = "gaitwright signing key 1 ";

/// A private key.
pub struct SigningKey(Ed25519KeyPair);

impl std::fmt::Debug for SigningKey {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "SigningKey({})", self.public())
    }
}

impl SigningKey {
    /// Generates a key and returns the text of its key file.
    ///
    /// # Errors
    /// When the operating system cannot provide random numbers.
    pub fn generate() -> Result<String, Error> {
        let document = Ed25519KeyPair::generate_pkcs8(&SystemRandom::new())
            .map_err(|_| Error::Internal("the operating system cannot provide random numbers".to_owned()))?;
        Ok(format!("{PREFIX}{}\n", hex::encode(document.as_ref())))
    }

    /// Reads the text of a key file.
    ///
    /// # Errors
    /// [`Error::Malformed`] for any other text.
    pub fn read(text: &str) -> Result<Self, Error> {
        let refuse = || {
            Error::Malformed(
                "The file given with --sign is not a key file. Create one with `gaitwright signing-key`.".to_owned(),
            )
        };
        let document = text.trim().strip_prefix(PREFIX.trim_end()).ok_or_else(refuse)?;
        let document = hex::decode(document.trim()).map_err(|_| refuse())?;
        Ed25519KeyPair::from_pkcs8(&document).map(Self).map_err(|_| refuse())
    }

    /// The public key.
    pub fn public(&self) -> PublicKey {
        PublicKey(hex::encode(self.0.public_key().as_ref()))
    }

    /// Signs a message; hexadecimal.
    pub(super) fn sign(&self, message: &str) -> String {
        hex::encode(self.0.sign(message.as_bytes()))
    }
}

/// A public key: 64 hexadecimal digits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PublicKey(String);

impl PublicKey {
    /// The hexadecimal digits.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Whether this key signed the message.
    pub(super) fn signed(&self, message: &str, signature: &str) -> bool {
        let (Ok(key), Ok(signature)) = (hex::decode(&self.0), hex::decode(signature)) else { return false };
        UnparsedPublicKey::new(&ED25519, key).verify(message.as_bytes(), &signature).is_ok()
    }
}

impl std::fmt::Display for PublicKey {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl FromStr for PublicKey {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim().to_ascii_lowercase();
        if text.len() == 64 && text.bytes().all(|byte| byte.is_ascii_hexdigit()) {
            Ok(Self(text))
        } else {
            Err("A public key has 64 hexadecimal digits, as printed by `gaitwright signing-key`.".to_owned())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signature_verifies_one_message_with_one_key() {
        let key = SigningKey::read(&SigningKey::generate().unwrap()).unwrap();
        let other = SigningKey::read(&SigningKey::generate().unwrap()).unwrap();
        let signature = key.sign("a");
        assert!(key.public().signed("a", &signature));
        assert!(!key.public().signed("b", &signature) && !other.public().signed("a", &signature));
        assert!(!key.public().signed("a", "zz") && !key.public().signed("a", ""));
        assert_eq!(key.public().to_string().parse(), Ok(key.public()));
        assert!("00".parse::<PublicKey>().is_err());
        assert!(SigningKey::read("gaitwright signing key 1 00").is_err() && SigningKey::read("").is_err());
    }
}
