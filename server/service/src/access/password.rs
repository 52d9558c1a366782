//! The password policy: refuses passwords that are short or easy to guess.

use crate::error::{Error, FieldError};

/// Minimum length, characters.
pub const SHORTEST: usize = 10;
/// Maximum length, bytes.
const LONGEST_BYTES: usize = 1000;
/// Minimum number of unpredictable characters.
const LEAST_UNPREDICTABLE: usize = 8;

/// Common parts of passwords, in lower case and without digits in place of letters.
const COMMON: &[&str] = &[
    "aaliyah",
    "abc",
    "access",
    "account",
    "admin",
    "administrator",
    "alexander",
    "amanda",
    "andrea",
    "andrew",
    "angel",
    "anthony",
    "april",
    "arsenal",
    "ashley",
    "august",
    "austin",
    "autumn",
    "baby",
    "bailey",
    "banana",
    "barcelona",
    "baseball",
    "basketball",
    "batman",
    "biteme",
    "boston",
    "buster",
    "butterfly",
    "carlos",
    "changeit",
    "changeme",
    "charlie",
    "cheese",
    "chelsea",
    "chicago",
    "chocolate",
    "clinic",
    "clinician",
    "computer",
    "cookie",
    "daniel",
    "december",
    "default",
    "demo",
    "doctor",
    "dolphin",
    "donald",
    "dragon",
    "eagle",
    "enter",
    "eminem",
    "february",
    "flower",
    "football",
    "freedom",
    "friday",
    "fuckyou",
    "gait",
    "gaitwright",
    "gandalf",
    "george",
    "ginger",
    "google",
    "guest",
    "hannah",
    "harley",
    "hello",
    "hockey",
    "hospital",
    "hunter",
    "hunter2",
    "iloveyou",
    "internet",
    "jackson",
    "january",
    "jasmine",
    "jennifer",
    "jessica",
    "jordan",
    "joshua",
    "july",
    "june",
    "justin",
    "killer",
    "lab",
    "letmein",
    "liverpool",
    "login",
    "london",
    "lovely",
    "love",
    "maggie",
    "march",
    "martin",
    "master",
    "matrix",
    "matthew",
    "maverick",
    "merlin",
    "michael",
    "michelle",
    "monday",
    "money",
    "monkey",
    "morgan",
    "mother",
    "mustang",
    "myspace",
    "naruto",
    "nicole",
    "ninja",
    "november",
    "october",
    "oliver",
    "orange",
    "pass",
    "passw",
    "passwd",
    "password",
    "passwort",
    "patient",
    "patrick",
    "pepper",
    "phoenix",
    "pokemon",
    "prince",
    "princess",
    "prosthesis",
    "purple",
    "qazwsx",
    "rachel",
    "ranger",
    "rater",
    "richard",
    "robert",
    "root",
    "samantha",
    "samsung",
    "saturday",
    "scooter",
    "secret",
    "september",
    "service",
    "shadow",
    "silver",
    "slayer",
    "snoopy",
    "soccer",
    "sophie",
    "spring",
    "starwars",
    "student",
    "study",
    "summer",
    "sunday",
    "sunshine",
    "superman",
    "superuser",
    "system",
    "taylor",
    "temp",
    "test",
    "thomas",
    "thunder",
    "tigger",
    "trustno",
    "trustnoone",
    "tuesday",
    "user",
    "welcome",
    "whatever",
    "william",
    "winter",
    "yankees",
    "zaqwsx",
];

/// Sequences of neighbouring keys.
const KEYBOARD: &[&str] = &[
    "qwertyuiop",
    "qwertzuiop",
    "azertyuiop",
    "asdfghjkl",
    "zxcvbnm",
    "yxcvbnm",
    "1234567890",
    "1q2w3e4r5t6y7u8i9o0p",
    "q1w2e3r4t5y6u7i8o9p0",
    "1qaz2wsx3edc4rfv5tgb6yhn7ujm",
    "qazwsxedcrfvtgbyhnujm",
    "!@#$%^&*()",
    "!\"§$%&/()=",
];

