//! The order of studies in a list.

use super::sort_column::column_and_direction;
use gaitwright_store::studies::StudyColumn;
use serde::de::{Deserialize, Deserializer, Error as _};

/// The column to sort by. A leading minus sorts in descending order.
#[derive(Debug, Clone, Copy)]
pub(super) struct StudySort {
    pub(super) column: StudyColumn,
    pub(super) ascending: bool,
}

impl Default for StudySort {
    /// Newest first.
    fn default() -> Self {
        Self { column: StudyColumn::CreatedAt, ascending: false }
    }
}

impl<'de> Deserialize<'de> for StudySort {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let sort = String::deserialize(deserializer)?;
        let found = column_and_direction(&sort, &StudyColumn::ALL, StudyColumn::as_str);
        let (column, descending) = found.map_err(D::Error::custom)?;
        Ok(Self { column, ascending: !descending })
    }
}
