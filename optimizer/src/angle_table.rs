//! A file of joint angles whose columns have names of their own, and which column is which angle.

use crate::model_error::ModelError;
use crate::opensim_reading::{AngleUnit, StorageFile};
use crate::table::{Separator, Table, TimeColumn, lines_of};

/// The column of a joint angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AngleColumn<'a> {
    /// The joint, one of [`crate::limit_cycle::JOINTS`].
    pub joint: &'a str,
    /// The column of the file.
    pub column: &'a str,
    /// Whether its sign is opposite to that of the walker, in which forward lean, flexion and dorsiflexion are positive.
    pub reversed: bool,
}

/// A file of joint angles. Its first column is the time, s.
#[derive(Debug, Clone, PartialEq)]
pub struct AngleTable {
    table: Table,
    /// Unit of the angles in the header.
    unit: Option<AngleUnit>,
    /// Lines above the names of the columns, without `#`.
    comments: Vec<String>,
}

impl AngleTable {
    /// Parses a CSV file with any names. Lines that begin with `#` before the names are comments.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with line and column.
    pub fn from_csv(what: &str, text: &str) -> Result<Self, ModelError> {
        let lines = lines_of(text);
        let above = lines.iter().take_while(|line| line.starts_with('#')).count();
        let comments = lines[..above].iter().map(|line| line.trim_start_matches('#').trim().to_owned()).collect();
        let table = Table::read(what, &lines[above..], above + 1, Separator::Comma, TimeColumn::First)?;
        Ok(Self { table, unit: None, comments })
    }

    /// Parses an OpenSim motion or storage file with any names.
    ///
    /// # Errors
    /// [`ModelError::Malformed`] with line and column.
    pub fn from_opensim(what: &str, text: &str) -> Result<Self, ModelError> {
        let file = StorageFile::read(what, text)?;
        let unit = file.unit();
        Ok(Self { table: file.table, unit, comments: Vec::new() })
    }

    /// Unit of the angles in the header of an OpenSim file.
    pub fn unit(&self) -> Option<AngleUnit> {
        self.unit
    }

    /// Names of the columns, without the time.
    pub fn columns(&self) -> &[String] {
        self.table.names()
    }

    /// Whether the time and these columns have these names.
    pub(crate) fn has(&self, time: &str, columns: &[&str]) -> bool {
        self.table.time_name() == time && columns.iter().all(|name| self.columns().iter().any(|known| known == name))
    }

    /// Times of the rows, s.
    pub fn times(&self) -> Vec<f64> {
        self.table.times()
    }

    /// The values of a column, if it exists.
    pub fn values(&self, column: &str) -> Option<Vec<f64>> {
        self.columns().iter().any(|known| known == column).then(|| self.table.find(column)).flatten()
    }

    /// The angle of a column, rad, in the sign of the walker.
    pub(crate) fn angle(&self, column: &AngleColumn<'_>, unit: AngleUnit) -> Result<Vec<f64>, ModelError> {
        let factor = unit.in_radians() * if column.reversed { -1.0 } else { 1.0 };
        Ok(self.table.column(column.column)?.into_iter().map(|value| value * factor).collect())
    }

    pub(crate) fn table(&self) -> &Table {
        &self.table
    }

    /// The comments, and how the angles were read, for the provenance.
    pub(crate) fn steps(&self, what: &str, columns: &[AngleColumn<'_>], unit: AngleUnit) -> Vec<String> {
        let rows = self.table.len();
        let mut steps = self.comments.clone();
        steps.push(format!("{what}: {rows} rows, angles in {}, columns chosen by hand", unit.in_words()));
        steps.extend(columns.iter().map(|column| {
            let sign = if column.reversed { "-" } else { "" };
            format!("{} = {sign}{}", column.joint, column.column)
        }));
        steps
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn first_column_is_the_time_whatever_its_name() {
        let rows: Vec<String> = (0..20).map(|row| format!("{},{}\n", f64::from(row) / 100.0, 2 * row)).collect();
        let rows = rows.concat();
        let file = AngleTable::from_csv("a.csv", &format!("# treadmill\nTime (s),Left knee\n{rows}")).unwrap();
        assert_eq!((file.columns(), file.unit()), (&["Left knee".to_owned()][..], None));
        assert!(file.values("Time (s)").is_none());
        let column = AngleColumn { joint: "knee_L", column: "Left knee", reversed: true };
        let angle = file.angle(&column, AngleUnit::Degrees).unwrap();
        assert!((angle[10] + 20_f64.to_radians()).abs() < 1e-12);
        assert_eq!(
            file.steps("a.csv", &[column], AngleUnit::Degrees),
            ["treadmill", "a.csv: 20 rows, angles in degrees, columns chosen by hand", "knee_L = -Left knee"]
        );
        let missing = AngleColumn { column: "knee", ..column };
        let refused = file.angle(&missing, AngleUnit::Degrees).unwrap_err().to_string();
        assert!(refused.starts_with("a.csv, line 2: column \"knee\" is missing"), "{refused}");
    }
}
