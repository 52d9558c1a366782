//! A lab script that evaluates trials over REST.

use crate::service::Service;
use gaitwright_store::trials::Trial;
use gaitwright_store::{StudyId, trials};
use serde_json::json;

/// Asks for a trial of a study and reports that it converged.
pub async fn trial(service: &Service, study: StudyId) -> Trial {
    let asked = service.post(&format!("/api/v1/studies/{study}/ask"), &json!({"script": "rig"})).await;
    assert!(asked.status.is_success(), "{}", asked.text);
    let id = asked.json()["id"].as_str().unwrap().to_owned();
    let told = json!({"label": "converged", "gait_rmse_rad": 0.5});
    let told = service.post(&format!("/api/v1/trials/{id}/tell"), &told).await;
    assert!(told.status.is_success(), "{}", told.text);
    trials::get(&mut service.store.read().await.unwrap(), id.parse().unwrap()).await.unwrap()
}
