//! Meaning of the name of a column: the side of the body, and the muscle or the joint.

/// A side of the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NamedSide {
    Left,
    Right,
}

/// The parts of the name of a column in small letters: `EMG_L-TibAnt` has `emg`, `l`, `tib` and `ant`.
fn parts(name: &str) -> Vec<String> {
    let mut parts: Vec<String> = Vec::new();
    let (mut goes_on, mut was_small) = (false, false);
    for letter in name.chars() {
        if !letter.is_alphanumeric() {
            (goes_on, was_small) = (false, false);
            continue;
        }
        let begins = !goes_on || was_small && letter.is_uppercase();
        let small = letter.to_lowercase();
        match parts.last_mut().filter(|_| !begins) {
            Some(part) => part.extend(small),
            None => parts.push(small.collect()),
        }
        (goes_on, was_small) = (true, letter.is_lowercase());
    }
    parts
}

/// A name that was read.
#[derive(Debug)]
pub(super) struct ColumnName {
    whole: String,
    parts: Vec<String>,
    pub(super) side: Option<NamedSide>,
}

impl ColumnName {
    pub(super) fn read(name: &str) -> Self {
        let parts = parts(name);
        let mut sides = parts.iter().filter_map(|part| match part.as_str() {
            "l" | "lt" | "left" => Some(NamedSide::Left),
            "r" | "rt" | "right" => Some(NamedSide::Right),
            _ => None,
        });
        // `LKneeAngles` has its side before a word.
        let before_word = || {
            let mut letters = name.chars();
            let side = match letters.next()? {
                'L' => NamedSide::Left,
                'R' => NamedSide::Right,
                _ => return None,
            };
            let begins_word = letters.next()?.is_uppercase() && letters.next()?.is_lowercase();
            begins_word.then_some(side)
        };
        let side = sides.next().or_else(before_word);
        Self { whole: name.to_lowercase(), parts, side }
    }

    /// Whether the name contains a word.
    pub(super) fn contains(&self, word: &str) -> bool {
        self.whole.contains(word)
    }

    /// Whether a part of the name is one of these.
    pub(super) fn has_part_of(&self, words: &[&str]) -> bool {
        self.parts.iter().any(|part| words.contains(&part.as_str()))
    }

    /// Whether a part of the name is this abbreviation, with or without a letter for the side before or after it.
    pub(super) fn abbreviates(&self, short: &str) -> bool {
        let is_side = |rest: &str| matches!(rest, "" | "l" | "r");
        self.parts
            .iter()
            .any(|part| part.strip_prefix(short).is_some_and(is_side) || part.strip_suffix(short).is_some_and(is_side))
    }

    /// The side, also where a letter for it is part of an abbreviation, as in `LTA`.
    pub(super) fn side_with(&self, short: &str) -> Option<NamedSide> {
        let of_letter = |rest: &str| match rest {
            "l" => Some(NamedSide::Left),
            "r" => Some(NamedSide::Right),
            _ => None,
        };
        let in_part = |part: &String| {
            let rest = part.strip_suffix(short).or_else(|| part.strip_prefix(short))?;
            of_letter(rest)
        };
        self.side.or_else(|| self.parts.iter().find_map(in_part))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_split_at_signs_and_capitals() {
        for (name, expected) in [
            ("EMG_L-TibAnt", &["emg", "l", "tib", "ant"][..]),
            ("knee_angle_r", &["knee", "angle", "r"]),
            ("EMG 1", &["emg", "1"]),
        ] {
            assert_eq!(parts(name), expected, "{name}");
        }
    }

    #[test]
    fn side_is_a_part_a_first_capital_or_a_letter_of_an_abbreviation() {
        for (name, side) in [
            ("hip_flexion_r", Some(NamedSide::Right)),
            ("Left knee", Some(NamedSide::Left)),
            ("LKneeAngles", Some(NamedSide::Left)),
            ("Lumbar", None),
            ("LTA", Some(NamedSide::Left)),
            ("TA", None),
            ("RF", None),
            ("EMG 1", None),
        ] {
            assert_eq!(ColumnName::read(name).side_with("ta"), side, "{name}");
        }
        assert!(ColumnName::read("rta").abbreviates("ta"));
        assert_eq!(ColumnName::read("rta").side_with("ta"), Some(NamedSide::Right));
        assert!(!ColumnName::read("stance").abbreviates("ta"));
    }
}
