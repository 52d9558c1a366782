//! The part *Waiting for you* of the home page: studies that wait for an action of a person.

use gaitwright_service::access::Reach;
use gaitwright_service::error::Error;
use gaitwright_service::studies::{lifecycle, safety_reports};
use gaitwright_store::Connection;
use gaitwright_store::studies::{self, Study, StudyState};

/// A study with the action that it waits for.
pub(super) struct WaitingStudy {
    pub(super) study: Study,
    pub(super) what: String,
    /// The page of the action.
    pub(super) link: String,
}

/// The studies that wait for someone, at most `most` for each reason.
pub(super) async fn waiting_studies(db: &mut Connection, reach: Reach, most: u32) -> Result<Vec<WaitingStudy>, Error> {
    let unsafe_gaits = safety_reports::undecided(db, reach, most).await?.into_iter().map(unsafe_gaits);
    let held = studies::waiting_for_people(db, reach, most).await?.into_iter().map(waiting);
    Ok(unsafe_gaits.chain(held).collect())
}

/// Safety reports that staff have to review.
fn unsafe_gaits((study, count): (Study, usize)) -> WaitingStudy {
    let what = match count {
        1 => "1 gait reported as unsafe needs a safety review".to_owned(),
        _ => format!("{count} gaits reported as unsafe need a safety review"),
    };
    WaitingStudy { link: format!("/studies/{}", study.id), what, study }
}

fn waiting(study: Study) -> WaitingStudy {
    let (what, place) = match study.state {
        StudyState::Waiting => ("a comparison needs your answer".to_owned(), "/compare"),
        // A pause by a user has no reason; a pause by the service has one.
        StudyState::Paused if study.state_reason.is_empty() => ("paused: resume it to continue".to_owned(), ""),
        StudyState::Paused => (format!("paused: {}", study.state_reason), ""),
        _ => (lifecycle::in_words(study.state).to_owned(), ""),
    };
    WaitingStudy { link: format!("/studies/{}{place}", study.id), what, study }
}
