//! A table of numbers over time, read strictly: whatever is wrong is named with line and column, and half a table is none.

use crate::subject::ModelError;

/// Named columns of equal length; the first is the time, s, strictly increasing.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Table {
    what: String,
    names: Vec<String>,
    rows: Vec<Vec<f64>>,
}

/// Fewest rows of a table over time.
const FEWEST_ROWS: usize = 20;

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
        time_name: &str,
    ) -> Result<Self, ModelError> {
        let malformed = |line: usize, reason: String| malformed(what, line, None, reason);
        let names: Vec<String> = match lines.first() {
            Some(line) => separator.split(line).into_iter().map(str::to_owned).collect(),
            None => return Err(malformed(first_line, "the line of column names is missing".to_owned())),
        };
        if names.first().map(String::as_str) != Some(time_name) {
            let found = names.first().map_or("", String::as_str);
            return Err(malformed(first_line, format!("the first column is {found:?}, expected {time_name:?}")));
        }
        for (column, name) in names.iter().enumerate() {
            if names[..column].contains(name) {
                return Err(self::malformed(what, first_line, Some(column + 1), format!("{name:?} is there twice")));
            }
        }
        let body = &lines[1..];
        let filled = body.iter().rposition(|line| !line.trim().is_empty()).map_or(0, |last| last + 1);
        let mut table = Self { what: what.to_owned(), names, rows: Vec::with_capacity(filled) };
        for (index, line) in body[..filled].iter().enumerate() {
            table.add_row(first_line + 1 + index, &separator.split(line))?;
        }
        if table.rows.len() < FEWEST_ROWS {
            let reason = format!("{} rows, at least {FEWEST_ROWS} are needed", table.rows.len());
            return Err(malformed(first_line + filled, reason));
        }
        Ok(table)
    }

    fn add_row(&mut self, line: usize, cells: &[&str]) -> Result<(), ModelError> {
        if cells.len() != self.names.len() {
            let reason = format!("{} cells, but {} columns", cells.len(), self.names.len());
            return Err(malformed(&self.what, line, None, reason));
        }
        let mut row = Vec::with_capacity(cells.len());
        for (column, cell) in cells.iter().enumerate() {
            let value = cell.parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(|| {
                let reason = format!("{} = {cell:?} is not a number", self.names[column]);
                malformed(&self.what, line, Some(column + 1), reason)
            })?;
            row.push(value);
        }
        if let Some(before) = self.rows.last()
            && row[0] <= before[0]
        {
            let reason = format!("the time {} does not follow {}", row[0], before[0]);
            return Err(malformed(&self.what, line, Some(1), reason));
        }
        self.rows.push(row);
        Ok(())
    }

    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }

    /// Number of columns.
    pub(crate) fn width(&self) -> usize {
        self.names.len()
    }

    /// Names of the columns, that of the time first.
    pub(crate) fn names(&self) -> &[String] {
        &self.names
    }

    /// The times, s.
    pub(crate) fn times(&self) -> Vec<f64> {
        self.rows.iter().map(|row| row[0]).collect()
    }

    /// A column by name, if it is there.
    pub(crate) fn find(&self, name: &str) -> Option<Vec<f64>> {
        let column = self.names.iter().position(|n| n == name)?;
        Some(self.rows.iter().map(|row| row[column]).collect())
    }

    /// A column by name.
    pub(crate) fn column(&self, name: &str) -> Result<Vec<f64>, ModelError> {
        self.find(name).ok_or_else(|| ModelError::Malformed {
            what: self.what.clone(),
            reason: format!("column {name:?} is missing; there are {}", self.names.join(", ")),
        })
    }
}

/// An error at a place of a file; lines and columns count from 1.
pub(crate) fn malformed(what: &str, line: usize, column: Option<usize>, reason: String) -> ModelError {
    let column = column.map_or_else(String::new, |column| format!(", column {column}"));
    ModelError::Malformed { what: format!("{what}, line {line}{column}"), reason }
}
