//! JSON documents from outside.
//!
//! Derived readers also take an array for an object, field by field in the order of the program text. A document that
//! says `["S9", 1.7, 65]` where it should name its fields is more likely a mistake, so here it is one.

use crate::error::{Error, FieldError};
use serde::de::value::{MapDeserializer, SeqDeserializer};
use serde::de::{DeserializeOwned, Deserializer, IntoDeserializer, Unexpected, Visitor};
use serde_json::Value;
use serde_path_to_error::{Path, Segment};

/// Reads a document, naming the field that cannot be read.
///
/// # Errors
/// [`Error::Unreadable`] with the field, [`Error::Malformed`] where there is none.
pub(crate) fn read<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, Error> {
    let mut reader = serde_json::Deserializer::from_slice(bytes);
    let value: T = serde_path_to_error::deserialize(&mut reader).map_err(|e| unreadable(e, bytes))?;
    reader.end().map_err(|e| Error::Malformed(format!("something follows the JSON document: {e}")))?;
    let parsed: Value = serde_json::from_slice(bytes).map_err(|e| Error::Malformed(e.to_string()))?;
    serde_path_to_error::deserialize::<_, T>(Named(&parsed)).map_err(|e| unreadable(e, bytes))?;
    Ok(value)
}

fn unreadable(error: serde_path_to_error::Error<serde_json::Error>, bytes: &[u8]) -> Error {
    let path = error.path().clone();
    let place = path.to_string();
    let inner = error.into_inner();
    let message = inner.to_string();
    let missing = message.strip_prefix("missing field `").and_then(|rest| rest.split('`').next());
    let field = match (place.as_str(), missing) {
        (".", None) => String::new(),
        (".", Some(name)) => name.to_owned(),
        (_, None) => place,
        (_, Some(name)) => format!("{place}.{name}"),
    };
    if !inner.is_data() || field.is_empty() {
        return Error::Malformed(format!("not the JSON that is expected here: {inner}"));
    }
    let value = if missing.is_some() { Value::Null } else { value_at(bytes, &path) };
    let allowed = if missing.is_some() { "it must be there".to_owned() } else { expected(&message) };
    Error::Unreadable(Box::new(FieldError { message: format!("field {field}: {message}"), field, value, allowed }))
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

/// What would have been read, in words that are not those of the program text.
fn expected(message: &str) -> String {
    let message = message.split(" at line ").next().unwrap_or(message);
    let Some((_, expected)) = message.split_once("expected ") else { return message.to_owned() };
    match expected {
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number, 0 or more".to_owned(),
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number".to_owned(),
        "f32" | "f64" => "a number".to_owned(),
        other if other.starts_with("struct ") => "an object with named fields".to_owned(),
        other => other.to_owned(),
    }
}

/// A value whose structures are objects with named fields.
#[derive(Clone, Copy)]
struct Named<'de>(&'de Value);

impl<'de> IntoDeserializer<'de, serde_json::Error> for Named<'de> {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

impl<'de> Deserializer<'de> for Named<'de> {
    type Error = serde_json::Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Self::Error> {
        match self.0 {
            Value::Array(values) => visitor.visit_seq(SeqDeserializer::new(values.iter().map(Named))),
            Value::Object(fields) => visitor
                .visit_map(MapDeserializer::new(fields.iter().map(|(name, value)| (name.as_str(), Named(value))))),
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
            Value::Array(_) => Err(serde::de::Error::invalid_type(Unexpected::Seq, &"an object with named fields")),
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
    fn fields_have_names() {
        for (text, place) in [
            ("[]", "invalid type: sequence, expected an object with named fields"),
            (r#"{"mesh": [3, 3, 4, 4]}"#, "field mesh: invalid type: sequence"),
            (r#"{"limits": {"duration_min_s": [0.1, 0.1, 0.1, 0.1]}}"#, "field limits.duration_min_s: invalid type"),
        ] {
            let refusal = refusal::<GaitSettings>(text);
            assert!(refusal.contains(place), "{refusal}");
        }
    }

    #[test]
    fn a_field_that_cannot_be_read_is_named_with_its_value_and_what_would_be() {
        for (text, field, value, allowed) in [
            (r#"{"mesh": {"ds2": "x"}}"#, "mesh.ds2", json!("x"), "a whole number, 0 or more"),
            (r#"{"limits": {"friction": [1]}}"#, "limits.friction", json!([1]), "a number"),
            (r#"{"limits": 3}"#, "limits", json!(3), "an object with named fields"),
        ] {
            match read::<GaitSettings>(text.as_bytes()) {
                Err(Error::Unreadable(found)) => {
                    assert_eq!((found.field.as_str(), &found.value, found.allowed.as_str()), (field, &value, allowed));
                }
                other => panic!("{text}: {other:?}"),
            }
        }
    }

    #[test]
    fn what_a_document_says_is_read() {
        let settings: GaitSettings =
            read(br#"{"mesh": {"ds2": 3, "ds3": 3, "ss2": 4, "ss1": 4}, "limits": {"friction": 0.5}}"#).unwrap();
        assert_eq!((settings.mesh.ds2, settings.limits.friction), (3, 0.5));
        let written = serde_json::to_vec(&settings).unwrap();
        assert_eq!(read::<GaitSettings>(&written).unwrap(), settings);
        let list: Vec<Option<f64>> = read(b"[1, null, 2.5]").unwrap();
        assert_eq!(list, [Some(1.0), None, Some(2.5)]);
    }

    #[test]
    fn faults_are_named_as_before() {
        assert!(refusal::<GaitSettings>(r#"{"mesh": {"ds2": "x"}}"#).contains("field mesh.ds2"));
        assert!(refusal::<GaitSettings>(r#"{"mash": 1}"#).contains("unknown field `mash`"));
        assert!(refusal::<GaitSettings>("{} {}").contains("something follows"));
        assert!(refusal::<GaitSettings>("{").contains("EOF"));
        assert!(refusal::<GaitSettings>(r#"{"mesh": {"ds2": 3, "ds2": 4}}"#).contains("duplicate field"));
    }
}
