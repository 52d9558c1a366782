//! Strict parser of tables of numbers over time. Errors name line and column; a table with an error is rejected.

use crate::model_error::ModelError;
use std::borrow::Cow;

/// The lines of a file, without the byte order mark that spreadsheets write first.
pub(crate) fn lines_of(text: &str) -> Vec<&str> {
    text.trim_start_matches('\u{feff}').lines().collect()
}

/// Named columns over time.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Table {
    what: String,
    /// Line of the column names in the file.
    first_line: usize,
    names: Vec<String>,
    /// Position of the column of words, which is skipped.
    words: Option<usize>,
    rows: Vec<Vec<f64>>,
    /// Line of each row in the file.
    lines: Vec<usize>,
    /// Rows per second, if no column has the time.
    rate_hz: Option<f64>,
}

/// Source of the time of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum TimeColumn<'a> {
    /// The first column, which has this name, in s and strictly increasing.
    Column(&'a str),
    /// The first column, whatever its name, in s and strictly increasing.
    First,
    /// A constant number of rows per second, the first row at 0 s.
    Rate(f64),
}

/// The column of words in the table of a gait: the name of the domain. The last row of a domain and the first row of
/// the next one have the same time and angles, so the second of them is skipped.
const DOMAIN: &str = "domain";
/// Tolerance for equal times, s: the times of a gait are rounded sums of durations.
const SAME_TIME_S: f64 = 1e-9;

/// Smallest number of rows of a table.
const MIN_ROWS: usize = 20;

/// Largest deviation of a row from an even grid, in sampling intervals.
const UNEVENNESS: f64 = 0.5;

/// Separator of the cells of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Separator {
    /// Any number of tabs or spaces.
    Blank,
    /// One comma. Cells may be quoted, as some programs write names.
    Comma,
}

impl Separator {
    fn split(self, line: &str) -> Vec<Cow<'_, str>> {
        match self {
            Self::Blank => line.split_whitespace().map(Cow::Borrowed).collect(),
            // A quote that is not closed stays in its cell, which is then no number.
            Self::Comma if line.contains('"') && line.matches('"').count().is_multiple_of(2) => quoted_cells(line),
            Self::Comma => line.split(',').map(|cell| Cow::Borrowed(cell.trim())).collect(),
        }
    }
}

/// The cells of a line with quotes (RFC 4180). One record of valid UTF-8 always parses; a line without cells would be refused
/// for their number.
fn quoted_cells(line: &str) -> Vec<Cow<'_, str>> {
    let mut reader = csv::ReaderBuilder::new().has_headers(false).trim(csv::Trim::All).from_reader(line.as_bytes());
    let record = reader.records().next().and_then(Result::ok).unwrap_or_default();
    record.iter().map(|cell| Cow::Owned(cell.to_owned())).collect()
}

impl Table {
    /// Parses the lines after a header: a line of names, then lines of numbers. Trailing empty lines are allowed.
    /// `first_line` is the number of the line of names in the file `what`.
    pub(crate) fn read(
        what: &str,
        lines: &[&str],
        first_line: usize,
        separator: Separator,
        clock: TimeColumn<'_>,
    ) -> Result<Self, ModelError> {
        let malformed = |line: usize, reason: String| malformed(what, line, None, reason);
        let mut names: Vec<String> = match lines.first() {
            Some(line) => separator.split(line).into_iter().map(Cow::into_owned).collect(),
            None => return Err(malformed(first_line, "the line of column names is missing".to_owned())),
        };
        if let TimeColumn::Column(time_name) = clock
            && names.first().map(String::as_str) != Some(time_name)
        {
            let found = names.first().map_or("", String::as_str);
            return Err(malformed(first_line, format!("the first column is {found:?}; it must be {time_name:?}")));
        }
        for (column, name) in names.iter().enumerate() {
            if names[..column].contains(name) {
                return Err(self::malformed(
                    what,
                    first_line,
                    Some(column + 1),
                    format!("column {name:?} occurs twice"),
                ));
            }
        }
        let words = names.iter().position(|name| separator == Separator::Comma && name == DOMAIN);
        if let Some(column) = words {
            names.remove(column);
        }
        let body = &lines[1..];
        let filled = body.iter().rposition(|line| !line.trim().is_empty()).map_or(0, |last| last + 1);
        let rate_hz = if let TimeColumn::Rate(rate_hz) = clock { Some(rate_hz) } else { None };
        let mut table = Self {
            what: what.to_owned(),
            first_line,
            names,
            words,
            rows: Vec::with_capacity(filled),
            lines: Vec::new(),
            rate_hz,
        };
        let mut before = String::new();
        for (index, line) in body[..filled].iter().enumerate() {
            let cells = separator.split(line);
            let word = words.and_then(|column| cells.get(column)).map_or("", |cell| cell.as_ref());
            table.add_row(first_line + 1 + index, &cells, word != before)?;
            word.clone_into(&mut before);
        }
        if table.rows.len() < MIN_ROWS {
            let reason = format!("the number of rows is {}; it must be at least {MIN_ROWS}", table.rows.len());
            return Err(malformed(first_line + filled, reason));
        }
        Ok(table)
    }

