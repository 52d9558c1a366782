//! Reads query strings strictly, with errors that name parameter, value and what is allowed.

use gaitwright_service::error::{Error, FieldError};
use gaitwright_service::json_document;
use serde::de::value::{Error as Refused, MapDeserializer, StrDeserializer};
use serde::de::{DeserializeOwned, Deserializer, Error as _, IntoDeserializer, Unexpected, Visitor};
use std::str::FromStr;

/// Name and value of each parameter.
pub(crate) type Pairs = Vec<(String, String)>;

/// Splits a query string.
///
/// # Errors
/// [`Error::Malformed`].
pub(crate) fn pairs(query: &str) -> Result<Pairs, Error> {
    serde_urlencoded::from_str(query).map_err(|e| Error::Malformed(format!("The query cannot be read: {e}.")))
}

/// The message about a parameter that occurs twice.
pub(crate) fn occurs_twice(name: &str) -> String {
    format!("The query parameter {name} occurs twice.")
}

/// Reads the parameters. The caller has taken out the `others`, which are known too.
///
/// # Errors
/// [`Error::Unreadable`] naming the parameter.
pub(crate) fn read<T: DeserializeOwned>(pairs: &Pairs, others: &[&str]) -> Result<T, Error> {
    let values = pairs.iter().map(|(name, value)| (name.as_str(), Text(value)));
    let reader = MapDeserializer::<_, Refused>::new(values);
    serde_path_to_error::deserialize(reader).map_err(|error| {
        let path = error.path().to_string();
        unreadable(&path, &error.into_inner().to_string(), pairs, others)
    })
}

fn unreadable(path: &str, message: &str, pairs: &Pairs, others: &[&str]) -> Error {
    let named = |start: &str| message.strip_prefix(start).and_then(|rest| rest.split('`').next());
    let (missing, twice) = (named("missing field `"), named("duplicate field `"));
    let field = missing.or(twice).or(named("unknown field `")).unwrap_or(path);
    let value = pairs.iter().find(|(name, _)| name == field).map(|(_, value)| value.as_str());
    let unknown = message.starts_with("unknown field");
    let of_type = ["invalid type", "invalid value", "unknown variant"].iter().any(|start| message.starts_with(start));
    let allowed = match (missing, twice) {
        (Some(_), _) => "present".to_owned(),
        (_, Some(_)) => "present only once".to_owned(),
        _ if unknown && message.ends_with("there are no fields") => String::new(),
        // The value comes before it, and may hold any words.
        _ if unknown || of_type => {
            json_document::expected(message.rfind(", expected ").map_or(message, |at| &message[at..]))
        }
        _ if message.starts_with("UUID parsing failed") => "an identifier".to_owned(),
        // The words of a reader of its own can be a whole refusal.
        _ => {
            message.rsplit_once("it must be ").map_or(message, |(_, allowed)| allowed).trim_end_matches('.').to_owned()
        }
    };
    let message = match (missing, twice) {
        (Some(_), _) => format!("The query parameter {field} is missing."),
        (_, Some(_)) => occurs_twice(field),
        _ if unknown => {
            let known = allowed.trim_start_matches("one of ").replace(" or ", ", ");
            let known: Vec<&str> = known.split(", ").chain(others.iter().copied()).filter(|k| !k.is_empty()).collect();
            let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
            format!("The query parameter {field} is unknown. Known parameters: {known}.")
        }
        _ => {
            format!("The query parameter {field} is {}; it must be {allowed}.", json_document::shortened(&value.into()))
        }
    };
    Error::Unreadable(Box::new(FieldError {
        message,
        field: field.to_owned(),
        value: value.map(Into::into),
        // No value of an unknown parameter is allowed.
        allowed: (!unknown).then_some(allowed),
    }))
}

/// The value of a parameter: text that stands for what is asked for.
#[derive(Clone, Copy)]
struct Text<'de>(&'de str);

impl<'de> IntoDeserializer<'de, Refused> for Text<'de> {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

