//! The rows of an archive, and archives of changed rows.

use gaitwright_store::archived_row::Row;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

/// The rows of an archive, each with its table.
#[derive(Clone)]
pub(super) struct Rows(pub(super) Vec<(String, Value)>);

impl Rows {
    pub(super) fn of(file: &[u8]) -> Self {
        let start = file.iter().position(|byte| *byte == b'\n').unwrap() + 1;
        let text = String::from_utf8(zstd::decode_all(&file[start..]).unwrap()).unwrap();
        let lines = text.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
        Self(
            lines
                .filter(|line| line.get("row").is_some())
                .map(|mut line| (line["table"].as_str().unwrap().to_owned(), line["row"].take()))
                .collect(),
        )
    }

    /// An archive of these rows, as made by a forger who knows the format.
    pub(super) fn packed(&self) -> Vec<u8> {
        let mut lines = String::new();
        for (table, row) in &self.0 {
            let known: Result<Row, _> = serde_json::from_value(row.clone());
            let sha256 = known.map_or_else(|_| "0".repeat(64), |row| row.sha256());
            lines += &json!({"table": table, "sha256": sha256, "row": row}).to_string();
            lines.push('\n');
        }
        let end = json!({"end": {"rows": self.0.len(), "sha256": hex::encode(Sha256::digest(&lines))}});
        framed(&format!("{lines}{end}\n"))
    }

    pub(super) fn table(&mut self, table: &str) -> Vec<&mut Value> {
        self.0.iter_mut().filter(|(name, _)| name == table).map(|(_, row)| row).collect()
    }

    pub(super) fn first(&mut self, table: &str) -> &mut Value {
        self.table(table).into_iter().next().unwrap_or_else(|| panic!("no row of {table}"))
    }

    /// Adds a row after the last one of its table.
    pub(super) fn add(&mut self, table: &str, row: Value) {
        let last = self.0.iter().rposition(|(name, _)| name == table).map_or(self.0.len(), |place| place + 1);
        self.0.insert(last, (table.to_owned(), row));
    }

    pub(super) fn copy(&mut self, table: &str, change: impl FnOnce(&mut Value)) {
        let mut row = self.first(table).clone();
        change(&mut row);
        self.add(table, row);
    }
}

/// An archive with this content.
pub(super) fn framed(content: &str) -> Vec<u8> {
    [b"gaitwright study 5\n", &zstd::encode_all(content.as_bytes(), 3).unwrap()[..]].concat()
}

pub(super) fn sha256(text: &[u8]) -> String {
    hex::encode(Sha256::digest(text))
}

pub(super) fn blob(bytes: &[u8]) -> Value {
    json!({"hexadecimal": hex::encode(zstd::encode_all(bytes, 3).unwrap())})
}

pub(super) fn text_of(cell: &Value) -> String {
    let bytes = hex::decode(cell["hexadecimal"].as_str().unwrap()).unwrap();
    String::from_utf8(zstd::decode_all(&bytes[..]).unwrap()).unwrap()
}

/// Changes the JSON document in a text column.
pub(super) fn within(row: &mut Value, column: &str, change: impl FnOnce(&mut Value)) {
    let mut document: Value = serde_json::from_str(row[column].as_str().unwrap()).unwrap();
    change(&mut document);
    row[column] = document.to_string().into();
}

/// Changes the gait in a row of gaits, and its hash with it.
pub(super) fn gait(row: &mut Value, change: impl FnOnce(&mut Value)) {
    let mut document: Value = serde_json::from_str(&text_of(&row["gait"])).unwrap();
    change(&mut document);
    let text = document.to_string();
    row["gait"] = blob(text.as_bytes());
    row["gait_sha256"] = sha256(text.as_bytes()).into();
}

/// Changes a definition, its hash and the name beside it.
pub(super) fn definition(row: &mut Value, change: impl FnOnce(&mut Value)) {
    within(row, "definition", change);
    let text = row["definition"].as_str().unwrap().to_owned();
    row["sha256"] = sha256(text.as_bytes()).into();
    let document: Value = serde_json::from_str(&text).unwrap();
    row["name"] = document["name"].clone();
}
