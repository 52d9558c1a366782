//! Checks of the text that people type: names, notes and reasons.

use crate::error::{Error, FieldError};
use icu_properties::props::{DefaultIgnorableCodePoint, GeneralCategory};
use icu_properties::{CodePointMapData, CodePointSetData};
use unicode_normalization::UnicodeNormalization;

/// Characters that change the direction of text, so that one name can look like another.
const DIRECTION_CHANGES: [char; 12] = [
    '\u{061c}', '\u{200e}', '\u{200f}', '\u{202a}', '\u{202b}', '\u{202c}', '\u{202d}', '\u{202e}', '\u{2066}',
    '\u{2067}', '\u{2068}', '\u{2069}',
];

/// Symbols that look like a space, or stand for text that is missing.
const BLANK: [char; 3] = ['\u{2800}', '\u{fffc}', '\u{fffd}'];

/// Whether names may contain the character. Line separators, unassigned and private characters have no agreed look.
fn prints(c: char) -> bool {
    use GeneralCategory as Category;
    let category = CodePointMapData::<Category>::new().get(c);
    let has_look = !matches!(
        category,
        Category::Control
            | Category::LineSeparator
            | Category::ParagraphSeparator
            | Category::PrivateUse
            | Category::Unassigned
    );
    has_look && !DIRECTION_CHANGES.contains(&c) && !BLANK.contains(&c)
}

/// The name, trimmed.
///
/// # Errors
/// [`Error::Invalid`] for an empty name, more than `longest` characters, or a character that does not print.
pub fn name<'a>(field: &str, text: &'a str, longest: usize) -> Result<&'a str, Error> {
    let trimmed = text.trim();
    if compared(trimmed).is_empty() || trimmed.chars().count() > longest || !trimmed.chars().all(prints) {
        return Err(Error::invalid(field, text, &format!("1 to {longest} printable characters")));
    }
    Ok(trimmed)
}

/// Checks a note, which may be empty or have several lines.
///
/// # Errors
/// [`Error::Invalid`] for more than `longest` characters, or a control character other than tab and line breaks.
pub(crate) fn note(field: &str, text: &str, longest: usize) -> Result<(), Error> {
    let length = text.chars().count();
    if length > longest {
        let allowed = format!("at most {longest} characters long");
        return Err(FieldError::described(field, &format!("{length} characters long"), &allowed).into());
    }
    let parts = |c: char| matches!(c, '\n' | '\r' | '\t');
    match text.chars().find(|&c| (c.is_control() && !parts(c)) || DIRECTION_CHANGES.contains(&c)) {
        Some(c) => {
            let is = format!("text with the character {}", c.escape_unicode());
            Err(FieldError::described(field, &is, "text with printable characters and line breaks only").into())
        }
        None => Ok(()),
    }
}

/// A reason: a note that is not empty, trimmed. `what` is appended to the allowed range in the error.
///
/// # Errors
/// As [`note`].
pub(crate) fn reason<'a>(field: &str, text: &'a str, what: &str) -> Result<&'a str, Error> {
    const MAX_LENGTH: usize = 2000;
    let text = text.trim();
    if text.is_empty() {
        return Err(Error::invalid(field, text, &format!("1 to {MAX_LENGTH} characters long{what}")));
    }
    note(field, text, MAX_LENGTH)?;
    Ok(text)
}

/// The form in which names are compared: upper and lower case, spaces, invisible characters and the way in which accents are
/// encoded make no difference.
pub(crate) fn compared(name: &str) -> String {
    let invisible = CodePointSetData::new::<DefaultIgnorableCodePoint>();
    let visible: String = name.nfkc().filter(|c| !invisible.contains(*c)).collect();
    visible.split_whitespace().collect::<Vec<_>>().join(" ").to_uppercase().to_lowercase()
}

/// Whether two names are of one person.
pub(crate) fn is_same_name(one: &str, other: &str) -> bool {
    compared(one) == compared(other)
}

#[cfg(test)]
mod tests {
    use super::{is_same_name, name, note, reason};

    #[test]
    fn notes_have_lines_but_no_other_control_characters() {
        for good in ["", "the left foot scuffed\r\n\ttwice", "Ünal-Řehoř"] {
            note("note", good, 40).unwrap();
        }
        for (bad, why) in [("a\0b", "u{0}"), ("a\u{202e}b", "u{202e}"), ("a\u{1b}[1m", "u{1b}"), ("12345678901", "11")]
        {
            let refusal = note("note", bad, 10).unwrap_err().to_string();
            assert!(refusal.contains(why), "{refusal}");
        }
        assert_eq!(reason("reason", " scuffed ", "").unwrap(), "scuffed");
        assert!(reason("reason", " \n", ": why").unwrap_err().to_string().contains("1 to 2000 characters long: why"));
    }

    #[test]
    fn names_are_trimmed_and_printable() {
        assert_eq!(name("name", " Dr. Ünal-Řehoř ", 80).unwrap(), "Dr. Ünal-Řehoř");
        for bad in [
            "",
            "  ",
            "a\0b",
            "a\nb",
            "a\u{202e}b",
            "a\u{2028}b",
            "a\u{2800}",
            "a\u{fffc}",
            "a\u{e000}",
            "a\u{378}",
            "\u{200b}\u{ad}",
            &"x".repeat(81),
        ] {
            let refusal = name("name", bad, 80).unwrap_err().to_string();
            assert!(refusal.contains("1 to 80 printable characters"), "{refusal}");
        }
    }

    #[test]
    fn names_that_look_alike_are_equal() {
        for other in ["dr.  ünal", "Dr. U\u{308}nal", "Dr. Ün\u{ad}al", "D\u{200d}r. Ünal", "Dr.\u{a0}Ünal\u{feff}"]
        {
            assert!(is_same_name("Dr. Ünal", other), "{other:?}");
        }
        assert!(is_same_name("Anna Straße", "ANNA STRASSE"));
        assert!(!is_same_name("Dr. Ünal", "Dr. Unal"));
    }
}
