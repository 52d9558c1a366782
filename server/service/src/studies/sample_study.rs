//! A sample study, which shows what a study looks like before a person takes part.

use super::built_in_entries;
use super::study_name;
use super::study_plan::{self, NewStudy};
use crate::access::Caller;
use crate::error::Error;
use gait_optimizer::Subject;
use gaitwright_store::Writer;
use gaitwright_store::studies::Study;

/// Number of trials of a sample study.
const TRIALS: u32 = 8;

/// Creates and starts a study of the first subject from the paper without muscles, whose solves take seconds.
///
/// # Errors
/// Errors of the database.
pub async fn create(writer: &mut Writer, caller: &Caller) -> Result<Study, Error> {
    let subject = built_in_entries::subject_with(writer, Subject::builtin(1)?).await?;
    let name = study_name::free(writer, caller.reach(), "Sample study").await?;
    let new = NewStudy { name: Some(name), muscles: false, number_of_trials: TRIALS, ..NewStudy::of(subject.id) };
    study_plan::create_by(writer, caller, new).await
}
