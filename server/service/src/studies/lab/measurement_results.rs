//! Results of lab measurements: muscle activity over the gait cycle and limit cycles, with the model's values for
//! unblinded walks.

use super::emg_reading::EmgReading;
use super::file_format::WHAT;
use super::joint_cycles::{JointCycle, joint_cycles};
use super::session::still_shown;
use super::session_view::gait_of;
use super::upload::JointAngleReading;
use crate::error::Error;
use gait_optimizer::Gait;
use gait_optimizer::emg::{Activity, CycleActivity, EmgRmse, EmgSettings, ModelActivity, model_activity};
use gait_optimizer::limit_cycle::LimitCycle;
use gaitwright_compute::OnPool;
use gaitwright_store::audit::{self, Actor};
use gaitwright_store::lab_sessions;
use gaitwright_store::measurement_files::{self, MeasurementFile, MeasurementKind};
use gaitwright_store::{Connection, LabSessionId, MeasurementFileId, Packed, PackedText, Store, Writer, gaits};
use serde::{Deserialize, Serialize};
use serde_json::json;

/// Muscle activity of a walk over the gait cycle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WalkActivity {
    /// Number of the walk, 1 to 3.
    pub walk: u8,
    /// Measurement file that it was computed from.
    pub measurement_file_id: MeasurementFileId,
    /// Mean and standard deviation of each channel at 0, 1, ..., 100 % of the cycle from the heel strike of its leg,
    /// relative to the peak of walk 1.
    pub channels: Vec<CycleActivity>,
    /// Mean of each channel over the cycle.
    pub averages: Vec<f64>,
    /// EMG RMSE against walk 1, in total and for each channel. Null for walk 1.
    pub emg_rmse: Option<EmgRmse>,
}

/// Processed EMG recordings of a session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EmgResult {
    /// Settings of the filters.
    pub settings: EmgSettings,
    /// Walks with an EMG recording.
    pub walks: Vec<WalkActivity>,
}

/// The newest measurement file of each walk.
fn newest(recordings: &[MeasurementFile], kind: MeasurementKind) -> Vec<&MeasurementFile> {
    let of_walk = |walk| recordings.iter().rfind(|recording| recording.kind == kind && recording.walk == walk);
    (1..=super::WALKS).filter_map(of_walk).collect()
}

/// Filters, segments and normalises the newest EMG recordings of a session.
///
/// # Errors
/// [`Error::Invalid`] naming a setting, [`Error::Conflict`] without an EMG recording of walk 1.
pub async fn compute(store: &mut Store, id: LabSessionId, settings: EmgSettings) -> Result<EmgResult, Error> {
    let mut db = store.read().await?;
    still_shown(&mut db, id).await?;
    let recordings = measurement_files::of_session(&mut db, id).await?;
    let mut files: Vec<(u8, MeasurementFileId, EmgReading, PackedText)> = Vec::new();
    for recording in newest(&recordings, MeasurementKind::Emg) {
        let (reading, file) = measurement_files::file(&mut db, recording.id).await?;
        files.push((recording.walk, recording.id, reading, file));
    }
    drop(db);
    if files.first().is_none_or(|(walk, ..)| *walk != 1) {
        return Err(Error::conflict("Upload the EMG recording of walk 1 first. The other walks are compared with it."));
    }
    let process = move |pool: &OnPool| {
        let mut walks: Vec<WalkActivity> = Vec::new();
        let mut normal: Vec<CycleActivity> = Vec::new();
        for (walk, measurement_file_id, reading, file) in &files {
            let (recording, strikes) = reading.read(WHAT, &file.text(pool)?)?;
            let measured = recording.cycles(&reading.kept_strides(&strikes)?, &settings)?;
            let activity = if walks.is_empty() {
                normal = measured;
                Activity::of_normal_walking(&normal)?
            } else {
                Activity::of_gait(&measured, &normal)?
            };
            let Activity { channels, averages, emg_rmse } = activity;
            walks.push(WalkActivity {
                walk: *walk,
                measurement_file_id: *measurement_file_id,
                channels,
                averages,
                emg_rmse,
            });
        }
        Ok(EmgResult { settings, walks })
    };
    store.compute(process).await?
}

/// Stores the processed EMG of a session.
///
/// # Errors
/// Errors of the database.
pub async fn keep_result(
    writer: &mut Writer,
    actor: &Actor,
    id: LabSessionId,
    result: &EmgResult,
) -> Result<(), Error> {
    let kept = measurement_files::insert_result(writer, actor, id, result).await?;
    let used: Vec<MeasurementFileId> = result.walks.iter().map(|walk| walk.measurement_file_id).collect();
    let detail = json!({ "result": kept, "settings": result.settings, "recordings": used });
    audit::append(writer, actor, "lab_session.process", &format!("lab session {id}"), &detail).await?;
    Ok(())
}

