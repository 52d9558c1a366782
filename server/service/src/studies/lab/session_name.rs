//! The name of a session in the lab, which tells neither the study nor the gaits.

use gaitwright_store::LabSessionId;

/// The name that pages in the lab show.
pub fn name_in_lab(session: LabSessionId) -> String {
    session.short()
}
