//! A row of any table with its columns, as archives contain it.

use super::{Connection, StoreError, StoreResult};
use serde::de::{Error as _, MapAccess, Visitor};
use serde::ser::{Error as _, SerializeMap};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use sha2::{Digest, Sha256};
use sqlx::sqlite::SqliteRow;
use sqlx::{AssertSqlSafe, Column, Row as _, TypeInfo, ValueRef};
use std::collections::BTreeMap;
use std::fmt;

/// Largest text in a column of an archive, bytes. The program writes at most some hundred kilobytes.
pub const MAX_TEXT_BYTES: usize = 4 << 20;
/// Largest compressed value in a column of an archive, bytes. An uploaded file has fewer.
pub const MAX_BLOB_BYTES: usize = 16 << 20;
/// Maximum number of columns.
const MAX_COLUMNS: usize = 64;
/// JSON key of a binary value.
const HEXADECIMAL: &str = "hexadecimal";

/// A value of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// Null.
    Null,
    /// An integer.
    Integer(i64),
    /// A floating-point number.
    Real(f64),
    /// A text.
    Text(String),
    /// Bytes.
    Blob(Vec<u8>),
}

/// A row: values by column.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Row(BTreeMap<String, Cell>);

impl Row {
    /// The value of a column.
    pub fn get(&self, column: &str) -> Option<&Cell> {
        self.0.get(column)
    }

    /// The text of a column.
    pub fn text(&self, column: &str) -> Option<&str> {
        match self.0.get(column) {
            Some(Cell::Text(text)) => Some(text),
            _ => None,
        }
    }

    /// The integer of a column.
    pub fn integer(&self, column: &str) -> Option<i64> {
        match self.0.get(column) {
            Some(Cell::Integer(number)) => Some(*number),
            _ => None,
        }
    }

    /// The real number of a column.
    pub fn real(&self, column: &str) -> Option<f64> {
        match self.0.get(column) {
            Some(Cell::Real(number)) => Some(*number),
            _ => None,
        }
    }

    /// Sets the value of a column.
    pub fn set(&mut self, column: &str, cell: Cell) {
        self.0.insert(column.to_owned(), cell);
    }

    /// Removes a column.
    pub fn remove(&mut self, column: &str) -> Option<Cell> {
        self.0.remove(column)
    }

    /// Columns and values, by name.
    pub fn cells(&self) -> impl Iterator<Item = (&str, &Cell)> {
        self.0.iter().map(|(name, cell)| (name.as_str(), cell))
    }

    /// The hash of the row, as in its seal (`store::seals`): over name, type, length and bytes of each column that is
    /// not null, sorted by name.
    pub fn sha256(&self) -> String {
        let mut hash = Sha256::new();
        for (name, cell) in &self.0 {
            let (kind, bytes): (&str, &[u8]) = match cell {
                Cell::Null => continue,
                Cell::Integer(number) => ("INTEGER", &number.to_be_bytes()),
                Cell::Real(number) => ("REAL", &number.to_bits().to_be_bytes()),
                Cell::Text(text) => ("TEXT", text.as_bytes()),
                Cell::Blob(bytes) => ("BLOB", bytes),
            };
            hash.update(format!("{name}\n{kind}\n{}\n", bytes.len()));
            hash.update(bytes);
        }
        hex::encode(hash.finalize())
    }

    /// Reads a row of a query, without the column `skipped`.
    pub(super) fn from_sqlite(row: &SqliteRow, skipped: &str) -> StoreResult<Self> {
        let mut cells = BTreeMap::new();
        for (index, column) in row.columns().iter().enumerate().filter(|(_, column)| column.name() != skipped) {
            let raw = row.try_get_raw(index)?;
            let cell = if raw.is_null() {
                Cell::Null
            } else {
                match raw.type_info().name() {
                    "INTEGER" | "BOOLEAN" => Cell::Integer(row.try_get(index)?),
                    "REAL" => Cell::Real(row.try_get(index)?),
                    "BLOB" => Cell::Blob(row.try_get(index)?),
                    _ => Cell::Text(row.try_get(index)?),
                }
            };
            cells.insert(column.name().to_owned(), cell);
        }
        Ok(Self(cells))
    }

    /// Inserts the row into a table with the `known` columns, and returns its rowid. Only known names become part of
    /// the statement.
    pub(super) async fn insert(self, db: &mut Connection, table: &str, known: &[String]) -> StoreResult<i64> {
        if let Some(unknown) = self.0.keys().find(|name| !known.contains(name)) {
            let reason = format!("a row of {table} has an unknown column {unknown:?}");
            return Err(StoreError::Damaged { what: "archive", reason });
        }
        let names: Vec<&str> = self.0.keys().map(String::as_str).collect();
        let places = vec!["?"; names.len()].join(", ");
        let sql = AssertSqlSafe(format!("insert into {table} ({}) values ({places})", names.join(", ")));
        let mut query = sqlx::query(sql);
        for cell in self.0.into_values() {
            query = match cell {
                Cell::Null => query.bind(None::<String>),
                Cell::Integer(number) => query.bind(number),
                Cell::Real(number) => query.bind(number),
                Cell::Text(text) => query.bind(text),
                Cell::Blob(bytes) => query.bind(bytes),
            };
        }
        Ok(query.execute(db).await?.last_insert_rowid())
    }
}

impl Serialize for Cell {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Null => serializer.serialize_unit(),
            Self::Integer(number) => serializer.serialize_i64(*number),
            Self::Real(number) if number.is_finite() => serializer.serialize_f64(*number),
            Self::Real(number) => Err(S::Error::custom(format!("{number} is not a JSON number"))),
            Self::Text(text) => serializer.serialize_str(text),
            Self::Blob(bytes) => {
                let mut map = serializer.serialize_map(Some(1))?;
                map.serialize_entry(HEXADECIMAL, &hex::encode(bytes))?;
                map.end()
            }
        }
    }
}