/// Muscle activity of the model for a walk.
#[derive(Debug, Clone, PartialEq)]
pub struct WalkModel {
    /// Number of the walk, 2 or 3.
    pub walk: u8,
    /// Each channel whose muscle is in the model.
    pub muscles: Vec<ModelActivity>,
}

/// Processed EMG of a session, with the model's muscle activity.
#[derive(Debug, Clone, PartialEq)]
pub struct ProcessedEmg {
    /// Measured activity.
    pub result: EmgResult,
    /// Muscle activity of the model. Empty while the session is blinded, and for gaits without muscles.
    pub model: Vec<WalkModel>,
}

/// The newest processed EMG of a session, if any.
///
/// # Errors
/// Errors of the database.
pub async fn emg(store: &mut Store, id: LabSessionId) -> Result<Option<ProcessedEmg>, Error> {
    let mut db = store.read().await?;
    let Some(result) = measurement_files::newest_result::<EmgResult>(&mut db, id).await? else { return Ok(None) };
    drop(db);
    with_model(store, id, result).await.map(Some)
}

/// Adds the model's muscle activity to a result, if the session is unblinded.
///
/// # Errors
/// Errors of the database.
pub async fn with_model(store: &mut Store, id: LabSessionId, result: EmgResult) -> Result<ProcessedEmg, Error> {
    let mut db = store.read().await?;
    let mut gaits = Vec::new();
    for walk in &result.walks {
        gaits.extend(known_gait(&mut db, id, walk.walk).await?.map(|gait| (walk.walk, gait)));
    }
    drop(db);
    store.compute(move |pool| view(pool, result, &gaits)).await?
}

/// Combines a result with the model's muscle activity.
fn view(pool: &OnPool, result: EmgResult, gaits: &[(u8, Packed<Gait>)]) -> Result<ProcessedEmg, Error> {
    let mut model = Vec::new();
    for (number, gait) in gaits {
        let gait = gait.unpack(pool)?;
        let channels = result.walks.iter().filter(|walk| walk.walk == *number).flat_map(|walk| &walk.channels);
        let muscles: Vec<ModelActivity> = channels.filter_map(|channel| model_activity(&gait, channel)).collect();
        if !muscles.is_empty() {
            model.push(WalkModel { walk: *number, muscles });
        }
    }
    Ok(ProcessedEmg { result, model })
}

/// The gait of a walk. `None` without the device, while the session is blinded, and if the trajectory was pruned.
///
/// # Errors
/// Errors of the database.
pub async fn known_gait(db: &mut Connection, id: LabSessionId, walk: u8) -> Result<Option<Packed<Gait>>, Error> {
    let session = lab_sessions::get(db, id).await?;
    let Some(gait) = gait_of(&session, walk) else { return Ok(None) };
    Ok(gaits::find(db, gait).await?)
}

/// Limit cycles of a walk.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitCycles {
    /// Number of the walk, 1 to 3.
    pub walk: u8,
    /// Measurement file of the walk.
    pub measurement_file_id: MeasurementFileId,
    /// Cut-off frequency of the zero-phase low-pass filter before central differences, Hz.
    pub cutoff_hz: f64,
    /// Angle (rad) and velocity (rad/s) of each recorded joint, sample by sample.
    pub joints: Vec<LimitCycle>,
    /// Each recorded joint over the cycle of its leg, as recorded; without the joints of a leg whose heel strikes cannot be found.
    pub cycles: Vec<JointCycle>,
}

/// The limit cycles of the newest joint angles of each walk.
///
/// # Errors
/// Errors of the database.
pub async fn limit_cycles(store: &mut Store, id: LabSessionId) -> Result<Vec<LimitCycles>, Error> {
    let mut db = store.read().await?;
    let recordings = measurement_files::of_session(&mut db, id).await?;
    let mut files: Vec<(u8, MeasurementFileId, JointAngleReading, PackedText)> = Vec::new();
    for recording in newest(&recordings, MeasurementKind::JointAngles) {
        let (reading, file) = measurement_files::file(&mut db, recording.id).await?;
        files.push((recording.walk, recording.id, reading, file));
    }
    drop(db);
    let process = move |pool: &OnPool| {
        let cycles =
            |(walk, measurement_file_id, reading, file): (u8, MeasurementFileId, JointAngleReading, PackedText)| {
                let text = file.text(pool)?;
                let (joints, cycles) = (reading.limit_cycles(&text)?, joint_cycles(&reading.joints(&text)?));
                Ok(LimitCycles { walk, measurement_file_id, cutoff_hz: reading.cutoff_hz, joints, cycles })
            };
        files.into_iter().map(cycles).collect()
    };
    store.compute(process).await?
}
