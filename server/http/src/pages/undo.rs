//! The time in which an answer that was just saved can be undone with one press.

use gaitwright_service::studies::undo::UNDO_WITHIN_S;
use gaitwright_store::{Instant, now};

/// Time in which a page with scripts offers *Undo*, s. The next comparison comes afterwards.
const UNDO_S: f64 = 5.0;

/// Seconds that are left to undo an answer, rounded up; `None` if the answer is not new. A page without scripts cannot take
/// the button away, so it offers *Undo* as long as the service accepts it.
pub(super) fn undo_seconds(saved_at: Instant) -> Option<f64> {
    let age = now().seconds_since(saved_at);
    (age <= UNDO_WITHIN_S).then(|| (UNDO_S - age).clamp(0.0, UNDO_S).ceil())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn undo_is_offered_for_five_seconds_with_scripts_and_two_minutes_without() {
        let ago = |seconds: i64| undo_seconds(now().plus_seconds(-seconds));
        assert_eq!([ago(0), ago(2), ago(60), ago(200)], [Some(5.0), Some(3.0), Some(0.0), None]);
    }
}
