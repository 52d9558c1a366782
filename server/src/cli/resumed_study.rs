//! An interrupted run continues: the command finds its unfinished study in the record.

use super::output::tell;
use gaitwright_service::access::Reach;
use gaitwright_service::error::Error;
use gaitwright_service::studies::study_plan::{self, NewStudy};
use gaitwright_store::audit::Actor;
use gaitwright_store::studies::{AtlasRole, Study};
use gaitwright_store::{Store, commit, studies, trials};

/// The unfinished study with the same settings, or a new one.
pub(super) async fn resumed_or_new(store: &Store, new: NewStudy) -> Result<Study, Error> {
    let mut writer = store.write().await?;
    let wanted = study_plan::checked(&mut writer, Reach::Every, new.clone()).await?;
    let unfinished =
        studies::active(&mut writer).await?.into_iter().find(|study| study.plan.has_same_trials_as(&wanted));
    let study = if let Some(study) = unfinished {
        let done = trials::counts(&mut writer, study.id).await?;
        let ended = done.total - done.open;
        // How many trials an atlas needs is known at its end.
        let of_all = match study.plan.atlas {
            AtlasRole::Make => String::new(),
            AtlasRole::None | AtlasRole::Use => format!(" of {}", study.plan.number_of_trials),
        };
        tell(&format!("continuing study {}: {ended}{of_all} trials done", study.id));
        study
    } else {
        study_plan::create(&mut writer, &Actor::terminal(), Reach::Every, new).await?
    };
    commit(writer).await?;
    Ok(study)
}
