//! Reads query strings and submitted forms strictly, with errors that name parameter, value and what is allowed.

use crate::form_errors::INCOMPLETE_FORM;
use gaitwright_service::error::{Error, FieldError};
use gaitwright_service::json_document;
use serde::de::value::{Error as Refused, MapDeserializer, SeqDeserializer, StrDeserializer};
use serde::de::{DeserializeOwned, Deserializer, Error as _, IntoDeserializer, Unexpected, Visitor};
use std::collections::HashMap;
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
    repeated("query parameter", name)
}

fn repeated(what: &str, name: &str) -> String {
    format!("The {what} {name} occurs twice.")
}

/// The refusal of a parameter that is not among the known ones. No value of it is allowed.
pub(crate) fn unknown<'a>(name: &str, value: Option<&str>, known: impl IntoIterator<Item = &'a str>) -> Error {
    not_known("query parameter", name, value, known)
}

fn not_known<'a>(what: &str, name: &str, value: Option<&str>, known: impl IntoIterator<Item = &'a str>) -> Error {
    let known: Vec<&str> = known.into_iter().filter(|name| !name.is_empty()).collect();
    let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
    Error::Unreadable(Box::new(FieldError {
        message: format!("The {what} {name} is unknown. Known {what}s: {known}."),
        field: name.to_owned(),
        value: value.map(Into::into),
        allowed: None,
    }))
}

/// Reads the parameters.
///
/// # Errors
/// [`Error::Invalid`] naming parameter, value and what is allowed; [`Error::Unreadable`] naming a parameter that is
/// missing, unknown or occurs twice.
pub(crate) fn read<T: DeserializeOwned>(pairs: &Pairs) -> Result<T, Error> {
    read_from(pairs, "query parameter")
}

/// Reads the fields of a submitted form. A missing field counts as an empty one, so that a page refuses it under its label.
///
/// # Errors
/// As [`read`], and [`Error::Malformed`], also if a missing field is one that no person fills in.
pub(crate) fn read_form<T: DeserializeOwned>(body: &[u8]) -> Result<T, Error> {
    let mut pairs: Pairs = serde_urlencoded::from_bytes(body)
        .map_err(|e| Error::Malformed(format!("The submitted form cannot be read: {e}.")))?;
    let given = pairs.len();
    loop {
        match read_from(&pairs, "form field") {
            Err(Error::Unreadable(missing))
                if missing.allowed.as_deref() == Some(PRESENT) && values(&pairs, &missing.field).next().is_none() =>
            {
                pairs.push((missing.field, String::new()));
            }
            // A field with an identifier or a choice cannot be empty.
            Err(Error::Invalid(_)) if pairs.len() > given => {
                return Err(Error::Malformed(INCOMPLETE_FORM.to_owned()));
            }
            read => return read,
        }
    }
}

/// The requirement that a missing field does not meet.
const PRESENT: &str = "present";

