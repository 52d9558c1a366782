//! A table of numbers over time, read strictly: whatever is wrong is named with line and column, and half a table is none.

use crate::subject::ModelError;

/// The lines of a file, without the byte order mark that spreadsheets write at the beginning.
pub(crate) fn lines_of(text: &str) -> Vec<&str> {
    text.trim_start_matches('\u{feff}').lines().collect()
}

/// Named columns of equal length over time.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Table {
    what: String,
    /// Line of the column names in the file.
    first_line: usize,
    names: Vec<String>,
    /// Where a column of words stood, which is left out.
    words: Option<usize>,
    rows: Vec<Vec<f64>>,
    /// Line of each row in the file.
    lines: Vec<usize>,
    /// Rows per second, where no column has the time.
    rate_hz: Option<f64>,
}

/// Where the time of a row comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Clock<'a> {
    /// The first column, which has this name: s, strictly increasing.
    Column(&'a str),
    /// No column: so many rows per second, the first at 0 s.
    Rate(f64),
}

/// The column of the tables of gaits that has words: the name of the domain. A domain ends when the next one begins, so
/// that time is there twice, with the same angles; the second is left out.
const DOMAIN: &str = "domain";
/// Times that differ by less are the same, s: sums of durations, rounded.
const SAME_TIME_S: f64 = 1e-9;

/// Fewest rows of a table over time.
const FEWEST_ROWS: usize = 20;

/// Largest deviation of a sample from its place on an even grid, sampling intervals.
const UNEVENNESS: f64 = 0.5;

/// What separates the cells of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Separator {
    /// Tabs or spaces, any number.
    Blank,
    /// One comma.
    Comma,
}

impl Separator {
    fn split(self, line: &str) -> Vec<&str> {
        match self {
            Self::Blank => line.split_whitespace().collect(),
            Self::Comma => line.split(',').map(str::trim).collect(),
        }
    }
}

impl Table {
    /// Reads the lines after a header: the first has the names, the rest numbers; empty lines at the end are allowed.
    /// `first_line` is the number of the line of names in its file, `what` the file's name.
    pub(crate) fn read(
        what: &str,
        lines: &[&str],
        first_line: usize,
        separator: Separator,
        clock: Clock<'_>,
    ) -> Result<Self, ModelError> {
        let malformed = |line: usize, reason: String| malformed(what, line, None, reason);
        let mut names: Vec<String> = match lines.first() {
            Some(line) => separator.split(line).into_iter().map(str::to_owned).collect(),
            None => return Err(malformed(first_line, "the line of column names is missing".to_owned())),
        };
        if let Clock::Column(time_name) = clock
            && names.first().map(String::as_str) != Some(time_name)
        {
            let found = names.first().map_or("", String::as_str);
            return Err(malformed(first_line, format!("the first column is {found:?}, expected {time_name:?}")));
        }
        for (column, name) in names.iter().enumerate() {
            if names[..column].contains(name) {
                return Err(self::malformed(what, first_line, Some(column + 1), format!("{name:?} is there twice")));
            }
        }
        let words = names.iter().position(|name| separator == Separator::Comma && name == DOMAIN);
        if let Some(column) = words {
            names.remove(column);
        }
        let body = &lines[1..];
        let filled = body.iter().rposition(|line| !line.trim().is_empty()).map_or(0, |last| last + 1);
        let rate_hz = if let Clock::Rate(rate_hz) = clock { Some(rate_hz) } else { None };
        let mut table = Self {
            what: what.to_owned(),
            first_line,
            names,
            words,
            rows: Vec::with_capacity(filled),
            lines: Vec::new(),
            rate_hz,
        };
        let mut before = "";
        for (index, line) in body[..filled].iter().enumerate() {
            let cells = separator.split(line);
            let word = words.and_then(|column| cells.get(column).copied()).unwrap_or_default();
            table.add_row(first_line + 1 + index, &cells, word != before)?;
            before = word;
        }
        if table.rows.len() < FEWEST_ROWS {
            let reason = format!("{} rows, at least {FEWEST_ROWS} are needed", table.rows.len());
            return Err(malformed(first_line + filled, reason));
        }
        Ok(table)
    }

