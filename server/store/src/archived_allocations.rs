//! The allocations that an archive may contain: only unblinded ones.

use super::archived_row::{Cell, Row};

/// Condition for allocations of unblinded sessions; `?` is the study.
pub(super) const LAB: &str = "session_id in (select l.id from lab_sessions l join lab_acts t on t.session_id = l.id \
                              where l.study_id = ? and t.act = 'unblinded')";
/// Condition for allocations of pairs of unblinded raters.
pub(super) const PAIRS: &str = "presentation_id in (select p.id from presentations p join unblindings u \
                                on u.study_id = p.study_id and u.rater = p.rater where p.study_id = ?)";

/// Removes other columns that reveal an allocation: a legacy column, and the place in a block.
#[must_use]
pub fn masked(table: &str, mut row: Row) -> Row {
    match table {
        "lab_sessions" => row.set("gait_one_first", Cell::Integer(0)),
        "lab_allocations" => {
            for column in ["stratum", "block_size", "place"] {
                row.set(column, Cell::Null);
            }
        }
        _ => {}
    }
    row
}
