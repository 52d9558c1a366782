//! Reads JSON documents strictly, with errors that name field, value, position and what is allowed.
//!
//! Derived deserialisers also accept an array in place of an object, such as `["S9", 1.7, 65]`. That is more likely a
//! mistake, so it is refused here.

use crate::error::{Error, FieldError};
use serde::de::value::{MapDeserializer, SeqDeserializer};
use serde::de::{
    DeserializeOwned, DeserializeSeed, Deserializer, Error as _, IgnoredAny, IntoDeserializer, MapAccess, SeqAccess,
    Unexpected, Visitor,
};
use serde_json::Value;
use serde_path_to_error::{Path, Segment};
use std::borrow::Cow;
use std::fmt;

/// The expected form of a structure.
const OBJECT: &str = "an object with named fields";

/// Maximum length of a value in an error, characters.
const SHOWN_VALUE: usize = 80;

/// Reads a document.
///
/// # Errors
/// [`Error::Unreadable`] naming the field, [`Error::Malformed`] if the error has no field.
pub fn read<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, Error> {
    let bytes = &*with_whole_numbers(bytes);
    let mut reader = serde_json::Deserializer::from_slice(bytes);
    let value: T = serde_path_to_error::deserialize(&mut reader).map_err(|error| {
        // The parser reports a value of the wrong kind in place of a word as a syntax error.
        let parsed = if error.inner().is_data() { None } else { serde_json::from_slice::<Value>(bytes).ok() };
        let of_value = parsed.and_then(|parsed| serde_path_to_error::deserialize::<_, T>(NamedFields(&parsed)).err());
        unreadable(of_value.unwrap_or(error), bytes)
    })?;
    reader.end().map_err(|e| Error::Malformed(format!("There is text after the JSON document: {e}.")))?;
    let parsed: Value = serde_json::from_slice(bytes).map_err(|e| Error::Malformed(e.to_string()))?;
    serde_path_to_error::deserialize::<_, T>(NamedFields(&parsed)).map_err(|e| unreadable(e, bytes))?;
    Ok(value)
}

/// The text with spaces in place of fractions that are zero: 10.0 is a whole number, also for JSON Schema, and some
/// programs write every number like this. Spaces keep the positions in errors.
fn with_whole_numbers(bytes: &[u8]) -> Cow<'_, [u8]> {
    let mut whole = Cow::Borrowed(bytes);
    let (mut in_string, mut place) = (false, 0);
    while let Some(byte) = bytes.get(place) {
        let rest = &bytes[place..];
        let number = rest.iter().take_while(|byte| !in_string && b"+-.0123456789Ee".contains(byte)).count();
        let mut parts = rest[..number].splitn(2, |byte| *byte == b'.');
        if let (Some(integer), Some(fraction)) = (parts.next(), parts.next())
            && !integer.is_empty()
            && !fraction.is_empty()
            && fraction.iter().all(|byte| *byte == b'0')
        {
            whole.to_mut()[place + integer.len()..place + number].fill(b' ');
        }
        in_string ^= *byte == b'"';
        place += if in_string && *byte == b'\\' { 2 } else { number.max(1) };
    }
    whole
}

