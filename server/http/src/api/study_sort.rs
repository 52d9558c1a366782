//! The order of studies in a list.

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
        let (ascending, name) = sort.strip_prefix('-').map_or((true, &*sort), |name| (false, name));
        let column = StudyColumn::ALL.into_iter().find(|column| column.as_str() == name).ok_or_else(|| {
            let names = StudyColumn::ALL.map(StudyColumn::as_str).join(", ");
            D::Error::custom(format!("one of {names}, with a leading minus for descending order"))
        })?;
        Ok(Self { column, ascending })
    }
}
