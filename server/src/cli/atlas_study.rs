//! The atlas from which `tune --atlas` takes its gaits: a study of its own in the same record.

use super::output::tell;
use super::resumed_study;
use super::unattended_study::{self, Lines};
use gaitwright_compute::OnPool;
use gaitwright_service::access::Reach;
use gaitwright_service::error::Error;
use gaitwright_service::studies::atlas::{self, AtlasProgress};
use gaitwright_service::studies::study_plan::{self, NewStudy};
use gaitwright_store::Store;
use gaitwright_store::studies;

/// Makes the atlas of the problem of a study, or continues it, unless the record has it. `None` if a person stopped it.
pub(super) async fn complete(store: &Store, study: NewStudy, workers: usize) -> Result<Option<()>, Error> {
    let wanted = study_plan::checked(&mut *store.read().await?, Reach::Every, study.clone()).await?;
    if let Some(atlas) = studies::finished_atlas(&mut *store.read().await?, &wanted).await? {
        tell(&format!("taking gaits from the atlas of study {atlas}"));
        return Ok(Some(()));
    }
    tell("making the atlas of this problem");
    let made = Box::pin(resumed_study::resumed_or_new(store, atlas::atlas_of(study))).await?;
    let ran = Box::pin(unattended_study::run(store, &made, workers, Lines::Atlas)).await?;
    let snapshot = ran.snapshot;
    let reason = snapshot.study.state_reason.clone();
    let count = move |pool: &OnPool| atlas::progress(pool, &snapshot.study.plan, &snapshot.trials);
    let AtlasProgress { actions, with_result, with_gait, gaits, .. } = store.clone().compute(count).await?;
    if ran.interrupted {
        tell(&format!(
            "interrupted: {with_result} of {actions} actions have a result; run the same command again to continue"
        ));
        return Ok(None);
    }
    if with_gait == 0 {
        return Err(Error::Malformed(reason));
    }
    tell(&format!("the atlas has {gaits} gaits: {with_gait} of {actions} actions have one"));
    Ok(Some(()))
}