fn unreadable(error: serde_path_to_error::Error<serde_json::Error>, bytes: &[u8]) -> Error {
    let path = error.path().clone();
    let written = path.to_string();
    let inner = error.into_inner();
    let message = inner.to_string();
    let message = message.split(" at line ").next().unwrap_or(&message);
    let place = place(&inner, &path, bytes);
    if !inner.is_data() {
        let known = written != "." && path.iter().all(|segment| !matches!(segment, Segment::Unknown));
        let within = if known {
            format!("The field {written} cannot be read as JSON")
        } else {
            "The text is not JSON".to_owned()
        };
        return Error::Malformed(format!("{within}: {message}{place}."));
    }
    let missing = message.strip_prefix("missing field `").and_then(|rest| rest.split('`').next());
    let twice = message.strip_prefix("duplicate field `").and_then(|rest| rest.split('`').next());
    let field = match (written.as_str(), missing.or(twice)) {
        (".", None) => {
            return Error::Malformed(format!("The document is not {}{place}.", expected(message)));
        }
        (".", Some(name)) => name.to_owned(),
        (_, Some(name)) => format!("{written}.{name}"),
        _ => written,
    };
    let value = if missing.is_some() { Value::Null } else { value_at(bytes, &path) };
    let allowed = match (missing, twice) {
        (Some(_), _) => "present".to_owned(),
        (_, Some(_)) => "present only once".to_owned(),
        _ if message.starts_with("UUID parsing failed") || message.ends_with("a formatted UUID string") => {
            "an identifier".to_owned()
        }
        _ => expected(message),
    };
    // The words of a reader of its own need not complete the sentence "it must be ...".
    let is_sentence = allowed == message;
    let message = match (missing, twice) {
        (Some(_), _) => format!("The field {field} is missing{place}."),
        (_, Some(_)) => format!("The field {field} occurs twice{place}."),
        _ if is_sentence => format!("The field {field} is invalid{place}: {message}."),
        _ if message.starts_with("unknown field") => {
            format!(
                "The field {field} is unknown{place}. Known fields: {}.",
                allowed.trim_start_matches("one of ").replace(" or ", ", ")
            )
        }
        _ => format!("The field {field} is {}{place}; it must be {allowed}.", shortened(&value)),
    };
    Error::Unreadable(Box::new(FieldError {
        message,
        field,
        value: Some(value),
        allowed: (!is_sentence).then_some(allowed),
    }))
}

/// Line and column in words. The second pass, which reads values, has no position, so the position of the field is
/// searched.
fn place(error: &serde_json::Error, path: &Path, bytes: &[u8]) -> String {
    let segments: Vec<&Segment> = path.iter().collect();
    let found = PathPosition(&segments).deserialize(&mut serde_json::Deserializer::from_slice(bytes)).err();
    let (line, column) = match found {
        _ if error.line() > 0 => (error.line(), error.column()),
        Some(found) if found.line() > 0 => (found.line(), found.column()),
        _ => return String::new(),
    };
    format!(" (line {line}, column {column})")
}

/// A reader that stops with an error at the value of a path, to find its position.
struct PathPosition<'a>(&'a [&'a Segment]);

impl<'de> DeserializeSeed<'de> for PathPosition<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, reader: D) -> Result<(), D::Error> {
        if self.0.is_empty() { Err(D::Error::custom("here")) } else { reader.deserialize_any(self) }
    }
}

impl<'de> Visitor<'de> for PathPosition<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object or a list")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut fields: A) -> Result<(), A::Error> {
        while let Some(name) = fields.next_key::<String>()? {
            match self.0.first() {
                Some(Segment::Map { key }) if *key == name => fields.next_value_seed(PathPosition(&self.0[1..]))?,
                _ => drop(fields.next_value::<IgnoredAny>()?),
            }
        }
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut values: A) -> Result<(), A::Error> {
        let Some(Segment::Seq { index }) = self.0.first() else { return Ok(()) };
        for _ in 0..*index {
            values.next_element::<IgnoredAny>()?;
        }
        values.next_element_seed(PathPosition(&self.0[1..])).map(drop)
    }
}

/// A value, shortened for an error.
pub fn shortened(value: &Value) -> String {
    let whole = value.to_string();
    match whole.char_indices().nth(SHOWN_VALUE) {
        Some((end, _)) => format!("{}...", &whole[..end]),
        None => whole,
    }
}

fn value_at(bytes: &[u8], path: &Path) -> Value {
    let whole: Value = serde_json::from_slice(bytes).unwrap_or_default();
    let inside = path.iter().try_fold(&whole, |value, segment| match segment {
        Segment::Seq { index } => value.get(index),
        Segment::Map { key } => value.get(key),
        Segment::Enum { .. } | Segment::Unknown => Some(value),
    });
    inside.cloned().unwrap_or_default()
}