/// Reads named values. `what` is the word for one of them.
fn read_from<T: DeserializeOwned>(pairs: &Pairs, what: &str) -> Result<T, Error> {
    let mut given: Vec<(&str, Given<'_>)> = Vec::new();
    let mut places: HashMap<&str, usize> = HashMap::new();
    for (name, value) in pairs {
        let place = *places.entry(name).or_insert(given.len());
        match given.get_mut(place) {
            Some((_, known)) => known.values.push(value),
            None => given.push((name, Given { name, values: vec![value] })),
        }
    }
    let reader = MapDeserializer::<_, Refused>::new(given.into_iter());
    serde_path_to_error::deserialize(reader).map_err(|error| {
        let path = error.path().to_string();
        refusal(&path, &error.into_inner().to_string(), pairs, what)
    })
}

fn refusal(path: &str, message: &str, pairs: &Pairs, what: &str) -> Error {
    let named = |start: &str| message.strip_prefix(start).and_then(|rest| rest.split('`').next());
    // An entry of a list, such as `places[1]`, is named by its list.
    let (path, place) = match path.split_once('[') {
        Some((list, place)) => (list, place.trim_end_matches(']').parse().ok()),
        None => (path, None),
    };
    let value = |field: &str| values(pairs, field).next();
    let unreadable = |field: &str, message: String, allowed: &str| {
        let (field, value, allowed) = (field.to_owned(), value(field).map(Into::into), Some(allowed.to_owned()));
        Error::Unreadable(Box::new(FieldError { message, field, value, allowed }))
    };
    // The value comes before what is expected, and may hold any words.
    let expected = || json_document::expected(message.rfind(", expected ").map_or(message, |at| &message[at..]));
    if let Some(field) = named("missing field `") {
        return unreadable(field, format!("The {what} {field} is missing."), PRESENT);
    }
    if let Some(field) = named("duplicate field `") {
        return unreadable(field, repeated(what, field), "present only once");
    }
    if let Some(field) = named("unknown field `") {
        let known = if message.ends_with("there are no fields") { String::new() } else { expected() };
        let known = known.trim_start_matches("one of ").replace(" or ", ", ");
        return not_known(what, field, value(field), known.split(", "));
    }
    let allowed = if message.starts_with("invalid value: integer") {
        json_document::expected(message)
    } else if ["invalid type", "invalid value", "unknown variant"].iter().any(|start| message.starts_with(start)) {
        expected()
    } else if message.starts_with("UUID parsing failed") {
        "an identifier".to_owned()
    } else {
        message.to_owned()
    };
    let value = place.map_or_else(|| value(path), |place| entries(values(pairs, path)).nth(place)).unwrap_or_default();
    Error::Invalid(Box::new(FieldError {
        message: format!("The {what} {path} is {}; it must be {allowed}.", json_document::shortened(&value.into())),
        field: path.to_owned(),
        value: Some(value.into()),
        allowed: Some(allowed),
    }))
}

/// Every value of a parameter.
fn values<'a>(pairs: &'a Pairs, field: &str) -> impl Iterator<Item = &'a str> {
    pairs.iter().filter(move |(name, _)| name == field).map(|(_, value)| value.as_str())
}

/// The entries of a list, which is a repeated parameter or has commas.
fn entries<'a>(values: impl Iterator<Item = &'a str>) -> impl Iterator<Item = &'a str> {
    values.flat_map(|value| value.split(',')).map(str::trim).filter(|value| !value.is_empty())
}

/// Every value of a parameter. Only a list can have several.
struct Given<'de> {
    name: &'de str,
    values: Vec<&'de str>,
}

impl<'de> IntoDeserializer<'de, Refused> for Given<'de> {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

impl<'de> Given<'de> {
    fn single(&self) -> Result<Text<'de>, Refused> {
        match self.values[..] {
            [value] => Ok(Text(value)),
            _ => Err(Refused::custom(format_args!("duplicate field `{}`", self.name))),
        }
    }
}

macro_rules! of_single {
    ($($deserialize:ident)*) => {$(
        fn $deserialize<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refused> {
            self.single()?.$deserialize(visitor)
        }
    )*};
}

