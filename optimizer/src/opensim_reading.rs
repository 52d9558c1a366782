//! OpenSim motion and storage files (.mot, .sto): a header that ends with `endheader`, then a table over time.

use crate::model_error::ModelError;
use crate::table::{Separator, Table, TimeColumn, lines_of, malformed};

/// Unit of the angles in an OpenSim file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AngleUnit {
    /// Degrees.
    Degrees,
    /// Radians.
    Radians,
}

impl AngleUnit {
    pub(crate) fn in_words(self) -> &'static str {
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

/// A parsed file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StorageFile {
    pub(crate) table: Table,
    /// Unit of the angles in the header.
    unit: Option<AngleUnit>,
    /// Number of the line `endheader`.
    header_end: usize,
}

impl StorageFile {
    /// Parses header and table; `what` is the name of the file.
    pub(crate) fn read(what: &str, text: &str) -> Result<Self, ModelError> {
        let lines = lines_of(text);
        let end = lines
            .iter()
            .position(|line| line.trim().eq_ignore_ascii_case("endheader"))
            .ok_or_else(|| malformed(what, lines.len().max(1), None, "the line \"endheader\" is missing".to_owned()))?;
        let header = &lines[..end];
        let unit = unit_said(what, header)?;
        let table = Table::read(what, &lines[end + 1..], end + 2, Separator::Blank, TimeColumn::Column("time"))?
            .with_names(coordinate_name);
        let (rows, columns) = (table.len(), table.width());
        for (name, found) in [("nRows", rows), ("nColumns", columns), ("datarows", rows), ("datacolumns", columns)] {
            if let Some((line, value)) = settings(header, name).next()
                && value.parse::<usize>() != Ok(found)
            {
                let reason =
                    format!("the header has {name}={value}, but the file has {found}; check that the file is complete");
                return Err(malformed(what, line, None, reason));
            }
        }
        Ok(Self { table, unit, header_end: end + 1 })
    }

    /// The unit of the angles in the header.
    pub(crate) fn unit(&self) -> Option<AngleUnit> {
        self.unit
    }

    /// The unit of the angles: that of the header, or `unit` if the header has none. Both must agree.
    pub(crate) fn angle_unit(&self, what: &str, unit: Option<AngleUnit>) -> Result<AngleUnit, ModelError> {
        let silent = || {
            malformed(
                what,
                self.header_end,
                None,
                "the header has neither inDegrees=yes nor inDegrees=no; give the unit".to_owned(),
            )
        };
        match (self.unit, unit) {
            (Some(said), Some(told)) if said != told => {
                let (said, told) = (said.in_words(), told.in_words());
                let reason = format!("the header gives angles in {said}, but the unit given is {told}");
                Err(malformed(what, self.header_end, None, reason))
            }
            (said, told) => said.or(told).ok_or_else(silent),
        }
    }
}

/// All lines of a header that set `name`, with line number and value: `nRows=220`, or `datarows 220` in files of SIMM.
fn settings<'a>(header: &'a [&'a str], name: &'a str) -> impl Iterator<Item = (usize, &'a str)> {
    header.iter().enumerate().filter_map(move |(index, line)| {
        let (key, value) = line.split_once('=').or_else(|| line.trim().split_once(char::is_whitespace))?;
        key.trim().eq_ignore_ascii_case(name).then(|| (index + 1, value.trim()))
    })
}

/// The unit of the angles in a header. Repeated entries must agree.
fn unit_said(what: &str, header: &[&str]) -> Result<Option<AngleUnit>, ModelError> {
    let mut said: Option<(usize, AngleUnit)> = None;
    for (line, word) in settings(header, "inDegrees") {
        let unit = match word {
            word if word.eq_ignore_ascii_case("yes") => AngleUnit::Degrees,
            word if word.eq_ignore_ascii_case("no") => AngleUnit::Radians,
            _ => return Err(malformed(what, line, None, format!("inDegrees={word}: the value must be yes or no"))),
        };
        match said {
            Some((before, other)) if other != unit => {
                let (unit, other) = (unit.in_words(), other.in_words());
                let reason = format!("this line gives angles in {unit}, but line {before} gives them in {other}");
                return Err(malformed(what, line, None, reason));
            }
            _ => said = Some((line, unit)),
        }
    }
    Ok(said.map(|(_, unit)| unit))
}

/// The coordinate of a state path of OpenSim 4: `/jointset/hip_r/hip_flexion_r/value` is `hip_flexion_r`.
fn coordinate_name(name: &str) -> &str {
    name.strip_suffix("/value").and_then(|path| path.rsplit('/').next()).unwrap_or(name)
}
