//! Names that people write: of users, tokens, authors, studies.

use crate::error::Error;

/// Characters that turn the text around them: a name with them reads as another one.
const TURNING: [char; 12] = [
    '\u{061c}', '\u{200e}', '\u{200f}', '\u{202a}', '\u{202b}', '\u{202c}', '\u{202d}', '\u{202e}', '\u{2066}',
    '\u{2067}', '\u{2068}', '\u{2069}',
];

/// The name without spaces around it.
///
/// # Errors
/// [`Error::Invalid`] for nothing, for more than `longest` characters, and for characters that do not print.
pub(crate) fn name<'a>(field: &str, text: &'a str, longest: usize) -> Result<&'a str, Error> {
    let trimmed = text.trim();
    let prints = |c: char| !c.is_control() && !TURNING.contains(&c);
    if trimmed.is_empty() || trimmed.chars().count() > longest || !trimmed.chars().all(prints) {
        return Err(Error::invalid(field, text, &format!("1 to {longest} printable characters")));
    }
    Ok(trimmed)
}

#[cfg(test)]
mod tests {
    use super::name;

    #[test]
    fn what_prints_is_a_name() {
        assert_eq!(name("name", " Dr. Ünal-Řehoř ", 80).unwrap(), "Dr. Ünal-Řehoř");
        for bad in ["", "  ", "a\0b", "a\nb", "a\u{202e}b", &"x".repeat(81)] {
            let refusal = name("name", bad, 80).unwrap_err().to_string();
            assert!(refusal.contains("1 to 80 printable characters"), "{refusal}");
        }
    }
}
