//! OpenSim's motion and storage files (.mot, .sto): a header that ends with `endheader`, then a table over time.

use crate::subject::ModelError;
use crate::table::{Clock, Separator, Table, lines_of, malformed};

/// Unit of the angles of an OpenSim file whose header does not say it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AngleUnit {
    /// Degrees.
    Degrees,
    /// Radians.
    Radians,
}

impl AngleUnit {
    fn in_words(self) -> &'static str {
        match self {
            Self::Degrees => "degrees",
            Self::Radians => "radians",
        }
    }

    /// Radians per unit.
    pub(crate) fn in_radians(self) -> f64 {
        match self {
            Self::Degrees => std::f64::consts::PI / 180.0,
            Self::Radians => 1.0,
        }
    }
}

/// A file as read: whole, or not at all.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StorageFile {
    pub(crate) table: Table,
    /// What the header says of the unit of angles.
    unit: Option<AngleUnit>,
    /// Line that ends the header.
    header_end: usize,
}

impl StorageFile {
    /// Reads the header and the table; `what` names the file.
    pub(crate) fn read(what: &str, text: &str) -> Result<Self, ModelError> {
        let lines = lines_of(text);
        let end = lines
            .iter()
            .position(|line| line.trim().eq_ignore_ascii_case("endheader"))
            .ok_or_else(|| malformed(what, lines.len().max(1), None, "there is no line \"endheader\"".to_owned()))?;
        let header = &lines[..end];
        let unit = unit_said(what, header)?;
        let table = Table::read(what, &lines[end + 1..], end + 2, Separator::Blank, Clock::Column("time"))?
            .with_names(coordinate_name);
        let (rows, columns) = (table.len(), table.width());
        for (name, found) in [("nRows", rows), ("nColumns", columns), ("datarows", rows), ("datacolumns", columns)] {
            if let Some((line, value)) = settings(header, name).next()
                && value.parse::<usize>() != Ok(found)
            {
                let reason = format!("{name}={value}, but there are {found}: the file is not whole");
                return Err(malformed(what, line, None, reason));
            }
        }
        Ok(Self { table, unit, header_end: end + 1 })
    }

    /// The unit of angles: what the header says, else `unit`; both must not differ.
    pub(crate) fn angle_unit(&self, what: &str, unit: Option<AngleUnit>) -> Result<AngleUnit, ModelError> {
        let silent = || malformed(what, self.header_end, None, "the header has no inDegrees=yes or no".to_owned());
        match (self.unit, unit) {
            (Some(said), Some(told)) if said != told => {
                let (said, told) = (said.in_words(), told.in_words());
                let reason = format!("inDegrees says that angles are in {said}, but {told} was asked for");
                Err(malformed(what, self.header_end, None, reason))
            }
            (said, told) => said.or(told).ok_or_else(silent),
        }
    }
}

/// Every line of a header that sets `name`, with its number and the value: `nRows=220`, and `datarows 220` as SIMM
/// wrote it.
fn settings<'a>(header: &'a [&'a str], name: &'a str) -> impl Iterator<Item = (usize, &'a str)> {
    header.iter().enumerate().filter_map(move |(index, line)| {
        let (key, value) = line.split_once('=').or_else(|| line.trim().split_once(char::is_whitespace))?;
        key.trim().eq_ignore_ascii_case(name).then(|| (index + 1, value.trim()))
    })
}

/// What a header says of the unit of angles; said twice, it must be the same.
fn unit_said(what: &str, header: &[&str]) -> Result<Option<AngleUnit>, ModelError> {
    let mut said: Option<(usize, AngleUnit)> = None;
    for (line, word) in settings(header, "inDegrees") {
        let unit = match word {
            word if word.eq_ignore_ascii_case("yes") => AngleUnit::Degrees,
            word if word.eq_ignore_ascii_case("no") => AngleUnit::Radians,
            _ => return Err(malformed(what, line, None, format!("inDegrees={word}: expected yes or no"))),
        };
        match said {
            Some((before, other)) if other != unit => {
                let (unit, other) = (unit.in_words(), other.in_words());
                let reason = format!("inDegrees says that angles are in {unit}, but in {other} in line {before}");
                return Err(malformed(what, line, None, reason));
            }
            _ => said = Some((line, unit)),
        }
    }
    Ok(said.map(|(_, unit)| unit))
}

/// OpenSim 4 writes states by their paths: `/jointset/hip_r/hip_flexion_r/value` is the coordinate `hip_flexion_r`.
fn coordinate_name(name: &str) -> &str {
    name.strip_suffix("/value").and_then(|path| path.rsplit('/').next()).unwrap_or(name)
}
