//! The allocations that an archive may contain: only unblinded ones.

/// Condition for allocations of unblinded sessions; `?` is the study.
pub(super) const LAB: &str = "lab_session_id in (select l.id from lab_sessions l join lab_session_steps t on t.lab_session_id = l.id \
                              where l.study_id = ? and t.step = 'unblinded')";
/// Condition for allocations of pairs of unblinded raters.
pub(super) const PAIRS: &str = "pair_id in (select p.id from blind_pairs p join rater_unblindings u \
                                on u.study_id = p.study_id and u.rater = p.rater where p.study_id = ?)";