/// Refuses a password that is too short, too long, or predictable for somebody who knows the name of the user.
///
/// # Errors
/// [`Error::Invalid`], which does not contain the password.
pub fn check(password: &str, name: &str) -> Result<(), Error> {
    let length = password.chars().count();
    if length < SHORTEST || password.len() > LONGEST_BYTES {
        let allowed = format!("at least {SHORTEST} characters and at most {LONGEST_BYTES} bytes long");
        return Err(FieldError::described("password", &format!("{length} characters long"), &allowed).into());
    }
    if unpredictable(password, name) < LEAST_UNPREDICTABLE {
        let allowed = "hard to guess, such as three unrelated words. Your name, common words, keyboard rows, sequences such as \
                       1234 and repetitions add little";
        return Err(FieldError::described("password", "easy to guess", allowed).into());
    }
    Ok(())
}

/// Number of unpredictable characters. A repetition counts as one, a sequence or a common word as two.
fn unpredictable(password: &str, name: &str) -> usize {
    let typed: Vec<char> = password.to_lowercase().chars().collect();
    let letters: Vec<char> = typed.iter().map(|c| letter(*c)).collect();
    let name: Vec<char> = name.to_lowercase().chars().map(letter).collect();
    let mut words: Vec<Vec<char>> = COMMON.iter().map(|word| word.chars().collect()).collect();
    words.extend(name.split(|c| !c.is_alphanumeric()).filter(|part| part.len() > 2).map(<[char]>::to_vec));
    let (mut at, mut count) = (0, 0);
    while at < typed.len() {
        let word = words.iter().filter(|word| letters[at..].starts_with(word)).map(Vec::len).max();
        let (length, cost) = [
            (repeated(&typed, at), 1),
            (sequence(&typed[at..]), 2),
            (keyboard(&typed[at..]), 2),
            (word.unwrap_or(0), 2),
        ]
        .into_iter()
        .max_by_key(|(length, cost)| length.saturating_sub(*cost))
        .filter(|(length, cost)| length > cost)
        .unwrap_or((1, 1));
        at += length;
        count += cost;
    }
    count
}

/// The letter that a digit or symbol replaces.
fn letter(c: char) -> char {
    match c {
        '0' => 'o',
        '1' | '!' => 'i',
        '3' => 'e',
        '4' | '@' => 'a',
        '5' | '$' => 's',
        '7' => 't',
        other => other,
    }
}

/// Length of the text at `at` that occurred earlier.
fn repeated(text: &[char], at: usize) -> usize {
    let alike = |from: usize| (0..text.len() - at).take_while(|i| text[from + i] == text[at + i]).count();
    (0..at).map(alike).max().unwrap_or(0)
}

/// Length of an ascending, descending or constant run of letters or digits.
fn sequence(text: &[char]) -> usize {
    let run = |step: i64| {
        1 + text
            .windows(2)
            .take_while(|two| i64::from(u32::from(two[1])) - i64::from(u32::from(two[0])) == step)
            .count()
    };
    [-1, 0, 1].map(run).into_iter().max().unwrap_or(1)
}

/// Length of a run of neighbouring keys, in either direction.
fn keyboard(text: &[char]) -> usize {
    let on_row = |row: Vec<char>| {
        let from = |start: usize| row[start..].iter().zip(text).take_while(|(key, c)| key == c).count();
        (0..row.len()).map(from).max().unwrap_or(0)
    };
    KEYBOARD.iter().flat_map(|row| [row.chars().collect(), row.chars().rev().collect()]).map(on_row).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn easily_guessed_passwords_are_refused_at_any_length() {
        for weak in [
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
        ] {
            assert!(check(weak, "Ada Lovelace").is_err(), "{weak}: {}", unpredictable(weak, "Ada Lovelace"));
        }
        for good in
            ["correct horse", "battery staple", "another horse", "correct horse battery", "vT9#kk2Lmx", "Füße im Sand"]
        {
            assert!(check(good, "Ada Lovelace").is_ok(), "{good}: {}", unpredictable(good, "Ada Lovelace"));
        }
        assert!(check("short", "").is_err() && check(&"ab1 ".repeat(300), "").is_err());
        let refused = check("Ada Lovelace", "Ada Lovelace").unwrap_err().to_string();
        assert!(!refused.contains("Lovelace") && refused.contains("common words"), "{refused}");
    }
}