    /// `opens`: a domain begins with this row.
    fn add_row(&mut self, line: usize, cells: &[&str], opens: bool) -> Result<(), ModelError> {
        let columns = self.names.len() + usize::from(self.words.is_some());
        if cells.len() != columns {
            let reason = format!("{} cells, but {columns} columns", cells.len());
            return Err(malformed(&self.what, line, None, reason));
        }
        let mut row = Vec::with_capacity(cells.len());
        for (column, cell) in cells.iter().enumerate().filter(|(column, _)| Some(*column) != self.words) {
            let value = cell.parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(|| {
                let reason = format!("{} = {cell:?} is not a number", self.names[row.len()]);
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
            let reason = format!("the time {} does not follow {}", row[0], before[0]);
            return Err(malformed(&self.what, line, Some(1), reason));
        }
        self.rows.push(row);
        self.lines.push(line);
        Ok(())
    }

    /// The same table with other names of its columns.
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

    /// Names of the columns, without that of the time.
    pub(crate) fn names(&self) -> &[String] {
        if self.rate_hz.is_some() { &self.names } else { &self.names[1..] }
    }

    /// The times, s.
    pub(crate) fn times(&self) -> Vec<f64> {
        match self.rate_hz {
            Some(rate_hz) => (0..self.rows.len()).map(|row| row as f64 / rate_hz).collect(),
            None => self.rows.iter().map(|row| row[0]).collect(),
        }
    }

    /// An error in a row, counted from 0.
    pub(crate) fn malformed_row(&self, row: usize, column: Option<usize>, reason: String) -> ModelError {
        malformed(&self.what, self.lines[row], column, reason)
    }

    /// An error in the line of column names.
    pub(crate) fn malformed_names(&self, reason: String) -> ModelError {
        malformed(&self.what, self.first_line, None, reason)
    }

    /// Samples per second of an evenly sampled table.
    pub(crate) fn even_rate_hz(&self) -> Result<f64, ModelError> {
        let times = self.times();
        let start_s = times[0];
        let rate_hz = (times.len() - 1) as f64 / (times[times.len() - 1] - start_s);
        let uneven = |(k, time): (usize, &f64)| ((time - start_s) * rate_hz - k as f64).abs() > UNEVENNESS;
        if times.iter().enumerate().any(uneven) { Err(self.oddest_step(&times)) } else { Ok(rate_hz) }
    }

    /// The row whose distance to the row before is least like the others.
    fn oddest_step(&self, times: &[f64]) -> ModelError {
        let steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let mut sorted = steps.clone();
        sorted.sort_by(f64::total_cmp);
        let usual = sorted[sorted.len() / 2];
        let odd = |k: &usize| (steps[*k] - usual).abs();
        let row = 1 + (0..steps.len()).max_by(|a, b| odd(a).total_cmp(&odd(b))).unwrap_or(0);
        let reason = format!(
            "the time {} follows {} by {:.6} s, where rows are {usual:.6} s apart: the rows must be evenly spaced",
            times[row],
            times[row - 1],
            steps[row - 1]
        );
        self.malformed_row(row, Some(1), reason)
    }

    /// A column by name, if it is there.
    pub(crate) fn find(&self, name: &str) -> Option<Vec<f64>> {
        let column = self.names.iter().position(|n| n == name)?;
        Some(self.rows.iter().map(|row| row[column]).collect())
    }

    /// A column by name.
    pub(crate) fn column(&self, name: &str) -> Result<Vec<f64>, ModelError> {
        let missing = || format!("column {name:?} is missing; there are {}", self.names.join(", "));
        self.find(name).ok_or_else(|| self.malformed_names(missing()))
    }
}

/// An error at a place of a file; lines and columns count from 1.
pub(crate) fn malformed(what: &str, line: usize, column: Option<usize>, reason: String) -> ModelError {
    let column = column.map_or_else(String::new, |column| format!(", column {column}"));
    ModelError::Malformed { what: format!("{what}, line {line}{column}"), reason }
}