impl<'de> Deserializer<'de> for Given<'de> {
    type Error = Refused;

    of_single! {
        deserialize_any deserialize_bool deserialize_char deserialize_str deserialize_string deserialize_identifier
        deserialize_i8 deserialize_i16 deserialize_i32 deserialize_i64 deserialize_i128
        deserialize_u8 deserialize_u16 deserialize_u32 deserialize_u64 deserialize_u128
        deserialize_f32 deserialize_f64 deserialize_bytes deserialize_byte_buf deserialize_unit deserialize_map
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refused> {
        visitor.visit_seq(SeqDeserializer::new(entries(self.values.into_iter()).map(Text)))
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refused> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, _: &'static str, visitor: V) -> Result<V::Value, Refused> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Refused> {
        self.single()?.deserialize_enum(name, variants, visitor)
    }

    fn deserialize_unit_struct<V: Visitor<'de>>(self, _: &'static str, visitor: V) -> Result<V::Value, Refused> {
        self.deserialize_any(visitor)
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, _: usize, visitor: V) -> Result<V::Value, Refused> {
        self.deserialize_seq(visitor)
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: usize,
        visitor: V,
    ) -> Result<V::Value, Refused> {
        self.deserialize_seq(visitor)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Refused> {
        self.deserialize_any(visitor)
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refused> {
        visitor.visit_unit()
    }
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
        self.0.parse().map_err(|_| match self.0.parse() {
            Ok(number) => Refused::invalid_value(Unexpected::Unsigned(number), visitor),
            Err(_) => Refused::invalid_type(Unexpected::Str(self.0), visitor),
        })
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
    use super::{pairs, read, read_form};
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
        #[serde(default)]
        places: Vec<u32>,
    }

    fn refusal(query: &str) -> (String, String) {
        match read::<Asked>(&pairs(query).unwrap()) {
            Err(Error::Unreadable(found) | Error::Invalid(found)) => (found.field, found.message),
            other => panic!("{query}: {other:?}"),
        }
    }

    #[test]
    fn query_values_are_parsed_to_the_types_of_their_fields() {
        let asked: Asked = read(&pairs("number=7&share=0.5&order=descending&contains=12").unwrap()).unwrap();
        let (order, contains) = (Some(Order::Descending), "12".to_owned());
        assert_eq!(asked, Asked { number: 7, share: Some(0.5), order, contains, places: Vec::new() });
    }

    #[test]
    fn missing_field_of_a_form_is_empty_or_makes_the_form_incomplete() {
        #[derive(Debug, Deserialize)]
        struct Sent {
            reason: String,
            after: u32,
        }
        let sent: Sent = read_form(b"after=3").unwrap();
        assert_eq!((sent.reason.as_str(), sent.after), ("", 3));
        for body in ["", "reason=moved"] {
            let refused = read_form::<Sent>(body.as_bytes()).unwrap_err().to_string();
            assert!(refused.starts_with("The form was not sent completely"), "{body}: {refused}");
        }
        let wrong = read_form::<Sent>(b"reason=moved&after=x").unwrap_err();
        assert!(matches!(wrong, Error::Invalid(_)), "{wrong}");
    }

    #[test]
    fn list_is_repeated_or_separated_by_commas() {
        for query in ["number=1&places=3&places=4,5", "places=3%2C4%2C&number=1&places=5", "places=3,4,5&number=1"] {
            assert_eq!(read::<Asked>(&pairs(query).unwrap()).unwrap().places, [3, 4, 5], "{query}");
        }
    }

    #[test]
    fn errors_name_parameter_value_and_allowed_values() {
        for (query, field, message) in [
            ("number=x", "number", "The query parameter number is \"x\"; it must be a whole number of at least 0."),
            (
                "number=4294967296",
                "number",
                "The query parameter number is \"4294967296\"; it must be a whole number of at most 4294967295.",
            ),
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
                "number=1&places=3&places=x",
                "places",
                "The query parameter places is \"x\"; it must be a whole number of at least 0.",
            ),
            (
                "number=1&nmber=2",
                "nmber",
                "The query parameter nmber is unknown. Known query parameters: number, share, order, contains, places.",
            ),
        ] {
            assert_eq!(refusal(query), (field.to_owned(), message.to_owned()));
        }
    }

    #[test]
    fn wrong_value_is_invalid_and_wrong_set_of_parameters_is_unreadable() {
        for query in ["number=x", "number=1&share=half", "number=1&order=up"] {
            let Err(Error::Invalid(field)) = read::<Asked>(&pairs(query).unwrap()) else { panic!("{query}") };
            assert!(field.value.is_some() && field.allowed.is_some(), "{query}: {field:?}");
        }
        for query in ["", "number=1&number=2", "number=1&nmber=2"] {
            assert!(matches!(read::<Asked>(&pairs(query).unwrap()), Err(Error::Unreadable(_))), "{query}");
        }
        let Err(Error::Unreadable(unknown)) = read::<Asked>(&pairs("number=1&nmber=2").unwrap()) else { panic!() };
        assert_eq!(unknown.allowed, None, "no value of an unknown parameter is allowed");
    }
}