impl Serialize for Row {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(&self.0)
    }
}

struct CellVisitor;

impl<'de> Visitor<'de> for CellVisitor {
    type Value = Cell;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("null, a number, a string or bytes")
    }

    fn visit_unit<E>(self) -> Result<Cell, E> {
        Ok(Cell::Null)
    }

    fn visit_i64<E>(self, number: i64) -> Result<Cell, E> {
        Ok(Cell::Integer(number))
    }

    fn visit_u64<E: serde::de::Error>(self, number: u64) -> Result<Cell, E> {
        i64::try_from(number).map(Cell::Integer).map_err(|_| E::custom(format!("{number} is too large")))
    }

    fn visit_f64<E>(self, number: f64) -> Result<Cell, E> {
        Ok(Cell::Real(number))
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Cell, E> {
        if text.len() > MAX_TEXT_BYTES {
            return Err(E::custom(format!(
                "a string has {} bytes, but at most {MAX_TEXT_BYTES} are allowed",
                text.len()
            )));
        }
        Ok(Cell::Text(text.to_owned()))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Cell, A::Error> {
        let bytes = match map.next_entry::<Name, Hexadecimal>()? {
            Some((name, bytes)) if name.0 == HEXADECIMAL => bytes.0,
            _ => return Err(A::Error::custom("an object must be a binary value")),
        };
        match map.next_key::<Name>()? {
            None => Ok(Cell::Blob(bytes)),
            Some(_) => Err(A::Error::custom("an object has other fields besides its binary value")),
        }
    }
}

impl<'de> Deserialize<'de> for Cell {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(CellVisitor)
    }
}

/// A short name.
struct Name(String);

struct NameVisitor;

impl Visitor<'_> for NameVisitor {
    type Value = Name;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the name of a column")
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Name, E> {
        if text.len() > 100 {
            Err(E::custom("a column name has more than 100 bytes"))
        } else {
            Ok(Name(text.to_owned()))
        }
    }
}

impl<'de> Deserialize<'de> for Name {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_str(NameVisitor)
    }
}

struct Hexadecimal(Vec<u8>);

struct HexadecimalVisitor;

impl Visitor<'_> for HexadecimalVisitor {
    type Value = Hexadecimal;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("hexadecimal text")
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Hexadecimal, E> {
        if text.len() > 2 * MAX_BLOB_BYTES {
            return Err(E::custom(format!(
                "a binary value has {} bytes, but at most {MAX_BLOB_BYTES} are allowed",
                text.len() / 2
            )));
        }
        hex::decode(text).map(Hexadecimal).map_err(|_| E::custom("a binary value is not hexadecimal"))
    }
}

impl<'de> Deserialize<'de> for Hexadecimal {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_str(HexadecimalVisitor)
    }
}

impl<'de> Deserialize<'de> for Row {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct RowVisitor;
        impl<'de> Visitor<'de> for RowVisitor {
            type Value = Row;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a row")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Row, A::Error> {
                let mut cells = BTreeMap::new();
                while let Some((Name(name), cell)) = map.next_entry::<Name, Cell>()? {
                    if cells.len() == MAX_COLUMNS {
                        return Err(A::Error::custom(format!("it has more than {MAX_COLUMNS} columns")));
                    }
                    if cells.contains_key(&name) {
                        return Err(A::Error::custom(format!("column {name:?} occurs twice")));
                    }
                    cells.insert(name, cell);
                }
                Ok(Row(cells))
            }
        }
        deserializer.deserialize_map(RowVisitor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_survive_a_round_trip_bit_for_bit() {
        let mut row = Row::default();
        row.set("a", Cell::Integer(i64::MIN));
        row.set("b", Cell::Real(-0.0));
        row.set("c", Cell::Real(0.1 + 0.2));
        row.set("d", Cell::Text("é\n\"".to_owned()));
        row.set("e", Cell::Blob(vec![0, 255]));
        row.set("f", Cell::Null);
        row.set("g", Cell::Real(3.0));
        let text = serde_json::to_string(&row).unwrap();
        let back: Row = serde_json::from_str(&text).unwrap();
        assert_eq!((back.sha256(), &back), (row.sha256(), &row));
        assert!(matches!(back.get("b"), Some(Cell::Real(zero)) if zero.is_sign_negative()));
    }

    #[test]
    fn rows_with_nested_or_oversized_values_are_refused() {
        for (text, why) in [
            (r#"{"a": [1]}"#.to_owned(), "invalid type: sequence"),
            (r#"{"a": true}"#.to_owned(), "invalid type: boolean"),
            (r#"{"a": {"b": 1}}"#.to_owned(), "invalid type: integer"),
            (r#"{"a": {"b": "00"}}"#.to_owned(), "must be a binary value"),
            (r#"{"a": {"hexadecimal": "0"}}"#.to_owned(), "not hexadecimal"),
            (r#"{"a": {"hexadecimal": "00", "b": 1}}"#.to_owned(), "other fields besides its binary value"),
            (r#"{"a": 1, "a": 2}"#.to_owned(), "twice"),
            (r#"{"a": 18446744073709551615}"#.to_owned(), "too large"),
            (format!(r#"{{"a": "{}"}}"#, "x".repeat(MAX_TEXT_BYTES + 1)), "a string has"),
            (format!(r#"{{"{}": 1}}"#, "x".repeat(101)), "a column name has more than"),
            ("[".repeat(100_000), "invalid type"),
        ] {
            let refusal = serde_json::from_str::<Row>(&text).unwrap_err().to_string();
            assert!(refusal.contains(why), "{refusal}");
        }
    }
}