/// The expected type in plain words, from the message of a deserialiser.
pub fn expected(message: &str) -> String {
    let Some((_, expected)) = message.split_once("expected ") else { return message.to_owned() };
    let is_too_large = message.starts_with("invalid value: integer `") && !message.contains("integer `-");
    match expected {
        "u8" if is_too_large => format!("a whole number of at most {}", u8::MAX),
        "u16" if is_too_large => format!("a whole number of at most {}", u16::MAX),
        "u32" if is_too_large => format!("a whole number of at most {}", u32::MAX),
        "i32" if message.starts_with("invalid value") => format!("a whole number from {} to {}", i32::MIN, i32::MAX),
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number of at least 0".to_owned(),
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number".to_owned(),
        "f32" | "f64" => "a number".to_owned(),
        "a boolean" => "true or false".to_owned(),
        "a sequence" => "a list".to_owned(),
        "a map" => "an object".to_owned(),
        "a string" | "string or map" => "a string".to_owned(),
        other if other.starts_with("struct ") => OBJECT.to_owned(),
        other => other.replace('`', ""),
    }
}

/// A deserialiser that accepts only objects with named fields for structures.
#[derive(Clone, Copy)]
struct NamedFields<'de>(&'de Value);

impl<'de> IntoDeserializer<'de, serde_json::Error> for NamedFields<'de> {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