impl<'de> Text<'de> {
    fn parsed<T: FromStr, V: Visitor<'de>>(self, visitor: &V) -> Result<T, Refused> {
        self.0.parse().map_err(|_| Refused::invalid_type(Unexpected::Str(self.0), visitor))
    }

    fn plain(self) -> StrDeserializer<'de, Refused> {
        self.0.into_deserializer()
    }
}

macro_rules! parse {
    ($($deserialize:ident $visit:ident)*) => {$(
        fn $deserialize<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refused> {
            let value = self.parsed(&visitor)?;
            visitor.$visit(value)
        }
    )*};
}

impl<'de> Deserializer<'de> for Text<'de> {
    type Error = Refused;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refused> {
        visitor.visit_borrowed_str(self.0)
    }

    parse! {
        deserialize_bool visit_bool
        deserialize_i8 visit_i8 deserialize_i16 visit_i16 deserialize_i32 visit_i32 deserialize_i64 visit_i64
        deserialize_u8 visit_u8 deserialize_u16 visit_u16 deserialize_u32 visit_u32 deserialize_u64 visit_u64
        deserialize_f32 visit_f32 deserialize_f64 visit_f64
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refused> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, _name: &'static str, visitor: V) -> Result<V::Value, Refused> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Refused> {
        self.plain().deserialize_enum(name, variants, visitor)
    }

    serde::forward_to_deserialize_any! {
        i128 u128 char str string bytes byte_buf unit unit_struct seq tuple tuple_struct map struct identifier
        ignored_any
    }
}

#[cfg(test)]
mod tests {
    use super::{pairs, read};
    use gaitwright_service::error::Error;
    use serde::Deserialize;

    #[derive(Debug, Deserialize, PartialEq)]
    #[serde(rename_all = "lowercase")]
    enum Order {
        Ascending,
        Descending,
    }

    #[derive(Debug, Deserialize, PartialEq)]
    #[serde(deny_unknown_fields)]
    struct Asked {
        number: u32,
        share: Option<f64>,
        order: Option<Order>,
        #[serde(default)]
        contains: String,
    }

    fn refusal(query: &str) -> (String, String) {
        match read::<Asked>(&pairs(query).unwrap(), &["limit"]) {
            Err(Error::Unreadable(found)) => (found.field, found.message),
            other => panic!("{query}: {other:?}"),
        }
    }

    #[test]
    fn query_values_are_parsed_to_the_types_of_their_fields() {
        let asked: Asked = read(&pairs("number=7&share=0.5&order=descending&contains=12").unwrap(), &[]).unwrap();
        let expected = Asked { number: 7, share: Some(0.5), order: Some(Order::Descending), contains: "12".to_owned() };
        assert_eq!(asked, expected);
    }

    #[test]
    fn errors_name_parameter_value_and_allowed_values() {
        for (query, field, message) in [
            ("number=x", "number", "The query parameter number is \"x\"; it must be a whole number of at least 0."),
            ("number=1&share=half", "share", "The query parameter share is \"half\"; it must be a number."),
            ("number=1&order=up", "order", "The query parameter order is \"up\"; it must be ascending or descending."),
            (
                "number=1&order=expected+up",
                "order",
                "The query parameter order is \"expected up\"; it must be ascending or descending.",
            ),
            ("share=1", "number", "The query parameter number is missing."),
            ("number=1&number=2", "number", "The query parameter number occurs twice."),
            (
                "number=1&nmber=2",
                "nmber",
                "The query parameter nmber is unknown. Known parameters: number, share, order, contains, limit.",
            ),
        ] {
            assert_eq!(refusal(query), (field.to_owned(), message.to_owned()));
        }
        let Err(Error::Unreadable(unknown)) = read::<Asked>(&pairs("number=1&nmber=2").unwrap(), &[]) else { panic!() };
        assert_eq!(unknown.allowed, None, "no value of an unknown parameter is allowed");
    }
}