    /// Parses a row; `opens` if it is the first row of a domain.
    fn add_row(&mut self, line: usize, cells: &[Cow<'_, str>], opens: bool) -> Result<(), ModelError> {
        let columns = self.names.len() + usize::from(self.words.is_some());
        if cells.len() != columns {
            let reason = format!("the number of cells is {}; it must be {columns}", cells.len());
            return Err(malformed(&self.what, line, None, reason));
        }
        let mut row = Vec::with_capacity(cells.len());
        for (column, cell) in cells.iter().enumerate().filter(|(column, _)| Some(*column) != self.words) {
            let value = cell.parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(|| {
                let reason = format!("{} is {cell:?}; it must be a number", self.names[row.len()]);
                malformed(&self.what, line, Some(column + 1), reason)
            })?;
            row.push(value);
        }
        let before = self.rows.last().filter(|_| self.rate_hz.is_none());
        if opens && before.is_some_and(|before| (row[0] - before[0]).abs() < SAME_TIME_S) {
            return Ok(());
        }
        if let Some(before) = before
            && row[0] <= before[0]
        {
            let reason = format!("time {} follows {}; times must increase", row[0], before[0]);
            return Err(malformed(&self.what, line, Some(1), reason));
        }
        self.rows.push(row);
        self.lines.push(line);
        Ok(())
    }

    /// Renames the columns.
    pub(crate) fn with_names(mut self, other: impl Fn(&str) -> &str) -> Self {
        for name in &mut self.names {
            *name = other(name).to_owned();
        }
        self
    }

    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }

    /// Number of columns.
    pub(crate) fn width(&self) -> usize {
        self.names.len()
    }

    /// Names of the columns, without the time.
    pub(crate) fn names(&self) -> &[String] {
        if self.rate_hz.is_some() { &self.names } else { &self.names[1..] }
    }

    /// Name of the first column, which has the time unless a constant rate gives it.
    pub(crate) fn time_name(&self) -> &str {
        self.names.first().map_or("", String::as_str)
    }

    /// Times of the rows, s.
    pub(crate) fn times(&self) -> Vec<f64> {
        match self.rate_hz {
            Some(rate_hz) => (0..self.rows.len()).map(|row| row as f64 / rate_hz).collect(),
            None => self.rows.iter().map(|row| row[0]).collect(),
        }
    }

    /// An error in a row; rows count from 0.
    pub(crate) fn malformed_row(&self, row: usize, column: Option<usize>, reason: String) -> ModelError {
        malformed(&self.what, self.lines[row], column, reason)
    }

    /// An error in the line of column names.
    pub(crate) fn malformed_names(&self, reason: String) -> ModelError {
        malformed(&self.what, self.first_line, None, reason)
    }

    /// Rows per second of an evenly sampled table.
    ///
    /// # Errors
    /// If the rows are not evenly spaced.
    pub(crate) fn even_rate_hz(&self) -> Result<f64, ModelError> {
        let times = self.times();
        let start_s = times[0];
        let rate_hz = (times.len() - 1) as f64 / (times[times.len() - 1] - start_s);
        let uneven = |(k, time): (usize, &f64)| ((time - start_s) * rate_hz - k as f64).abs() > UNEVENNESS;
        if times.iter().enumerate().any(uneven) { Err(self.oddest_step(&times)) } else { Ok(rate_hz) }
    }

    /// The row whose distance to the previous row differs most from the usual one.
    fn oddest_step(&self, times: &[f64]) -> ModelError {
        let steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let mut sorted = steps.clone();
        sorted.sort_by(f64::total_cmp);
        let usual = sorted[sorted.len() / 2];
        let odd = |k: &usize| (steps[*k] - usual).abs();
        let row = 1 + (0..steps.len()).max_by(|a, b| odd(a).total_cmp(&odd(b))).unwrap_or(0);
        let reason = format!(
            "time {} is {2:.6} s after {1}, but the usual spacing is {usual:.6} s; rows must be evenly spaced",
            times[row],
            times[row - 1],
            steps[row - 1]
        );
        self.malformed_row(row, Some(1), reason)
    }

    /// The column with this name, if it exists.
    pub(crate) fn find(&self, name: &str) -> Option<Vec<f64>> {
        let column = self.names.iter().position(|n| n == name)?;
        Some(self.rows.iter().map(|row| row[column]).collect())
    }

    /// The column with this name.
    pub(crate) fn column(&self, name: &str) -> Result<Vec<f64>, ModelError> {
        let missing = || format!("column {name:?} is missing; the columns are {}", self.names.join(", "));
        self.find(name).ok_or_else(|| self.malformed_names(missing()))
    }
}

/// An error at a position in a file; lines and columns count from 1.
pub(crate) fn malformed(what: &str, line: usize, column: Option<usize>, reason: String) -> ModelError {
    let column = column.map_or_else(String::new, |column| format!(", column {column}"));
    ModelError::Malformed { what: format!("{what}, line {line}{column}"), reason }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn read(lines: &[String]) -> Result<Table, ModelError> {
        let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
        Table::read("a.csv", &lines, 1, Separator::Comma, TimeColumn::Column("time_s"))
    }

    fn lines(quote: &str) -> Vec<String> {
        let names = format!("{quote}time_s{quote},{quote}knee{quote}");
        std::iter::once(names).chain((0..20).map(|row| format!("{quote}0.{row:02}{quote}, {row}"))).collect()
    }

    #[test]
    fn quoted_cells_are_read_like_plain_ones() {
        assert_eq!(read(&lines("\"")).unwrap(), read(&lines("")).unwrap());
        assert_eq!(read(&lines("\"")).unwrap().column("knee").unwrap().len(), 20);
    }

    #[test]
    fn open_quote_is_refused_with_line_and_column() {
        for (row, place) in
            [("0.02,\"2", "line 4, column 2"), ("\"0.02,2", "line 4, column 1"), ("0.02,2\"", "column 2")]
        {
            let mut open = lines("");
            open[3] = row.to_owned();
            let refused = read(&open).unwrap_err().to_string();
            assert!(refused.contains(place), "{refused}");
        }
    }
}