impl<'de> Deserializer<'de> for NamedFields<'de> {
    type Error = serde_json::Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Self::Error> {
        match self.0 {
            Value::Array(values) => visitor.visit_seq(SeqDeserializer::new(values.iter().map(NamedFields))),
            Value::Object(fields) => visitor.visit_map(MapDeserializer::new(
                fields.iter().map(|(name, value)| (name.as_str(), NamedFields(value))),
            )),
            scalar => scalar.deserialize_any(visitor),
        }
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Self::Error> {
        match self.0 {
            Value::Array(_) => Err(serde_json::Error::invalid_type(Unexpected::Seq, &OBJECT)),
            _ => self.deserialize_any(visitor),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Self::Error> {
        if self.0.is_null() { visitor.visit_none() } else { visitor.visit_some(self) }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        visitor: V,
    ) -> Result<V::Value, Self::Error> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Self::Error> {
        self.0.deserialize_enum(name, variants, visitor)
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Self::Error> {
        visitor.visit_unit()
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct seq tuple
        tuple_struct map identifier
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gait_optimizer::GaitSettings;
    use serde_json::json;

    fn refusal<T: DeserializeOwned>(text: &str) -> String {
        match read::<T>(text.as_bytes()) {
            Ok(_) => panic!("{text} was taken"),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn value_of_the_wrong_kind_in_place_of_a_word_is_not_called_a_syntax_error() {
        let text = refusal::<gait_learner::LearnerSettings>(r#"{"start": false}"#);
        assert!(text.starts_with("The field start is false (line 1, column ") && text.contains("it must be"), "{text}");
        let broken = refusal::<gait_learner::LearnerSettings>(r#"{"start": fals}"#);
        assert!(broken.starts_with("The field start cannot be read as JSON"), "{broken}");
    }

    #[test]
    fn value_in_place_of_an_identifier_is_refused_in_plain_words() {
        #[derive(Debug, serde::Deserialize)]
        struct Named {
            #[expect(dead_code)]
            trial: gaitwright_store::TrialId,
        }
        for value in ["\"SUBJECT\"", "null", "7"] {
            let text = refusal::<Named>(&format!("{{\"trial\": {value}}}"));
            assert!(text.starts_with(&format!("The field trial is {value}")), "{text}");
            assert!(text.ends_with("; it must be an identifier."), "{text}");
        }
    }

    #[test]
    fn arrays_are_refused_in_place_of_objects() {
        for (text, place) in [
            ("[]", "The document is not an object with named fields."),
            (
                r#"{"mesh": [3, 3, 4, 4]}"#,
                "The field mesh is [3,3,4,4] (line 1, column 9); it must be an object with named fields.",
            ),
            (
                "{\n\"limits\": {\"friction\": 0.5, \"duration_min_s\": [0.1, 0.1, 0.1, 0.1]}}",
                "The field limits.duration_min_s is [0.1,0.1,0.1,0.1] (line 2, column 46); it must be an object with \
                 named fields.",
            ),
        ] {
            assert_eq!(refusal::<GaitSettings>(text), place);
        }
    }

    #[test]
    fn errors_have_field_value_and_allowed_values() {
        for (text, field, value, allowed) in [
            (r#"{"mesh": {"ds2": "x"}}"#, "mesh.ds2", json!("x"), "a whole number of at least 0"),
            (r#"{"limits": {"friction": [1]}}"#, "limits.friction", json!([1]), "a number"),
            (r#"{"limits": 3}"#, "limits", json!(3), "an object with named fields"),
        ] {
            match read::<GaitSettings>(text.as_bytes()) {
                Err(Error::Unreadable(found)) => {
                    assert_eq!(
                        (found.field.as_str(), &found.value, found.allowed.as_deref()),
                        (field, &Some(value), Some(allowed))
                    );
                }
                other => panic!("{text}: {other:?}"),
            }
        }
    }

    #[test]
    fn valid_documents_are_read() {
        let settings: GaitSettings =
            read(br#"{"mesh": {"ds2": 3, "ds3": 3, "ss2": 4, "ss1": 4}, "limits": {"friction": 0.5}}"#).unwrap();
        assert_eq!((settings.mesh.ds2, settings.limits.friction), (3, 0.5));
        let written = serde_json::to_vec(&settings).unwrap();
        assert_eq!(read::<GaitSettings>(&written).unwrap(), settings);
        let list: Vec<Option<f64>> = read(b"[1, null, 2.5]").unwrap();
        assert_eq!(list, [Some(1.0), None, Some(2.5)]);
    }

    #[test]
    fn too_large_integer_error_states_the_maximum() {
        let refused = super::read::<Vec<u32>>(b"[4294967296]").unwrap_err().to_string();
        assert!(refused.contains("it must be a whole number of at most 4294967295"), "{refused}");
    }

    #[test]
    fn fraction_of_zero_is_a_whole_number() {
        let read = |text: &str| super::read::<Vec<u32>>(text.as_bytes());
        assert_eq!(read("[10.0, 2.000 ,3]").unwrap(), [10, 2, 3]);
        for refused in ["[10.5]", "[10.01]", "[1.0e1]", "[1.]", "[.0]", "[1.0.0]", "[1.0 0]", "[1.00\u{a0}]", "[1.0"] {
            assert!(read(refused).is_err(), "{refused}");
        }
        let text: Vec<String> = super::read(br#"["1.0", "\"2.0\\"]"#).unwrap();
        assert_eq!(text, ["1.0", "\"2.0\\"], "strings stay as they are");
        assert!(super::read::<f64>(b"-0.0").unwrap().is_sign_negative());
    }

    #[test]
    fn error_messages_name_value_position_and_allowed_values() {
        for (text, told) in [
            (
                r#"{"mesh": {"ds2": "x"}}"#,
                "The field mesh.ds2 is \"x\" (line 1, column 20); it must be a whole number of at least 0.",
            ),
            (
                r#"{"limits": {"friction": NaN}}"#,
                "The field limits.friction cannot be read as JSON: expected value (line 1, column 25).",
            ),
            (
                r#"{"limits": {"friction": 1e999}}"#,
                "The field limits.friction cannot be read as JSON: number out of range (line 1, column 29).",
            ),
            ("{} {}", "There is text after the JSON document: trailing characters at line 1 column 4."),
            ("{", "The text is not JSON: EOF while parsing an object (line 1, column 1)."),
            (r#"{"mesh": {"ds2": 3, "ds2": 4}}"#, "The field mesh.ds2 occurs twice (line 1, column 25)."),
            (
                r#"{"limits": {"duration_min_s": {"ds2": 0.03}}}"#,
                "The field limits.duration_min_s.ds3 is missing (line 1, column 43).",
            ),
        ] {
            assert_eq!(refusal::<GaitSettings>(text), told);
        }
        let unknown = refusal::<GaitSettings>(r#"{"mash": 1}"#);
        assert!(unknown.starts_with("The field mash is unknown (line 1, column 7). Known fields: mesh, "), "{unknown}");
        let long = refusal::<GaitSettings>(&format!(r#"{{"limits": {{"friction": "{}"}}}}"#, "ä".repeat(1000)));
        assert!(long.chars().count() < 200, "{long}");
    }
}
