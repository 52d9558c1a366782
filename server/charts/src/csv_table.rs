//! CSV tables, safe for spreadsheets. No other module writes CSV.
//!
//! A spreadsheet treats a cell that starts with `=`, `+`, `-`, `@`, a tab or a line break as a formula. Such text gets
//! an apostrophe in front, which spreadsheets show as text. Spaces and invisible characters do not count as a start.
//! Numbers are not changed.

use icu_properties::CodePointSetData;
use icu_properties::props::DefaultIgnorableCodePoint;
use std::fmt::Write;

/// Characters that start a formula, including their full-width forms.
const FORMULA: [char; 8] = ['=', '+', '-', '@', '\u{ff1d}', '\u{ff0b}', '\u{ff0d}', '\u{ff20}'];

/// An escaped cell.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CsvCell(String);

impl CsvCell {
    /// An empty cell.
    pub(crate) const EMPTY: Self = Self(String::new());

    /// A text cell that is not a formula.
    fn text(text: &str) -> Self {
        let leaves_no_mark = |c: char| {
            c.is_whitespace() || c.is_control() || CodePointSetData::new::<DefaultIgnorableCodePoint>().contains(c)
        };
        let begins_formula = |part: &str| part.trim_start_matches(leaves_no_mark).starts_with(FORMULA);
        let mut safe = String::with_capacity(text.len() + 1);
        if begins_formula(text) || text.starts_with(['\t', '\r', '\n']) {
            safe.push('\'');
        }
        // Semicolons separate cells in locales with a decimal comma, and some programs split at tabs and lines, too.
        for part in text.split_inclusive([';', '\t', '\r', '\n']) {
            if begins_formula(part) && !safe.ends_with('\'') {
                safe.push('\'');
            }
            safe.push_str(part);
        }
        if safe.contains([',', ';', '"', '\t', '\r', '\n']) {
            return Self(format!("\"{}\"", safe.replace('"', "\"\"")));
        }
        Self(safe)
    }
}

impl From<&str> for CsvCell {
    fn from(text: &str) -> Self {
        Self::text(text)
    }
}

impl From<String> for CsvCell {
    fn from(text: String) -> Self {
        Self::text(&text)
    }
}

impl From<&String> for CsvCell {
    fn from(text: &String) -> Self {
        Self::text(text)
    }
}

impl<T: Into<Self>> From<Option<T>> for CsvCell {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::EMPTY, Into::into)
    }
}

macro_rules! numbers {
    ($($number:ty),*) => {$(
        impl From<$number> for CsvCell {
            fn from(number: $number) -> Self {
                Self(number.to_string())
            }
        }
        impl From<&$number> for CsvCell {
            fn from(number: &$number) -> Self {
                Self(number.to_string())
            }
        }
    )*};
}
numbers!(f64, u32, u64, i64, usize);

/// A row of cells.
#[macro_export]
macro_rules! cells {
    ($($value:expr),* $(,)?) => { vec![$($crate::csv_table::CsvCell::from($value)),*] };
}
pub use cells;

/// A table that grows by rows.
#[derive(Debug, Default)]
pub struct CsvTable(String);

impl CsvTable {
    /// A table with this header.
    pub fn new<T: Into<CsvCell>>(header: impl IntoIterator<Item = T>) -> Self {
        let mut table = Self::default();
        table.row(header.into_iter().map(Into::into));
        table
    }

    /// Adds a row.
    pub fn row(&mut self, cells: impl IntoIterator<Item = CsvCell>) {
        for (place, cell) in cells.into_iter().enumerate() {
            let comma = if place == 0 { "" } else { "," };
            // Writing to a String cannot fail.
            let _ = write!(self.0, "{comma}{}", cell.0);
        }
        self.0.push('\n');
    }

    /// The file.
    pub fn into_text(self) -> String {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_never_a_formula_and_numbers_are_unchanged() {
        let mut table = CsvTable::new(["name", "value"]);
        for text in ["=HYPERLINK(\"http://x\";\"y\")", "+1+1", "-1", "@SUM(1)", "\tx", "\rx", " =1", "\u{ff1d}1"] {
            table.row(cells![text, -1.5_f64]);
        }
        table.row(cells!["a, \"b\"", Some(-3_i64)]);
        table.row(cells!["a=b", None::<f64>]);
        let expected = "name,value\n\"'=HYPERLINK(\"\"http://x\"\";\"\"y\"\")\",-1.5\n'+1+1,-1.5\n'-1,-1.5\n'@SUM(1),-1.5\n\
                        \"'\tx\",-1.5\n\"'\rx\",-1.5\n' =1,-1.5\n'\u{ff1d}1,-1.5\n\"a, \"\"b\"\"\",-3\na=b,\n";
        assert_eq!(table.into_text(), expected);
    }

    #[test]
    fn invisible_characters_do_not_hide_a_formula() {
        for hidden in ['\u{ad}', '\u{200b}', '\u{2060}', '\u{feff}', '\u{3164}', '\u{e0020}', '\u{a0}', '\u{7f}', '\0']
        {
            for start in ["=1", "+1", "-1", "@A1", "\u{ff1d}1", " =1", "\t=1"] {
                let cell = CsvCell::text(&format!("{hidden}{start}"));
                assert!(cell.0.starts_with('\'') || cell.0.starts_with("\"'"), "{hidden:?}{start:?}: {cell:?}");
            }
            assert_eq!(CsvCell::text(&format!("{hidden}a=1")).0, format!("{hidden}a=1"));
        }
    }

    #[test]
    fn formulas_after_a_separator_within_a_text_are_neutralised() {
        for (text, expected) in
            [("a;=1+1;b", "\"a;'=1+1;b\""), ("x\n=1", "\"x\n'=1\""), ("x\t @A1", "\"x\t' @A1\""), ("a; b", "\"a; b\"")]
        {
            assert_eq!(CsvCell::text(text).0, expected);
        }
    }

    #[test]
    fn no_other_module_writes_csv() {
        fn sources(folder: &std::path::Path, found: &mut Vec<std::path::PathBuf>) {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    sources(&path, found);
                } else if path.extension().is_some_and(|ending| ending == "rs") {
                    found.push(path);
                }
            }
        }
        let mut files = Vec::new();
        sources(&std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(".."), &mut files);
        assert!(files.len() > 100);
        for file in files.iter().filter(|file| !file.ends_with("csv_table.rs")) {
            let text = std::fs::read_to_string(file).unwrap();
            for way in ["csv::Writer", ".join(\",\") + \"\\n\""] {
                assert!(!text.contains(way), "{}: {way}", file.display());
            }
        }
    }
}
