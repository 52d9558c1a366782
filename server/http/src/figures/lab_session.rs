//! The figures of a lab session.

use super::lab_charts;
use crate::shared_state::AppState;
use gait_optimizer::Gait;
use gaitwright_charts::Figure;
use gaitwright_compute::OnPool;
use gaitwright_service::error::Error;
use gaitwright_service::studies::lab::{self, LabSessionView, LimitCycles};
use gaitwright_store::{LabSessionId, Store, lab_sessions};

/// Every figure of a lab session.
///
/// # Errors
/// [`Error::NotFound`]; errors of the database.
pub(crate) async fn of_session(app: &mut AppState, id: LabSessionId) -> Result<Vec<Figure>, Error> {
    let (emg, cycles) = (lab::emg(app.store_mut(), id).await?, measured_cycles(app.store_mut(), id).await?);
    let mut reader = app.read().await?;
    let session = LabSessionView::from(&lab_sessions::get(&mut reader, id).await?);
    drop(reader);
    let draw = move |_: &OnPool| {
        let mut figures = emg.map_or_else(Vec::new, |emg| lab_charts::emg(&session, &emg));
        figures.extend(lab_charts::joint_angles(&session, &cycles));
        figures.extend(lab_charts::limit_cycles(&session, &cycles));
        figures
    };
    Ok(app.compute(draw).await?)
}

/// The limit cycles of each walk, with the limit cycle of its gait after unblinding.
pub(crate) async fn measured_cycles(
    store: &mut Store,
    id: LabSessionId,
) -> Result<Vec<(LimitCycles, Option<Gait>)>, Error> {
    let mut found = Vec::new();
    for cycles in lab::limit_cycles(store, id).await? {
        let gait = lab::known_gait(&mut *store.read().await?, id, cycles.walk).await?;
        let gait = store.compute(move |pool| gait.map(|gait| gait.unpack(pool)).transpose()).await??;
        found.push((cycles, gait));
    }
    Ok(found)
}
