//! The password policy: refuses passwords that are short or easy to guess.
//!
//! As NIST SP 800-63B-4 recommends for a password that is the only factor, the policy asks for length and refuses
//! predictable passwords; it does not ask for kinds of characters.

use super::likely_words::LIKELY_WORDS;
use crate::error::{Error, FieldError};
use zxcvbn::zxcvbn;

/// Minimum length, characters.
pub const MIN_LENGTH: usize = 15;
/// Maximum length, bytes.
const MAX_BYTES: usize = 1000;

/// Minimum estimated number of guesses, as a power of ten. Four predictable parts, such as two common words, a year and
/// an exclamation mark, have about 12; random passwords of the minimum length have 15.
const MIN_GUESSES: f64 = 12.5;

/// Refuses a password that is too short, too long, or predictable for somebody who knows the name of the user.
///
/// # Errors
/// [`Error::Invalid`], which does not contain the password.
pub fn check(password: &str, name: &str) -> Result<(), Error> {
    let length = password.chars().count();
    if length < MIN_LENGTH || password.len() > MAX_BYTES {
        let allowed = format!("at least {MIN_LENGTH} characters and at most {MAX_BYTES} bytes long");
        let characters = if length == 1 { "character" } else { "characters" };
        return Err(FieldError::described("password", &format!("{length} {characters} long"), &allowed).into());
    }
    let known: Vec<&str> = name.split_whitespace().chain([name]).chain(LIKELY_WORDS.iter().copied()).collect();
    if zxcvbn(password, &known).guesses_log10() < MIN_GUESSES {
        let message = "The new password is too easy to guess. Use, for example, four unrelated words. Names, common words \
                       in any language, well-known phrases, keyboard rows, dates, sequences such as 1234 and \
                       repetitions add little strength.";
        return Err(FieldError::in_words("password", message).into());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const WEAK: &[&str] = &[
        "aaaaaaaaaa",
        "          ",
        "1234567890",
        "0987654321",
        "abcdefghijklm",
        "qwertyuiop",
        "1q2w3e4r5t",
        "password12",
        "Password123!",
        "P@ssw0rd2026",
        "passwordpassword",
        "abcabcabcabcabc",
        "letmein1234",
        "Gaitwright1!",
        "Summer2026!",
        "AdaLovelace1",
        "adaadaadaada",
        "iloveyou!!!!",
        "qwerty123456",
        "admin12345",
        "1111122222",
        "aabbaabbaabb",
        "asdfasdfasdf",
        "prosthese1",
        "Sommer2026!",
        "Winter2025!!",
        "01.01.1980",
        "a1b2c3d4e5",
    ];

    #[test]
    fn easily_guessed_passwords_are_refused_at_any_length() {
        let longer = [
            "               ",
            "123456789012345",
            "PasswordPassword1!",
            "Passwort12345678",
            "qwertzuiopü+asdf",
            "Gaitwright2026!!!",
            "Sommer2026!!!!!!",
            "Ada Lovelace 1815!",
            "Berlin 01.01.1980",
            "prosthesis12345",
            "Willkommen2026!!",
            "Willkommen2026Klinik!",
            "correcthorsebatterystaple",
            "Correct Horse Battery Staple",
            "ichliebedich12345",
            "gaitwrightgaitwright",
            "gaitwright2026Klinik",
            "Krankenhaus2026!",
            "KrankenhausMontag1",
            "jetaimemonamour1",
            "contraseña123456",
            "buongiorno12345",
            "Haus Garten Wasser",
            "red green yellow",
            "may the force be with you",
            "MayTheForceBeWithYou!",
            "Ich bin ein Berliner",
            "hasta la vista baby 1",
        ];
        let twice = WEAK.iter().map(|weak| weak.repeat(2));
        for weak in WEAK.iter().chain(&longer).map(|weak| (*weak).to_owned()).chain(twice) {
            assert!(check(&weak, "Ada Lovelace").is_err(), "{weak}");
        }
        let refused = check("Ada Lovelace Ada Lovelace", "Ada Lovelace").unwrap_err().to_string();
        assert!(!refused.contains("Lovelace") && refused.contains("common words"), "{refused}");
    }

    #[test]
    fn passwords_of_fifteen_characters_that_are_hard_to_guess_are_accepted() {
        for good in [
            "correct horse battery",
            "lamp river candle",
            "gravel otter pivot lantern",
            "wombat-teacup-granite-sail",
            "Zwetschge Amboss Nebel Kran",
            "Füße im Sand am Meer",
            "vT9#kk2Lmx4pQz!",
            "kX8rTmQzvW2bLpD",
            "9f83ba61c7d20e4",
        ] {
            assert!(check(good, "Ada Lovelace").is_ok(), "{good}");
        }
        let short = check("vT9#kk2Lmx4pQz", "").unwrap_err().to_string();
        assert!(short.contains("at least 15 characters"), "{short}");
        assert!(check(&"vT9#kk2Lmx4pQz! ".repeat(63), "").is_err());
    }
}
